#!/usr/bin/env python3
"""Volumes of the pairs of pairs.toml by CGAL in exact arithmetic, written into data/reference/<pair>.json.

usage: cgal_reference.py [--program CGAL_REFERENCE] [--root DIR] [PAIR …]
The program is built from data/reference/cgal; regenerate.sh does so.
"""

import argparse
import json
import subprocess
import tempfile
from pathlib import Path

import pairs

PROGRAM = pairs.ROOT / "target" / "cgal_reference" / "cgal_reference"


def write_off(mesh, path):
    """17 digits bring every f64 back unchanged, so CGAL gets the very coordinates that manifold3d got."""
    points, triangles = mesh
    with open(path, "w") as file:
        file.write(f"OFF\n{len(points)} {len(triangles)} 0\n")
        file.writelines(f"{x:.17g} {y:.17g} {z:.17g}\n" for x, y, z in points.tolist())
        file.writelines(f"3 {a} {b} {c}\n" for a, b, c in triangles.tolist())


def result(pair, program, root=pairs.ROOT, seconds=600):
    """What CGAL says of one pair: a number, or {"refused": reason}, for each of pairs.VALUES."""
    answer = {"tool": "CGAL", "version": None, "command": f"python3 data/reference/cgal_reference.py {pair['name']}"}
    with tempfile.TemporaryDirectory() as folder:
        files = [Path(folder) / name for name in ("a.off", "b.off")]
        for mesh, path in zip(pairs.meshes(pair, root), files):
            write_off(mesh, path)
        try:
            run = subprocess.run([program, *files], capture_output=True, text=True, timeout=seconds)
            if run.returncode == 0:
                return answer | json.loads(run.stdout)
            reason = f"ended with status {run.returncode}: {run.stderr.strip()[:200]}"
        except subprocess.TimeoutExpired:
            reason = f"no answer within {seconds} s"
    version = subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout.strip()
    return answer | {"version": version} | {name: {"refused": reason} for name in pairs.VALUES}


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--program", type=Path, default=PROGRAM, help="built from data/reference/cgal")
    arguments.add_argument("--root", type=Path, default=pairs.ROOT, help="folder that the models' paths start from")
    arguments.add_argument("pair", nargs="*", help="names from pairs.toml; all of them where none is given")
    given = arguments.parse_args()
    for pair in pairs.load(given.root, given.pair):
        values = result(pair, given.program.resolve(), given.root)
        pairs.write_result(pair, values, given.root)
        print(pair["name"], *(f"{name} {values[name]}" for name in pairs.VALUES), sep="  ")


if __name__ == "__main__":
    main()
