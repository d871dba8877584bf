"""Sweeps: rows do not depend on workers, failures are rows, and what was stopped goes on."""

import functools
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import pyarrow
import pyarrow.parquet as parquet
import pytest
from sweep_designs import PLAN, kills_its_worker_once, options_of_worker, scaffold

import ldi_ops as ldi
from ldi_ops._executor import results, threads_of_worker

HERE = Path(__file__).parent


def spawned(workers: int) -> ProcessPoolExecutor:
    return ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn"))


@pytest.fixture(scope="module")
def serial(tmp_path_factory) -> bytes:
    out = tmp_path_factory.mktemp("sweep") / "runs.parquet"
    ldi.sweep(scaffold, PLAN, out=out, resolution=24)
    return out.read_bytes()


def test_rows_are_designs_with_metrics_units_and_failures(serial, tmp_path):
    out = tmp_path / "runs.parquet"
    out.write_bytes(serial)
    frame = ldi.sweep(scaffold, PLAN, out=out, resolution=24)
    assert list(zip(frame["wall"], frame["cells"])) == [(w, c) for w in PLAN["wall"] for c in PLAN["cells"]]
    failed = frame[frame["status"] == "failed"]
    assert len(failed) == 1 and failed["error"].item() == "RuntimeError: this design has no shape"
    measured = frame[frame["status"] == "measured"]
    assert (measured["porosity"].diff().dropna().abs() > 0).all()
    schema = parquet.read_schema(out)
    assert schema.field("solid.thickness.mean").metadata[b"unit"] == b"mm"
    assert schema.field("porosity").metadata == {b"unit": b"1", b"name": b"Porosity"}
    first = ldi.gyroid(cells=1, cell_size=4, wall=0.6, resolution=16).metrics(resolution=24)
    assert frame["porosity"][0] == first["porosity"].value
    assert sorted(path.name for path in tmp_path.iterdir()) == ["runs.html", "runs.parquet"]


def test_the_page_has_the_front_and_the_designs(serial, tmp_path):
    out = tmp_path / "runs.parquet"
    out.write_bytes(serial)
    frame = ldi.sweep(scaffold, PLAN, out=out, pareto={"porosity": "max", "BS/BV": "min"}, resolution=24)
    page = out.with_suffix(".html").read_text()
    assert "<h1>6 designs of scaffold</h1>" in page and "large porosity, small specific surface" in page
    assert '<p class="facts">resolution 24</p>' in page
    assert "Design 2: wall 0.6, cells 2</strong> <span>RuntimeError: this design has no shape" in page
    measured = frame[frame["status"] == "measured"]
    assert set(measured["surface.specific.status"]) == {"measured"}
    values = list(zip(-measured["porosity"], measured["surface.specific"]))
    best = [a for a in values if not any(b != a and b[0] <= a[0] and b[1] <= a[1] for b in values)]
    assert page.count('<span class="chip kept">front</span>') == len(best)


def test_sweeps_of_the_command_line_have_the_same_rows(tmp_path):
    plan = tmp_path / "plan.toml"
    plan.write_text('model = "gyroid"\n[parameters]\ncell-size = 3\nwall = [0.7, 0.9]\ncells = 1\n[settings]\nresolution = 12\n')
    command = [sys.executable, "-m", "ldi_ops", "sweep", plan, "-o", tmp_path / "runs", "--quiet"]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    read = ldi.read_sweep(tmp_path / "runs", out=tmp_path / "read.parquet")
    grid = {"cell_size": 3, "wall": [0.7, 0.9], "cells": 1}
    swept = ldi.sweep("gyroid", grid, out=tmp_path / "swept.parquet", resolution=12)
    assert read.drop(columns="design").equals(swept.drop(columns="design"))
    assert read["porosity"][0] > read["porosity"][1] > 0
    assert parquet.read_schema(tmp_path / "read.parquet").field("volume.solid").metadata[b"unit"] == b"mm^3"


@pytest.mark.parametrize("workers", [1, 2, 4])
def test_rows_are_the_same_bytes_with_any_number_of_workers(serial, tmp_path, workers):
    with spawned(workers) as executor:
        ldi.sweep(scaffold, PLAN, out=tmp_path / "runs.parquet", executor=executor, resolution=24)
    assert (tmp_path / "runs.parquet").read_bytes() == serial


def test_rows_are_the_same_bytes_through_dask(serial, tmp_path):
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        client.run(lambda: __import__("sys").path.insert(0, str(HERE)))
        ldi.sweep(scaffold, PLAN, out=tmp_path / "runs.parquet", executor=client.get_executor(), resolution=24)
    assert (tmp_path / "runs.parquet").read_bytes() == serial


DRIVER = """
import multiprocessing, sys
from concurrent.futures import ProcessPoolExecutor
import ldi_ops as ldi
from sweep_designs import PLAN, scaffold

if __name__ == "__main__":
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as executor:
        ldi.sweep(scaffold, PLAN, out=sys.argv[1], executor=executor, resolution=24)
"""


@pytest.mark.parametrize("kept", [1, 3])
def test_killed_sweeps_go_on_where_they_were(serial, tmp_path, kept):
    driver, out = tmp_path / "driver.py", tmp_path / "runs.parquet"
    driver.write_text(DRIVER)
    child = subprocess.Popen(
        [sys.executable, driver, out], env={**os.environ, "PYTHONPATH": str(HERE)}, start_new_session=True
    )
    parts = tmp_path / "runs.parquet.parts"
    deadline = time.monotonic() + 120
    while len(list(parts.glob("*.json"))) < kept and time.monotonic() < deadline:
        time.sleep(0.005)
    os.killpg(child.pid, signal.SIGKILL)
    child.wait()
    found = {path.name: path.stat().st_mtime_ns for path in parts.glob("*.json")}
    assert len(found) >= kept and not out.exists()
    heard = []
    with ldi.options(progress=lambda *progress: heard.append(progress)):
        ldi.sweep(scaffold, PLAN, out=out, resolution=24)
    failed = 1  # Failed designs are measured again.
    assert len(found) - failed <= 6 - len(heard) <= len(found)
    assert out.read_bytes() == serial and not parts.exists()


@contextmanager
def dask_of_one_worker():
    """Yields an executor of Dask that does not try a call again whose worker died."""
    dask, distributed = pytest.importorskip("dask"), pytest.importorskip("distributed")
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 0}),
        distributed.LocalCluster(n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        client.run(lambda: __import__("sys").path.insert(0, str(HERE)))
        yield client.get_executor()


@pytest.mark.parametrize("started", [lambda: spawned(1), dask_of_one_worker], ids=["processes", "dask"])
def test_sweeps_whose_worker_died_say_so_and_go_on(tmp_path, started):
    out, plan = tmp_path / "runs.parquet", {**PLAN, "mark": [str(tmp_path / "mark")]}
    with started() as executor, pytest.raises(ldi.MachineError, match="a worker died.*memory.*import.*same sweep.*goes on"):
        ldi.sweep(kills_its_worker_once, plan, out=out, executor=executor, resolution=24)
    kept = len(list((tmp_path / "runs.parquet.parts").glob("*.json")))
    assert 0 < kept < 6 and not out.exists()
    heard = []
    with ldi.options(progress=lambda *progress: heard.append(progress)):
        frame = ldi.sweep(kills_its_worker_once, plan, out=out, resolution=24)
    failed = 1  # Failed designs are measured again.
    assert kept - failed <= 6 - len(heard) <= kept
    assert list(frame["status"]) == ["measured", "failed", *["measured"] * 4]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="the system has no forks")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_forked_workers_are_no_failed_designs(tmp_path):
    ldi.geodesic().volume()
    with (
        ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("fork")) as executor,
        pytest.raises(ldi.MachineError, match="spawn"),
    ):
        ldi.sweep(scaffold, PLAN, out=tmp_path / "runs.parquet", executor=executor, resolution=24)


def test_a_file_that_is_no_table_of_a_sweep_is_kept(tmp_path):
    out = tmp_path / "other.parquet"
    parquet.write_table(pyarrow.table({"a": [1]}), out)
    with pytest.raises(ldi.InputError, match="no table of a sweep"):
        ldi.sweep(scaffold, PLAN, out=out, resolution=24)
    assert parquet.read_table(out)["a"].to_pylist() == [1]


def test_workers_have_the_memory_limit_of_the_options_and_their_share_of_the_threads():
    with spawned(2) as executor, ldi.options(memory="2 GB", threads=1):
        assert threads_of_worker(executor) == 1
        assert dict(results(options_of_worker, {"here": ()}, executor, 3)) == {"here": (3, 2_000_000_000)}
    share = max(1, len(os.sched_getaffinity(0)) // 2)
    assert threads_of_worker(executor) == share
    # Two workers never have more threads together than there are processors.
    with ldi.options(threads=64):
        assert threads_of_worker(executor) == share
    # Of a cluster, the workers are not known.
    with Executor() as cluster, ldi.options(threads=4):
        assert threads_of_worker(cluster) == 4


def test_plans_that_make_no_table_are_refused(tmp_path):
    out = tmp_path / "runs.parquet"
    for make, grid, settings in [
        ("nothing", PLAN, {}),
        (scaffold, {"wall": []}, {}),
        (scaffold, [{"wall": 1, "cells": 1}, {"cells": 1}], {}),
        (scaffold, [{"wall": 1, "cells": 1}] * 2, {}),
        (scaffold, {"porosity": [1]}, {}),
        (lambda wall: scaffold(wall, 1), {"wall": [1]}, {}),
        (functools.partial(scaffold, cells=1), {"wall": [1]}, {}),
        (scaffold, {"wall": [object()]}, {}),
        (scaffold, {"wall": [float("nan")], "cells": [1]}, {}),
        (scaffold, PLAN, {"resolutoin": 3}),
        (scaffold, PLAN, {"pareto": {"porosty": "max"}}),
    ]:
        with pytest.raises(ldi.UsageError):
            ldi.sweep(make, grid, out=out, **settings)
    assert list(tmp_path.iterdir()) == []
