#!/usr/bin/env python3
"""Compares `ldi-ops clash` with manifold3d on every pair of an assembly.

usage: clashes.py --program LDI-OPS [--parts N] [--seed N] [--self-test]

Places N generated parts at random, and asserts for all of their pairs that the same ones overlap, that the volume of
manifold3d lies in the range that the program states, and that the distances agree. `--self-test` also falsifies the
results of the program, and exits with 1 unless each falsehood is found.
"""

import argparse
import copy
import itertools
import json
import random
import subprocess
import sys
import tempfile
from pathlib import Path

import manifold3d
import numpy

KINDS = {
    "bolt": ["geodesic", "--radius", "0.8", "--frequency", "8"],
    "plate": ["cuboid", "--min", "0,0,0", "--max", "12,12,1"],
    "ring": ["torus", "--major", "3", "--minor", "0.7"],
    "lattice": ["bcc", "--cells", "1", "--cell-size", "5", "--radius", "0.5", "--resolution", "12"],
}

CLEARANCE = 3.0

# A volume below this, in cubic millimetres, is no overlap.
LEAST_VOLUME = 1e-9

# manifold3d rounds coordinates and computes in f64.
LARGEST_DIFFERENCE = 1e-9


def read_stl(path: Path) -> tuple[numpy.ndarray, numpy.ndarray]:
    """Reads a binary STL; equal corners become one vertex."""
    record = numpy.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    corners = numpy.fromfile(path, record, offset=84)["corners"].reshape(-1, 3).astype(float)
    vertices, index = numpy.unique(corners, axis=0, return_inverse=True)
    return vertices, index.reshape(-1, 3)


def rotation(axis: numpy.ndarray, degrees: float) -> numpy.ndarray:
    """Returns the matrix of a rotation."""
    x, y, z = axis / numpy.linalg.norm(axis)
    cross = numpy.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = numpy.radians(degrees)
    return numpy.eye(3) + numpy.sin(angle) * cross + (1 - numpy.cos(angle)) * cross @ cross


def assembly(program: Path, folder: Path, count: int, seed: int) -> list[manifold3d.Manifold]:
    """Writes parts and their list, and returns the same parts for manifold3d."""
    meshes = {}
    for name, words in KINDS.items():
        path = folder / f"{name}.stl"
        subprocess.run([program, "generate", *words, "-o", path, "--quiet"], check=True, stdout=subprocess.DEVNULL)
        meshes[name] = read_stl(path)
    source = random.Random(seed)
    text, parts = "", []
    for _ in range(count):
        name = source.choice(list(KINDS))
        axis = numpy.array([round(source.uniform(-1, 1), 2) for _ in range(3)]) + [0, 0, 0.005]
        angle = round(source.uniform(0, 360), 1)
        place = [round(source.uniform(0, 40), 3) for _ in range(3)]
        words = [",".join(map(repr, map(float, [*axis, angle]))), ",".join(map(repr, place))]
        text += f'[[part]]\nfile = "{name}.stl"\ntransform = "rotate({words[0]}) translate({words[1]})"\n'
        vertices, triangles = meshes[name]
        placed = vertices @ rotation(axis, angle).T + place
        parts.append(manifold3d.Manifold(manifold3d.Mesh64(placed, triangles.astype(numpy.uint64))))
    (folder / "assembly.toml").write_text(text)
    return parts


def compared(program: Path, folder: Path) -> dict:
    """Returns the result of the program."""
    command = [program, "clash", "--assembly", folder / "assembly.toml", "--unit", "mm", "--clearance", str(CLEARANCE)]
    run = subprocess.run([*command, "--json", "-"], capture_output=True, text=True, check=False)
    if run.returncode not in (0, 1):
        sys.exit(f"{program} clash: exit code {run.returncode}\n{run.stderr}")
    return json.loads(run.stdout)


def differences(parts: list[manifold3d.Manifold], result: dict) -> list[str]:
    """Returns what differs between the program and manifold3d."""
    near = {tuple(pair["parts"]): pair for pair in result["pairs"]}
    found = []
    for i, j in itertools.combinations(range(len(parts)), 2):
        volume = (parts[i] ^ parts[j]).volume()
        pair = near.get((i, j))
        overlap = pair["overlap"] if pair else None
        if (volume > LEAST_VOLUME) != (overlap is not None):
            found.append(f"{i} and {j} share {volume}, but are {pair['state'] if pair else 'not near'}")
        elif overlap:
            lower, upper = overlap["volume"]["lower"], overlap["volume"]["upper"]
            if not lower - LEAST_VOLUME <= volume <= upper + LEAST_VOLUME:
                found.append(f"{i} and {j} share {volume}, which is outside {lower} to {upper}")
        elif pair:
            distance = parts[i].min_gap(parts[j], 1000.0)
            if abs(distance - pair["distance"]) > LARGEST_DIFFERENCE * max(1.0, distance):
                found.append(f"{i} and {j} are {distance} apart, not {pair['distance']}")
    return found


def self_test(parts: list[manifold3d.Manifold], result: dict) -> bool:
    """Returns whether falsified results are found to differ."""
    overlapping = next(i for i, pair in enumerate(result["pairs"]) if pair["state"] == "overlapping")
    separate = next(i for i, pair in enumerate(result["pairs"]) if pair["state"] == "separate")
    wrong = [copy.deepcopy(result) for _ in range(3)]
    wrong[0]["pairs"][overlapping]["overlap"]["volume"]["lower"] *= 10
    wrong[1]["pairs"][separate]["distance"] *= 1.001
    del wrong[2]["pairs"][overlapping]
    return all(len(differences(parts, falsified)) == 1 for falsified in wrong)


def main() -> int:
    """Runs the comparison."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", type=lambda path: Path(path).resolve(), required=True)
    parser.add_argument("--parts", type=int, default=60)
    parser.add_argument("--seed", type=int, default=4)
    parser.add_argument("--self-test", action="store_true")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="clashes_") as name:
        folder = Path(name)
        parts = assembly(arguments.program, folder, arguments.parts, arguments.seed)
        result = compared(arguments.program, folder)
        found = differences(parts, result)
    counts = result["counts"]
    overlaps = sum(pair["state"] == "overlapping" for pair in result["pairs"])
    print(f"{counts['possible_pairs']} pairs, {counts['near_pairs']} near, {overlaps} overlapping: {len(found)} differences")
    print("\n".join(found), end="\n" if found else "")
    if arguments.self_test and not found:
        found = [] if self_test(parts, result) else ["falsified clashes are not found"]
        print(*found or ["ok     falsified clashes are found"])
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
