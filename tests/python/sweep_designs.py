"""Designs of the tests of sweeps, importable by workers."""

import os
import signal
import time
from pathlib import Path

import ldi_ops as ldi
from ldi_ops._options import current

PLAN = {"wall": [0.6, 0.8, 1.0], "cells": [1, 2]}


def scaffold(wall, cells):
    """A gyroid sheet in a box; a wall of 0.6 mm in two cells fails."""
    if (wall, cells) == (0.6, 2):
        raise RuntimeError("this design has no shape")
    return ldi.gyroid(cells=cells, cell_size=4, wall=wall, resolution=16)


def kills_its_worker_once(wall, cells, mark):
    """The same, but the first worker that makes the third design dies once the first design has its row."""
    mark = Path(mark)
    if (wall, cells) == (0.8, 1) and not mark.exists():
        mark.touch()
        deadline = time.monotonic() + 60
        while not any(mark.parent.glob("*.parts/*.json")) and time.monotonic() < deadline:
            time.sleep(0.01)
        os.kill(os.getpid(), signal.SIGKILL)
    return scaffold(wall, cells)


def options_of_worker():
    """Returns the threads and the memory limit of calls in a worker."""
    return current().threads, current().memory
