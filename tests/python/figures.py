#!/usr/bin/env python3
"""Measures what the package costs: against the command line, against the speed of memory, and with two workers.

usage: figures.py PROGRAM [--designs N]    PROGRAM: the command line of the same build
"""

import argparse
import json
import multiprocessing
import subprocess
import tempfile
import time
from concurrent.futures import Executor, ProcessPoolExecutor
from pathlib import Path

import numpy as np

import ldi_ops as ldi


def shortest(function, rounds=5) -> float:
    """Returns the shortest time of some calls, in seconds."""
    taken = []
    for _ in range(rounds):
        start = time.perf_counter()
        function()
        taken.append(time.perf_counter() - start)
    return min(taken)


def volume_of_arrays(program: str, folder: Path) -> None:
    """`load` of arrays and `volume`, beside the command line without the time in which it reads."""
    solid = ldi.gyroid(cells=4, resolution=48)
    vertices, faces = solid.mesh()
    path = folder / "gyroid.stl"
    solid.save(path)
    for name, options, settings in [("exact", [], {}), ("512 rays", ["--estimate"], {})]:
        def of_program():
            text = subprocess.run([program, "volume", path, *options, "--json", "-"], check=True, capture_output=True).stdout
            seconds = json.loads(text)["seconds"]
            return seconds["total"] - seconds["read"], seconds["read"]

        rest, read = min(of_program() for _ in range(5))
        if options:
            ours = shortest(lambda: ldi.load((vertices, faces)).sample().volume())
        else:
            ours = shortest(lambda: ldi.load((vertices, faces)).volume())
        loaded = shortest(lambda: ldi.load((vertices, faces)))
        print(f"volume of {len(faces)} triangles, {name}: load {loaded:.3f} s and in all {ours:.3f} s; command: reading {read:.3f} s, rest {rest:.3f} s")


def voxels() -> None:
    """`to_numpy` of 512³, beside writing as many bytes."""
    image = ldi.geodesic(radius=1, frequency=64).sample(resolution=512)
    taken = shortest(image.to_numpy, rounds=3)
    size = image.to_numpy().shape
    written = shortest(lambda: np.ones(size, dtype=bool), rounds=3)
    print(f"to_numpy of {size}: {taken:.3f} s; numpy writes as many bytes in {written:.3f} s")


def workers(designs: int, folder: Path) -> None:
    """A sweep of bars, 128 rays long and 16 wide, with 1, 2 and 4 workers of one thread and through Dask."""
    from distributed import Client, LocalCluster

    grid = {"size": [(16, 2, 2)], "hollow": [(round(2 + 13 * i / designs, 4), 1, 1) for i in range(designs)]}
    taken, files = {}, set()

    def swept(name: str, executor: Executor) -> None:
        out = folder / f"{name}.parquet"
        start = time.perf_counter()
        ldi.sweep("hollow_box", grid, out=out, executor=executor, threads=1, resolution=128)
        taken[name] = time.perf_counter() - start
        files.add(out.read_bytes())
        print(f"{designs} designs at 128 rays, {name}: {taken[name]:.1f} s", flush=True)

    for count in (1, 2, 4):
        with ProcessPoolExecutor(count, mp_context=multiprocessing.get_context("spawn")) as executor:
            list(executor.map(abs, range(count)))
            swept(f"{count} workers", executor)
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        swept("2 workers of Dask", client.get_executor())
    print(f"2 workers are {taken['1 workers'] / taken['2 workers']:.2f} times as fast as 1; same bytes: {len(files) == 1}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("program")
    parser.add_argument("--designs", type=int, default=200)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        volume_of_arrays(arguments.program, Path(folder))
        voxels()
        workers(arguments.designs, Path(folder))


if __name__ == "__main__":
    main()
