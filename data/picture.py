#!/usr/bin/env python3
"""Draws data/picture.png: a bone, a scaffold, and what they share, each from its layered depth image.

usage: data/picture.py LDI_OPS_BINARY     needs numpy

A ray along y stops at the first sample it meets, so that the picture is the nearest layer of the image, lit by its slope.
"""
import pathlib
import struct
import subprocess
import sys
import tempfile
import zlib

import numpy as np

DATA = pathlib.Path(__file__).parent
BONE = DATA / "models/bone.stl"
GYROID = "generate gyroid --cells 6,5,11 --cell-size 4 --wall 0.75 --resolution 14".split()
WIDE = 2  # supersampling


def image(binary, folder, *arguments):
    path = folder / "image.npz"
    common = ["--pitch", "0.045", "--axis", "y", "--mode", "exact", "--unit", "mm", "--quiet", "-o", path]
    subprocess.run([binary, *arguments, *common], check=True, stdout=subprocess.DEVNULL)
    with np.load(path) as arrays:
        return {name: arrays[name] for name in arrays.files}


def picture(ldi, tint):
    """Nearest depths in millimetres, rows along z upwards and columns along x, lit from above left."""
    grid = ldi["grid"]
    columns, rows = int(grid["rays"][0]), int(grid["rays"][2])
    offsets, step, pitch = ldi["offsets"], float(grid["step"]), float(grid["pitch"])
    hit = offsets[1:] > offsets[:-1]
    depth = np.full(columns * rows, np.nan)
    depth[hit] = ldi["depths"][offsets[:-1][hit]] * step
    depth = depth.reshape(rows, columns)[::-1]
    down, across = np.gradient(depth, pitch)
    normal = np.stack([across, np.ones_like(depth), -down])
    normal /= np.linalg.norm(normal, axis=0)
    light = np.array([-0.45, 0.72, 0.53])
    shade = 0.25 + 0.75 * np.clip(np.tensordot(light / np.linalg.norm(light), normal, 1), 0, 1)
    shade *= 1.0 - 0.35 * (depth - np.nanmin(depth)) / (np.nanmax(depth) - np.nanmin(depth))
    rgb = shade[..., None] * np.array(tint)
    alpha = ~np.isnan(shade)
    return np.where(alpha[..., None], np.nan_to_num(rgb), 1.0)


def fit(panel, height, width):
    canvas = np.ones((height, width, 3))
    top, left = (height - panel.shape[0]) // 2, (width - panel.shape[1]) // 2
    canvas[top:top + panel.shape[0], left:left + panel.shape[1]] = panel
    return canvas


def write_png(path, rgb):
    height, width, _ = rgb.shape
    rows = np.zeros((height, 1 + 3 * width), np.uint8)
    rows[:, 1:] = np.round(255 * rgb ** (1 / 1.6)).astype(np.uint8).reshape(height, -1)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) +
                     chunk(b"IDAT", zlib.compress(rows.tobytes(), 9)) + chunk(b"IEND", b""))


def main():
    binary = pathlib.Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        scaffold = folder / "scaffold.stl"
        subprocess.run([binary, *GYROID, "-o", scaffold], check=True, stdout=subprocess.DEVNULL)
        panels = [
            picture(image(binary, folder, "sample", BONE), (0.93, 0.87, 0.74)),
            picture(image(binary, folder, "sample", scaffold), (0.62, 0.75, 0.86)),
            picture(image(binary, folder, "intersect", scaffold, BONE), (0.95, 0.66, 0.40)),
        ]
    height = max(panel.shape[0] for panel in panels) + 16 * WIDE
    width = max(panel.shape[1] for panel in panels) + 16 * WIDE
    whole = np.concatenate([fit(panel, height, width) for panel in panels], axis=1)
    whole = whole[:whole.shape[0] // WIDE * WIDE, :whole.shape[1] // WIDE * WIDE]
    whole = whole.reshape(whole.shape[0] // WIDE, WIDE, whole.shape[1] // WIDE, WIDE, 3).mean(axis=(1, 3))
    write_png(DATA / "picture.png", whole)


main()
