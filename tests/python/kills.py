#!/usr/bin/env python3
"""Kills a worker, or the driver with its workers, at random moments of a sweep, and runs the sweep again until it ends.

usage: kills.py [--times N]    Exits 1 if a row is lost, doubled or differs from those of a sweep that nobody killed.
"""

import argparse
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).parent

DRIVER = """
import multiprocessing, sys
from concurrent.futures import ProcessPoolExecutor
import ldi_ops as ldi

GRID = {"wall": [0.5, 0.6, 0.7, 0.8, 0.9, 1.0], "cells": [1, 2], "cell_size": [4], "resolution": [16]}

if __name__ == "__main__":
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as executor:
        ldi.sweep("gyroid", GRID, out=sys.argv[1], executor=executor, resolution=24)
"""


def workers_of(process: int) -> list[int]:
    """Returns the worker processes of a driver."""
    found = []
    for folder in Path("/proc").iterdir():
        try:
            if folder.name.isdigit() and int((folder / "stat").read_text().rsplit(")", 1)[1].split()[1]) == process:
                if b"spawn_main" in (folder / "cmdline").read_bytes():
                    found.append(int(folder.name))
        except (OSError, ValueError):
            pass
    return found


def killed(driver: Path, out: Path, chance: random.Random) -> int:
    """Runs a sweep to its end, killing once in each run until one ends; returns the number of kills."""
    kills = 0
    while True:
        child = subprocess.Popen([sys.executable, driver, out], start_new_session=True, stderr=subprocess.DEVNULL)
        deadline = time.monotonic() + chance.uniform(0.5, 6)
        while child.poll() is None and time.monotonic() < deadline:
            time.sleep(0.01)
        if child.poll() == 0:
            return kills
        kills += 1
        workers = workers_of(child.pid)
        if workers and chance.random() < 0.5:
            os.kill(chance.choice(workers), signal.SIGKILL)
            assert child.wait(timeout=60) != 0, "a sweep whose worker was killed ended well"
        else:
            os.killpg(child.pid, signal.SIGKILL)
            child.wait()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--times", type=int, default=10)
    times = parser.parse_args().times
    chance = random.Random(1)
    with tempfile.TemporaryDirectory() as folder:
        driver = Path(folder) / "driver.py"
        driver.write_text(DRIVER)
        whole = Path(folder) / "whole.parquet"
        subprocess.run([sys.executable, driver, whole], check=True)
        kills = wrong = 0
        while kills < times:
            out = Path(folder) / f"{kills}.parquet"
            kills += killed(driver, out, chance)
            wrong += out.read_bytes() != whole.read_bytes()
            left = [path.name for path in Path(folder).iterdir() if path.name.startswith(f".{out.name}") or path.suffix == ".parts"]
            wrong += bool(left)
            print(f"{kills} kills, {wrong} sweeps that differ or leave files {left}", flush=True)
        sys.exit(wrong > 0)


if __name__ == "__main__":
    main()
