"""Sweeps: rows do not depend on workers, failures are rows, and what was stopped goes on."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import pyarrow.parquet as parquet
import pytest
from sweep_designs import PLAN, scaffold

import ldi_ops as ldi

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
    assert [path.name for path in tmp_path.iterdir()] == ["runs.parquet"]


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


def test_plans_that_make_no_table_are_refused(tmp_path):
    out = tmp_path / "runs.parquet"
    for make, grid, settings in [
        ("nothing", PLAN, {}),
        (scaffold, {"wall": []}, {}),
        (scaffold, [{"wall": 1, "cells": 1}, {"cells": 1}], {}),
        (scaffold, [{"wall": 1, "cells": 1}] * 2, {}),
        (scaffold, {"porosity": [1]}, {}),
        (scaffold, {"wall": [object()]}, {}),
        (scaffold, PLAN, {"resolutoin": 3}),
    ]:
        with pytest.raises(ldi.UsageError):
            ldi.sweep(make, grid, out=out, **settings)
    assert list(tmp_path.iterdir()) == []
