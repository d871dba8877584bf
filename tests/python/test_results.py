"""Volumes, images, meshes, metrics and clash: against exact values, and against the command line."""

import json
import math
import subprocess
import sys

import numpy as np
import pytest

import ldi_ops as ldi


def command_line(*arguments: object) -> dict:
    run = subprocess.run(
        [sys.executable, "-m", "ldi_ops", *map(str, arguments), "--json", "-"], capture_output=True, text=True
    )
    assert run.returncode in (0, 1), run.stderr
    return json.loads(run.stdout)


def test_exact_volumes_have_value_error_unit_and_method():
    ring = ldi.torus(major=10, minor=3, around=96, across=48)
    volume = ring.volume()
    assert str(volume) == "1770.195 mm³ (exact)"
    assert (volume.method, volume.unit) == ("exact", "mm³")
    assert float(volume) == volume.value and 0 <= volume.error < 1e-6
    assert volume.lower is None and volume.is_below(1e9) is None


def test_bounds_decide_about_limits():
    ring = ldi.torus()
    volume = ring.volume(bounds=True)
    assert volume.lower <= volume.value <= volume.upper
    assert volume.is_below(volume.value + 1) is True and volume.is_above(volume.value + 1) is False


def test_operators_are_the_set_operations_of_boxes():
    a = ldi.cuboid(min=(0, 0, 0), max=(2, 2, 2))
    b = ldi.cuboid(min=(1, 0, 0), max=(4, 2, 2))
    volumes = [float(shape.volume()) for shape in (a & b, a | b, a - b, b - a, a ^ b)]
    assert volumes == pytest.approx([4, 16, 4, 8, 12], abs=1e-12)


def test_sums_and_offsets_of_boxes_are_within_their_errors():
    a = ldi.cuboid(min=(0, 0, 0), max=(2, 2, 2))
    b = ldi.cuboid(min=(0, 0, 0), max=(1, 1, 1))
    rounded = 8 + 24 * 0.5 + 6 * math.pi * 0.25 + 4 / 3 * math.pi * 0.125
    for shape, exact in [(a.minkowski(b), 27), (a.minkowski_difference(b), 1), (a.offset(0.5), rounded), (a.offset(-0.5), 1)]:
        volume = shape.volume(resolution=64)
        assert abs(volume.value - exact) <= volume.error + 1e-9, shape
    assert float(a.opening(0.5).volume(resolution=64)) < 8 < float(a.closing(0.5).volume(resolution=64)) + 0.1
    refined = a.offset(0.5).volume(tolerance=0.002)
    assert refined.error <= 0.002 * refined.value


def test_volumes_and_metrics_equal_those_of_the_command_line(models, gyroid, bone):
    files = (models / "gyroid_sheet.stl", models / "bone.stl", "--unit", "mm")
    told = command_line("intersect", *files)
    assert float((gyroid & bone).volume()) == told["volume"]["value"]
    told = command_line("intersect", *files, "--estimate", "--resolution", 96, "--axis", "all")
    assert (gyroid & bone).sample(resolution=96).volume().value == told["volume"]["value"]


def test_images_are_views_of_samples_that_sum_to_the_volume(gyroid):
    image = gyroid.sample(resolution=64)
    for axis, columns in (("x", 1), ("y", 0), ("z", 0)):
        depths, offsets = image.depths(axis), image.offsets(axis)
        assert depths.dtype == np.int32 and offsets.dtype == np.uint32
        assert not depths.flags.writeable and depths.base is not None
        assert offsets[0] == 0 and offsets[-1] == len(depths) and len(depths) % 2 == 0
        length = (depths[1::2].astype(np.int64) - depths[::2]).sum() * image.step
        assert length * image.spacing**2 == pytest.approx(image.volume().value, rel=0.01)
        assert len(offsets) == 1 + image.shape[columns] * image.shape[2 if axis != "z" else 1]
    depths = image.depths("z")
    del image
    assert depths.sum() > 0  # The array keeps the image alive.


def test_voxels_are_the_nodes_of_the_depths(gyroid):
    image = gyroid.sample(resolution=48)
    inside = image.to_numpy()
    assert inside.dtype == np.bool_ and inside.shape == image.shape and inside.flags.c_contiguous
    depths, offsets = image.depths("z"), image.offsets("z")
    first, apart = (image.origin[2] - image.corner[2]) / image.step, image.spacing / image.step
    heights = np.round(first + apart * np.arange(image.shape[2]))
    for x, y in [(0, 0), (24, 24), (7, 31), (40, 11)]:
        ray = x + y * image.shape[0]
        samples = depths[offsets[ray] : offsets[ray + 1]]
        expected = (samples[None, :] < heights[:, None]).sum(axis=1) % 2 == 1
        assert (inside[x, y] == expected).all()
    shares = image.coverage()
    assert shares.dtype == np.float32 and shares.shape == image.shape
    assert shares.min() >= 0 and shares.max() <= 1 + 1e-6
    spans = [image.depths(axis).astype(np.int64) for axis in "xyz"]
    along_rays = sum((depths[1::2] - depths[::2]).sum() for depths in spans) / 3
    assert shares.sum(dtype=np.float64) * image.spacing == pytest.approx(along_rays * image.step, rel=1e-6)


def test_meshes_are_closed_and_go_back_in(gyroid, bone):
    common = gyroid & bone
    vertices, faces = common.mesh()
    assert vertices.dtype == np.float64 and faces.dtype == np.int64
    assert vertices.flags.c_contiguous and faces.flags.c_contiguous
    again = ldi.load((vertices, faces), unit="mm")
    assert float(again.volume()) == pytest.approx(float(common.volume()), rel=1e-12)
    image = common.sample(resolution=64)
    full, few = image.mesh(surface_error=0), image.mesh(surface_error="0.2h")
    assert len(few[1]) < len(image.mesh()[1]) < len(full[1])
    assert len(few[1]) < len(full[1]) / 2
    assert float(ldi.load(few).volume()) == pytest.approx(image.volume().value, rel=0.03)
    assert len(image.mesh(surface_error=0.2 * image.spacing)[1]) == len(few[1])
    # Some details of the common solid are finer than the pitch of 128 rays, and get finer cells.
    finer = common.sample(resolution=128)
    assert len(finer.mesh(surface_error=0, refine=0)[1]) < len(finer.mesh(surface_error=0)[1])
    with pytest.raises(ldi.UsageError, match="0 to 4"):
        image.mesh(refine=5)


def test_files_are_written_and_read(tmp_path, gyroid, bone):
    common = gyroid & bone
    common.save(tmp_path / "exact.3mf")
    assert float(ldi.load(tmp_path / "exact.3mf").volume()) == pytest.approx(float(common.volume()), rel=1e-9)
    image = common.sample(resolution=48)
    for name in ("image.npz", "voxels.vti", "voxels.npy", "mesh.stl"):
        image.save(tmp_path / name)
        assert (tmp_path / name).stat().st_size > 100
    stored = np.load(tmp_path / "voxels.npy")
    assert stored.sum() == image.to_numpy().sum()
    with pytest.raises(ldi.InputError, match="png"):
        image.save(tmp_path / "mesh.png")


def test_thickness_of_a_plate_is_its_thickness():
    plate = ldi.cuboid(min=(0, 0, 0), max=(4, 4, 1))
    thickness = plate.thickness(resolution=64)
    assert thickness.dtype == np.float32 and thickness.shape == (64, 64, 16)
    assert thickness.max() == pytest.approx(1, abs=0.01)
    assert np.median(thickness) == pytest.approx(1, abs=0.01)


def test_metrics_are_a_mapping_with_bounds_and_units(tmp_path, gyroid, bone):
    metrics = gyroid.metrics(region=bone, resolution=48)
    assert isinstance(metrics, ldi.Metrics) and len(metrics) == len(list(metrics)) == len(dict(metrics))
    porosity = metrics["porosity"]
    assert porosity.lower <= porosity.value <= porosity.upper and porosity.unit == "1" and porosity.status == "measured"
    assert "nothing" not in metrics and metrics.get("nothing") is None
    with pytest.raises(KeyError):
        metrics["nothing"]
    frame = metrics.to_pandas()
    assert frame.loc["porosity", "value"] == porosity.value and frame["value"].dtype == np.float64
    metrics.save(tmp_path / "report")
    assert {"report.html", "metrics.json", "metrics.csv"} <= {path.name for path in (tmp_path / "report").iterdir()}
    assert metrics.passed is None


def test_metrics_take_the_regions_and_settings_of_reports():
    box = ldi.hollow_box(size=(3, 3, 3), hollow=(1, 1, 1))
    whole, wrapped, hull = (box.metrics(region=region, view=False, resolution=24) for region in (None, "wrap:2mm", "hull"))
    # The hollow is a pore within the box and its hull; a ball from outside does not reach it.
    for metrics in (whole, wrapped, hull):
        assert metrics["porosity"].value == pytest.approx(1 / 27, abs=0.01)
    lattice = ldi.cubic(cells=2, cell_size=4, radius=0.6, resolution=12)
    usual = lattice.metrics(view=False, resolution=24)
    for name, settings in [
        ("pore.thickness.mean", {"edges": "clip"}),
        ("tortuosity.pore.diffusive.x", {"tortuosity_resolution": 8}),
        ("overhang", {"overhang_angle": 90}),
    ]:
        assert usual[name].value != lattice.metrics(view=False, resolution=24, **settings)[name].value, name
    for wrong in ({"edges": "open"}, {"build": "up"}, {"region": "wrap:0"}, {"region": "box"}, {"tortuosity_resolution": 1}):
        with pytest.raises(ldi.UsageError):
            box.metrics(resolution=24, **wrong)


def test_limits_are_kept_or_broken():
    cube = ldi.hollow_box(size=(3, 3, 3), hollow=(1, 1, 1))
    kept = cube.metrics(limits={"porosity": {"max": "50 %"}}, resolution=24)
    broken = cube.metrics(limits={"porosity": {"min": "50 %"}}, resolution=24)
    assert (kept.passed, broken.passed) == (True, False)
    with pytest.raises(ldi.Error, match="porosty"):
        cube.metrics(limits={"porosty": {"min": 0.5}}, resolution=24)
    with pytest.raises(TypeError, match="'porosity'.*'min'"):
        cube.metrics(limits={"porosity": 5}, resolution=24)


def test_clash_finds_overlaps_and_gaps():
    parts = {
        "a": ldi.cuboid(min=(0, 0, 0), max=(1, 1, 1)),
        "b": ldi.cuboid(min=(0.5, 0, 0), max=(2, 1, 1)),
        "c": ldi.cuboid(min=(2.25, 0, 0), max=(3, 1, 1)),
    }
    clashes = ldi.clash(parts, clearance=0.3)
    frame = clashes.to_pandas().set_index(["a", "b"])
    assert frame.loc[("a", "b"), "finding"] == "overlap"
    assert frame.loc[("a", "b"), "volume"] == pytest.approx(0.5, abs=1e-12)
    assert frame.loc[("b", "c"), "finding"] == "clearance"
    assert frame.loc[("b", "c"), "distance"] == pytest.approx(0.25, abs=1e-12)
    assert len(clashes.findings) == len(clashes) == 2 and clashes.unit == "mm"
    assert len(ldi.clash(parts, clearance=0.3, ignore=["a:b"])) == 1


def test_pictures_are_png_files(gyroid):
    assert gyroid.picture(160, 120).startswith(b"\x89PNG")
    page = gyroid._repr_html_()
    assert "gyroid_sheet" in page and "mm³" in page


def test_transformed_solids_move():
    cube = ldi.cuboid(min=(0, 0, 0), max=(1, 1, 1))
    matrix = np.array([[2, 0, 0, 5], [0, 1, 0, 0], [0, 0, 1, -1]])
    moved = cube.transformed(matrix)
    assert moved.bounds == ([5, 0, -1], [7, 1, 0]) and float(moved.volume()) == 2
    with pytest.raises(ldi.UsageError):
        cube.transformed(np.ones((2, 4)))
