#!/usr/bin/env python3
"""Writes stored.npz and compressed.npz: images as a script makes them, with the types that numpy chooses by itself.

usage: data/images/make.py     needs numpy; run with 2.4.6

A box on a grid of 4 × 3 × 2 rays: nodes 1 and 2 along x, 0 and 1 along y, 1 along z are inside.
"""
import pathlib

import numpy as np

FOLDER = pathlib.Path(__file__).parent
RAYS = {"x": 4, "y": 3, "z": 2}
BOX = {"x": (16, 48), "y": (0, 32), "z": (16, 32)}  # lattice steps; a pixel has 16
ACROSS = {"x": ("y", "z"), "y": ("x", "z"), "z": ("x", "y")}

grid = np.array(
    ((-1.0, 0.5, 2.0), 0.25, tuple(RAYS.values()), 4, 64),
    dtype=[("origin", "f8", 3), ("pitch", "f8"), ("rays", "i8", 3), ("shift", "i8"), ("lod", "i8")],
)


def image(axis):
    column, row = ACROSS[axis]
    inside = [[BOX[a][0] <= 16 * i + 9 < BOX[a][1] for i in range(RAYS[a])] for a in (column, row)]
    counts = [2 if c and r else 0 for r in inside[1] for c in inside[0]]
    offsets = np.concatenate([[0], np.cumsum(counts)])
    depths = np.array(BOX[axis] * (sum(counts) // 2))
    outwards = np.zeros((len(depths), 3))
    outwards[0::2, "xyz".index(axis)] = -1
    outwards[1::2, "xyz".index(axis)] = 1
    return {"offsets": offsets, "depths": depths, "normals": outwards, "unclosed": np.array([], dtype=int)}


np.savez(FOLDER / "stored.npz", axis="z", grid=grid, unit="mm", note="not ours", **image("z"))
arrays = {f"{name}_{axis}": array for axis in "xyz" for name, array in image(axis).items() if name != "normals"}
np.savez_compressed(FOLDER / "compressed.npz", axis=list("xyz"), grid=grid, **arrays)
