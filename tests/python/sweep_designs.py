"""Designs of the tests of sweeps, importable by workers."""

import ldi_ops as ldi

PLAN = {"wall": [0.6, 0.8, 1.0], "cells": [1, 2]}


def scaffold(wall, cells):
    """A gyroid sheet in a box; a wall of 0.6 mm in two cells fails."""
    if (wall, cells) == (0.6, 2):
        raise RuntimeError("this design has no shape")
    return ldi.gyroid(cells=cells, cell_size=4, wall=wall, resolution=16)
