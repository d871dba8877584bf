#!/usr/bin/env python3
"""The cases of sums.toml by manifold3d, written into data/reference/minkowski/<case>.json.

usage: manifold_sums.py [CASE …]

`pieces`    the hulls of the sums of every convex piece of A and every one of B, united.
`boundary`  A and the hulls of the sums of every triangle of A and every convex piece of B, united; for a difference, of
            −B, taken off A. Right for any connected B that contains the origin, so B is moved until it does, and the
            result back: where x + B reaches out of A, it meets the surface of A. Hulls that share a face with A leave
            sheets of no thickness, so that the volume alone is told.
`own`       manifold3d's `minkowski_sum` and `minkowski_difference`, which are right for a convex B that contains the
            origin; what the latter takes off is the sweep of B, not of −B, so it is given −B.
"""

import argparse
import importlib.metadata

import manifold3d
import numpy as np
from manifold3d import Manifold, OpType

import sums

# What is left between hulls that touch is nothing but rounding: parts smaller than this share of the whole do not count.
SLIVER = 1e-9

# What is told of a result beside its volume.
SHAPE = ("area", "box", "components", "cavities")


def solid(mesh):
    points, triangles = mesh
    return Manifold(manifold3d.Mesh64(points, triangles.astype(np.uint64)))


def hull_of_sum(one, other):
    return Manifold.hull_points((one[:, None, :] + other[None, :, :]).reshape(-1, 3))


def pieces(case):
    if case.operation != "sum":
        raise SystemExit(f"{case.name}: the complement of A has no pieces")
    hulls = [hull_of_sum(a, b) for a in case.pieces("a") for b in case.pieces("b")]
    return Manifold.batch_boolean(hulls, OpType.Add)


def boundary(case):
    mesh, _ = case.meshes()
    points, triangles = mesh
    tool = case.pieces("b")
    origin = tool[0][0]
    sign = 1 if case.operation == "sum" else -1
    tool = [sign * (piece - origin) for piece in tool]
    hulls = [hull_of_sum(corners, piece) for corners in points[triangles] for piece in tool]
    operation = OpType.Add if case.operation == "sum" else OpType.Subtract
    return Manifold.batch_boolean([solid(mesh), *hulls], operation).translate(sign * origin)


def own(case):
    a, b = map(solid, case.meshes())
    if abs(b.volume() - b.hull().volume()) > SLIVER * b.volume():
        raise SystemExit(f"{case.name}: B is not convex, for which manifold3d's sums are wrong")
    middle = b.to_mesh64().vert_properties[:, :3].mean(axis=0)
    if case.operation == "sum":
        return a.minkowski_sum(b.translate(-middle)).translate(middle)
    return a.minkowski_difference(b.translate(-middle).scale([-1, -1, -1])).translate(-middle)


WAYS = {"pieces": pieces, "boundary": boundary, "own": own}


def describe(result):
    """Volume, area, box, and how many solids and cavities the result has."""
    volume = result.volume()
    # A cavity is a surface that faces inwards.
    parts = [part.volume() for part in result.decompose()]
    box = result.bounding_box()
    return {
        "volume": volume,
        "area": result.surface_area(),
        "box": [list(box[:3]), list(box[3:])],
        "components": sum(part > SLIVER * volume for part in parts),
        "cavities": sum(part < -SLIVER * volume for part in parts),
    }


def result(case, way):
    """What manifold3d says of a case, computed in one way: numbers, or {"refused": reason} for the volume."""
    found = WAYS[way](case)
    if found.status() != manifold3d.Error.NoError:
        values = {"volume": {"refused": found.status().name}}
    elif way == "boundary":
        values = {"volume": found.volume()}
    else:
        values = describe(found)
    return {
        "way": way,
        "tool": "manifold3d",
        "version": importlib.metadata.version("manifold3d"),
        "command": f"python3 data/reference/minkowski/manifold_sums.py {case.name}",
        **values,
    }


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("case", nargs="*", help="names from sums.toml; all of them where none is given")
    for case in sums.load(arguments.parse_args().case):
        for way in case.ways:
            if way in WAYS:
                found = result(case, way)
                sums.write_result(case, found)
                print(case.name, way, found["volume"], sep="  ", flush=True)


if __name__ == "__main__":
    main()
