#!/usr/bin/env python3
"""Volumes of the pairs of pairs.toml by manifold3d, written into data/reference/<pair>.json.

usage: manifold_reference.py [--root DIR] [PAIR …]
"""

import argparse
import importlib.metadata
from pathlib import Path

import manifold3d
import numpy as np

import pairs


def solid(mesh):
    points, triangles = mesh
    # Mesh64 and not Mesh: the latter rounds to f32 and merges within a f32's precision.
    return manifold3d.Manifold(manifold3d.Mesh64(points, triangles.astype(np.uint64)))


def result(pair, root=pairs.ROOT):
    """What manifold3d says of one pair: a number, or {"refused": reason}, for each of pairs.VALUES."""
    solids = [solid(mesh) for mesh in pairs.meshes(pair, root)]
    a, b = solids
    computed = {
        "intersection": lambda: a ^ b,
        "union": lambda: a + b,
        "difference": lambda: a - b,
        "volume_a": lambda: a,
        "volume_b": lambda: b,
    }
    values = {}
    for name in pairs.VALUES:
        answer = computed[name]()
        status = answer.status()
        values[name] = answer.volume() if status == manifold3d.Error.NoError else {"refused": status.name}
    return {
        "tool": "manifold3d",
        "version": importlib.metadata.version("manifold3d"),
        "command": f"python3 data/reference/manifold_reference.py {pair['name']}",
        **values,
    }


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--root", type=Path, default=pairs.ROOT, help="folder that the models' paths start from")
    arguments.add_argument("pair", nargs="*", help="names from pairs.toml; all of them where none is given")
    given = arguments.parse_args()
    for pair in pairs.load(given.root, given.pair):
        values = result(pair, given.root)
        pairs.write_result(pair, values, given.root)
        print(pair["name"], *(f"{name} {values[name]}" for name in pairs.VALUES), sep="  ")


if __name__ == "__main__":
    main()
