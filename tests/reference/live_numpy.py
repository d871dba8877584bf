#!/usr/bin/env python3
"""Checks with numpy that the program's images (.npz) and voxels (.npy) hold the right values.

usage: live_numpy.py LDI_OPS_BINARY | --self-test

numpy alone counts the nodes inside from every image; along each axis these must be the voxels.
"""
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

ACROSS = {"x": (1, 2), "y": (0, 2), "z": (0, 1)}  # columns and rows of an image, as coordinates


def nodes(image, axis):
    """Returns the nodes inside, by the image along an axis, as an array of shape (nx, ny, nz)."""
    grid = image["grid"]
    rays, shift, depth = grid["rays"], int(grid["shift"]), "xyz".index(axis)
    column, row = ACROSS[axis]
    offsets, depths = image[f"offsets_{axis}"].astype(int), image[f"depths_{axis}"]
    position = (np.arange(rays[depth]) << shift) + (1 << (shift - 1)) + 1
    inside = np.zeros((rays[row], rays[column], rays[depth]), np.uint8)
    for ray, lane in enumerate(inside.reshape(-1, rays[depth])):
        lane[:] = np.searchsorted(depths[offsets[ray] : offsets[ray + 1]], position) % 2
    return np.moveaxis(inside, (0, 1, 2), (row, column, depth))


def complaints(image, voxels):
    """Returns the faults of an image along three axes and its voxels."""
    rays = tuple(int(n) for n in image["grid"]["rays"])
    if str(image["unit"]) != "mm" or "".join(image["axis"]) != "xyz":
        yield f"unit {image['unit']} and axes {image['axis']}, where mm and x, y, z were asked for"
    if voxels.dtype != np.uint8 or voxels.shape != rays:
        yield f"voxels of {voxels.dtype} and shape {voxels.shape}, where the rays are {rays}"
        return
    for axis in "xyz":
        wrong = int((nodes(image, axis) != voxels).sum())
        if wrong:
            yield f"{wrong} voxels are not what the image along {axis} says"
    if not 0 < voxels.sum() < voxels.size:
        yield "all voxels are alike"


def self_test():
    """Checks a box of 2 × 1 × 1 pixels on a grid of 3 × 2 × 1, and copies of it with one mistake each."""
    grid = np.array(([3, 2, 1], 4), dtype=[("rays", "u4", 3), ("shift", "u4")])
    voxels = np.zeros((3, 2, 1), np.uint8)
    voxels[:2, 0, 0] = 1
    image = {"grid": grid, "unit": np.array("mm"), "axis": np.array(list("xyz"))}
    image |= {"offsets_x": np.array([0, 2, 2]), "depths_x": np.array([0, 32])}
    image |= {"offsets_y": np.array([0, 2, 4, 4]), "depths_y": np.array([0, 16, 0, 16])}
    image |= {"offsets_z": np.array([0, 2, 4, 4, 4, 4, 4]), "depths_z": np.array([0, 16, 0, 16])}
    assert list(complaints(image, voxels)) == []
    wrong = [(image | {f"depths_{axis}": image[f"depths_{axis}"] // 4}, voxels) for axis in "xyz"]
    wrong += [(image, 1 - voxels), (image, voxels.transpose(1, 0, 2)), (image, voxels.astype(int))]
    wrong += [(image | {"unit": np.array("m")}, voxels), (image | {"axis": np.array(list("xzy"))}, voxels)]
    for case in wrong:
        assert list(complaints(*case)), case
    print(f"{len(wrong)} mistakes are found")


def main(binary):
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)

        def run(*arguments):
            subprocess.run([binary, *arguments], check=True, stdout=subprocess.DEVNULL, cwd=folder)

        run("generate", "torus", "-o", "a.stl")
        for output in ["a.npz", "a.npy"]:
            run("sample", "a.stl", "--resolution", "90", "--mode", "exact", "--unit", "mm", "-o", output)
        with np.load(folder / "a.npz") as arrays:
            image = {name: arrays[name] for name in arrays.files}
        voxels = np.load(folder / "a.npy")
    wrong = list(complaints(image, voxels))
    print("\n".join(wrong) or f"{int(voxels.sum())} voxels are what three images say")
    return bool(wrong)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    if sys.argv[1] == "--self-test":
        self_test()
    else:
        sys.exit(main(pathlib.Path(sys.argv[1]).resolve()))
