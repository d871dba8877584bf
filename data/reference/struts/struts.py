#!/usr/bin/env python3
"""200 struts that cross one another, and a box: their Booleans by CGAL's exact kernel, written into struts.json.

usage: struts.py     takes about a minute

The struts are one mesh, not united, so that the non-zero rule decides what is inside. `struts.json` has the hash of their
coordinates, so that a test knows that it compares with the same struts.
"""

import hashlib
import json
from pathlib import Path

import numpy as np

OPERATIONS = {"intersection": "intersect", "union": "union", "difference": "minus"}
PINNED = Path(__file__).with_suffix(".json")


def strut(start, end, radius, sides=16):
    """Returns points in f32 and triangles of a prism."""
    along = (end - start) / np.linalg.norm(end - start)
    across = np.cross(along, [1, 0, 0] if abs(along[0]) < 0.9 else [0, 1, 0])
    across /= np.linalg.norm(across)
    angles = np.arange(sides) * 2 * np.pi / sides
    ring = radius * (np.outer(np.cos(angles), across) + np.outer(np.sin(angles), np.cross(along, across)))
    points = np.vstack([start + ring, end + ring, [start], [end]])
    triangles = []
    for i in range(sides):
        j = (i + 1) % sides
        triangles += [[i, j, sides + j], [i, sides + j, sides + i], [2 * sides, j, i]]
        triangles += [[2 * sides + 1, sides + i, sides + j]]
    return points.astype(np.float32), np.array(triangles)


def meshes(count=200):
    """Returns (points, triangles) of all struts, and of the box."""
    source = np.random.default_rng(7)
    parts = [
        strut(source.uniform(-1, 11, 3), source.uniform(-1, 11, 3), source.uniform(0.15, 0.4)) for _ in range(count)
    ]
    starts = np.cumsum([0] + [len(points) for points, _ in parts])
    struts = np.vstack([points for points, _ in parts]), np.vstack([t + start for (_, t), start in zip(parts, starts)])
    corners = np.array([[x, y, z] for x in (0, 10) for y in (0, 10) for z in (0, 10)], np.float32)
    sides = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]]
    sides += [[2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
    return struts, (corners, np.array(sides))


def digest(mesh):
    """Returns the hash of points and triangles."""
    points, triangles = mesh
    return hashlib.sha256(points.astype("<f4").tobytes() + triangles.astype("<i8").tobytes()).hexdigest()


def volume_and_area(points, triangles):
    """Returns both of a closed mesh, summed about its middle."""
    if len(triangles) == 0:
        return 0.0, 0.0
    corners = points[triangles] - points.mean(axis=0)
    a, b, c = (corners[:, i] for i in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6), float(area)


def main():
    import importlib.metadata

    from igl.copyleft import cgal

    (points, triangles), (corners, sides) = meshes()
    values = {}
    for name, operation in OPERATIONS.items():
        result = cgal.mesh_boolean(points.astype(float), triangles, corners.astype(float), sides, operation)
        values[name] = dict(zip(("volume", "area"), volume_and_area(result[0], result[1])))
    document = {"tool": "CGAL's exact kernel, by libigl", "version": importlib.metadata.version("libigl"),
                "sha256": digest((points, triangles)), **values}
    PINNED.write_text(json.dumps(document, indent=2) + "\n")


if __name__ == "__main__":
    main()
