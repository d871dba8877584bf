"""Clashes of files: the result does not depend on who compares the pairs."""

import json
import multiprocessing
import os
import pickle
import re
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool

import numpy as np
import pytest

import ldi_ops as ldi

PLACES = [(0, 0, 0), (40, 0, 3), (0, 30, -5)]
SETTINGS = {"clearance": 0.5, "ignore": ["bolt*:plate*", "nut*:*"], "resolution": 48, "unit": "mm"}


def spawned(workers: int, **keywords) -> ProcessPoolExecutor:
    return ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn"), **keywords)


def moved(solid: ldi.Solid, place, scale: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    return solid.vertices * scale + np.array(place) * scale, solid.faces.astype("int64")


def crossing_itself(radius: float) -> ldi.Solid:
    """Two balls that overlap in one mesh, whose volume depends on the fill rule."""
    vertices, faces = moved(ldi.geodesic(radius=radius, frequency=4), (0, 0, 0))
    return ldi.load((np.vstack([vertices, vertices + [radius / 2, 0, 0]]), np.vstack([faces, faces + len(vertices)])))


@pytest.fixture(scope="module")
def parts(tmp_path_factory) -> dict[str, object]:
    """Ten parts at each of three places, that overlap, touch, come near, hold one another or are apart; some in cm."""
    folder = tmp_path_factory.mktemp("parts")

    def box(low, high):
        return ldi.cuboid(min=low, max=high)

    def ball(radius):
        return ldi.geodesic(radius=radius, frequency=5)

    kinds = {
        "plate": (box((-5, -5, -1), (5, 5, 0)), (0, 0, 0)),
        "bolt": (box((-0.5, -0.5, -3), (0.5, 0.5, 2)), (1, 1, 0)),
        "foot": (box((-1, -1, 0), (1, 1, 2)), (-3, -3, 0)),
        "ball": (ball(1.0), (3, -3, 0.5)),
        "near": (ball(0.7), (-3, 3, 1.1)),
        "cube": (box((-0.4, -0.4, -0.4), (0.4, 0.4, 0.4)), (1.7, 0, 6)),
        "shell": (ball(2.0), (0, 0, 5)),
        "kernel": (ball(0.5), (0, 0, 5)),
        "double": (crossing_itself(1.0), (1.7, 0, 5)),
        "apart": (ball(1.0), (4.6, -4.6, 2.1)),
    }
    paths: dict[str, object] = {}
    for at, place in enumerate(PLACES):
        for name, (solid, own) in kinds.items():
            path = folder / f"{name}{at}.{'3mf' if name == 'cube' else 'stl'}"
            scale, unit = (0.1, "cm") if name == "cube" else (1.0, "mm")
            # Places are no round numbers, so that all bits of the results are compared.
            ldi.load(moved(solid, np.add(place, own) + 0.001 * at, scale), unit=unit).save(path)
            paths[f"{name} {at}"] = [path, str(path), os.path.relpath(path)][at]
    return paths


def facts(clashes: ldi.Clashes) -> dict[str, object]:
    """Returns what a result has in memory."""
    return {name: getattr(clashes, name) for name in ("pairs", "findings", "parts", "unit", "warnings")}


def saved(clashes: ldi.Clashes, folder) -> dict[str, object]:
    """Returns the files that a result writes, without their times."""
    clashes.save(folder)
    record = json.loads((folder / "clash.json").read_text())
    assert record.pop("seconds") and record.pop("peak_memory_bytes")
    page, times = re.subn(r"Compared in [^<]*s\.", "", (folder / "clash.html").read_text())
    assert times == 1
    return {"json": json.dumps(record), "csv": (folder / "clash.csv").read_bytes(), "page": page}


@pytest.fixture(scope="module")
def clashes(parts) -> ldi.Clashes:
    return ldi.clash(parts, **SETTINGS)


@pytest.fixture(scope="module")
def whole(clashes) -> dict[str, object]:
    return facts(clashes)


@pytest.fixture(scope="module")
def whole_saved(clashes, tmp_path_factory) -> dict[str, object]:
    return saved(clashes, tmp_path_factory.mktemp("whole"))


def test_the_assembly_has_all_kinds_of_pairs(whole, whole_saved, parts):
    assert len(parts) == 30 and whole["unit"] == "mm"
    record, findings = json.loads(whole_saved["json"]), {row["finding"] for row in whole["findings"]}
    assert findings == {"overlap", "touching", "clearance"} and len(whole["pairs"]) > len(whole["findings"]) > 12
    states = {(row["a"], row["b"]): row["state"] for row in whole["pairs"]}
    assert states["plate 0", "foot 0"] == "touching" and states["plate 0", "near 0"] == "separate"
    assert ("plate 0", "bolt 0") not in states and record["counts"]["ignored_pairs"] == 3
    kernel = next(pair for pair in record["pairs"] if pair["b"] == "kernel 2")
    assert kernel["overlap"]["contained"] == "kernel 2"
    assert {"unit-converted", "ignores-nothing", "fill-rules-differ"} <= {code for code, _ in whole["warnings"]}


def test_paths_are_the_solids_of_their_files(whole, parts):
    solids = {name: ldi.load(path, None if "cube" in name else "mm") for name, path in parts.items()}
    settings = {key: value for key, value in SETTINGS.items() if key != "unit"}
    assert facts(ldi.clash(solids, **settings, threads=1)) == whole
    mixed = {name: solids[name] if "ball" in name else path for name, path in parts.items()}
    assert facts(ldi.clash(mixed, **SETTINGS)) == whole


@pytest.mark.parametrize("workers", [1, 2, 4])
def test_results_are_the_same_with_any_number_of_workers(whole, whole_saved, parts, tmp_path, workers):
    with spawned(workers) as executor:
        clashes = ldi.clash(parts, **SETTINGS, executor=executor)
    assert facts(clashes) == whole
    if workers == 2:
        assert saved(clashes, tmp_path) == whole_saved


def test_results_are_the_same_through_dask(whole, parts):
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        clashes = ldi.clash(parts, **SETTINGS, executor=client.get_executor())
    assert facts(clashes) == whole


class Recorder(ThreadPoolExecutor):
    """Keeps what is sent to workers, and does something before."""

    def __init__(self, before=lambda: None):
        super().__init__(2)
        self.before, self.sent, self.futures = before, [], []

    def submit(self, function, /, *arguments):
        self.before()
        self.sent.append(pickle.dumps(arguments))
        self.futures.append(super().submit(function, *pickle.loads(self.sent[-1])))
        return self.futures[-1]


def test_workers_get_the_paths_of_few_parts_and_no_meshes(whole, parts):
    with Recorder() as executor:
        assert facts(ldi.clash(parts, **SETTINGS, executor=executor)) == whole
    files = [pickle.loads(sent)[-1][0] for sent in executor.sent]
    assert len(files) == 8 and all(len(set(tile)) == len(tile) for tile in files)
    # Eight tiles at three places of ten parts: none needs more than one place.
    assert max(len(tile) for tile in files) <= 10
    assert max(map(len, executor.sent)) < 4000


@pytest.mark.parametrize("is_cut", [False, True])
def test_files_that_change_before_a_worker_reads_them_are_refused(tmp_path, is_cut):
    paths = {name: tmp_path / f"{name}.stl" for name in "ab"}
    for x, path in enumerate(paths.values()):
        ldi.load(moved(ldi.cuboid(), (0.5 * x, 0, 0))).save(path)

    def change():
        if is_cut:
            paths["b"].write_bytes(paths["b"].read_bytes()[:-50])
        else:
            ldi.load(moved(ldi.cuboid(), (0.75, 0, 0))).save(paths["b"])

    with Recorder(change) as executor, pytest.raises(ldi.InputError, match=r"b\.stl.*part 'b'.*changed"):
        ldi.clash(paths, executor=executor)


def test_solids_cannot_be_sent_to_workers(parts):
    with Recorder() as executor, pytest.raises(ldi.UsageError, match="part 'nut' is a Solid.*save it to a file"):
        ldi.clash({**parts, "nut": ldi.geodesic()}, executor=executor)
    assert executor.sent == []


def test_files_that_cannot_be_read_are_named(parts, tmp_path):
    with pytest.raises(ldi.InputError, match="missing.stl"):
        ldi.clash({**parts, "nut": tmp_path / "missing.stl"})


def test_units_that_no_file_takes_leave_a_warning(parts):
    cubes = {name: path for name, path in parts.items() if "cube" in name}
    with pytest.warns(UserWarning, match="unit='mm' is ignored"):
        assert ldi.clash(cubes, unit="mm").unit == "cm"


def test_progress_counts_pairs_and_stops_the_comparison(whole, parts):
    heard = []

    def progress(stage, done, total):
        heard.append((stage, done, total))
        return stage != "pairs" or done < total / 3

    with Recorder() as executor, ldi.options(progress=progress), pytest.raises(ldi.Cancelled, match="stopped the clash"):
        ldi.clash(parts, **SETTINGS, executor=executor)
    counts = [(done, total) for stage, done, total in heard if stage == "pairs"]
    assert 0 < counts[-1][0] < counts[-1][1] == len(whole["pairs"])
    assert any(future.cancelled() for future in executor.futures)


def test_workers_that_die_are_reported(parts):
    with spawned(1, initializer=os._exit, initargs=(1,)) as executor:
        with pytest.raises(ldi.MachineError, match="a worker died.*fewer workers.*options") as caught:
            ldi.clash(parts, **SETTINGS, executor=executor)
    assert isinstance(caught.value.__cause__, BrokenProcessPool)


def test_overlaps_without_an_exact_volume_are_sampled_as_asked(tmp_path):
    # A closed surface with one side.
    corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.1], [0.2, 1.0, 0.0], [0.0, 0.1, 1.0], [1.0, 0.9, 0.3], [0.3, 1.0, 1.0]]
    faces = [[0, 1, 4], [0, 1, 5], [0, 2, 3], [0, 2, 5], [0, 3, 4], [1, 2, 3], [1, 2, 4], [1, 3, 5], [2, 4, 5], [3, 4, 5]]
    parts: dict[str, object] = {"knot": str(tmp_path / "knot.stl"), "box": str(tmp_path / "box.stl")}
    ldi.load((np.array(corners), np.array(faces)), unit="mm").save(parts["knot"])
    ldi.cuboid(min=(-1, -1, -1), max=(2, 2, 0.5)).save(parts["box"])
    found = {}
    for name, value in [("resolution", 200), ("pitch", 0.01), ("pitch", 0.1), ("tolerance", 0.01)]:
        (pair,) = ldi.clash(parts, **{name: value}).pairs
        assert pair["volume_lower"] < pair["volume"] < pair["volume_upper"]
        found[name, value] = pair
    best, tolerant = found["pitch", 0.01], found["tolerance", 0.01]
    assert all(pair["volume_lower"] <= best["volume"] <= pair["volume_upper"] for pair in found.values())
    assert len({pair["volume"] for pair in found.values()}) == 4
    assert tolerant["volume_upper"] - tolerant["volume_lower"] <= 2 * 0.01 * tolerant["volume"]
    for settings in [{"pitch": 0.1, "resolution": 8}, {"pitch": 0.1, "tolerance": 0.1}, {"pitch": -1}, {"tolerance": 0}]:
        with pytest.raises(ldi.UsageError):
            ldi.clash(parts, **settings)

    # No ray meets a rod as thin as this; a worker's warning arrives.
    parts["box"] = str(tmp_path / "rod.stl")
    ldi.cuboid(min=(0.3, 0.3, -50), max=(0.3001, 0.3001, 50)).save(parts["box"])
    alone = ldi.clash(parts, tolerance=0.01)
    ((code, message),) = [warning for warning in alone.warnings if warning[0] == "tolerance-not-reached"]
    assert message.startswith("knot and box: --tolerance 1 %: not reached with 1024 rays"), (code, message)
    with spawned(1) as executor:
        assert facts(ldi.clash(parts, tolerance=0.01, executor=executor)) == facts(alone)
