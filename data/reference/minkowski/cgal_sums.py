#!/usr/bin/env python3
"""The cases of sums.toml by CGAL in exact arithmetic, written into data/reference/minkowski/<case>.json.

usage: cgal_sums.py [--program CGAL_SUM] [CASE …]
The program is built from data/reference/cgal; regenerate.sh does so.
"""

import argparse
import json
import subprocess
import tempfile
from pathlib import Path

import sums
from cgal_reference import write_off

PROGRAM = sums.pairs.ROOT / "target" / "cgal_reference" / "cgal_sum"


def result(case, program, seconds=1800):
    """What CGAL says of a case."""
    command = f"python3 data/reference/minkowski/cgal_sums.py {case.name}"
    version = subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout.strip()
    answer = {"way": "nef", "tool": "CGAL", "version": version, "command": command}
    with tempfile.TemporaryDirectory() as folder:
        files = [Path(folder) / name for name in ("a.off", "b.off")]
        for mesh, path in zip(case.meshes(), files):
            write_off(mesh, path)
        flags = ["--difference"] if case.operation == "difference" else []
        try:
            run = subprocess.run([program, *flags, *files], capture_output=True, text=True, timeout=seconds)
        except subprocess.TimeoutExpired:
            return answer | {"volume": {"refused": f"no answer within {seconds} s"}}
    if run.returncode != 0:
        reason = f"ended with status {run.returncode}: {run.stderr.strip()[:200]}"
        return answer | {"volume": {"refused": reason}}
    return answer | json.loads(run.stdout)


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--program", type=Path, default=PROGRAM, help="built from data/reference/cgal")
    arguments.add_argument("case", nargs="*", help="names from sums.toml; all of them where none is given")
    given = arguments.parse_args()
    for case in sums.load(given.case):
        if "nef" in case.ways:
            found = result(case, given.program.resolve())
            sums.write_result(case, found)
            print(case.name, found["volume"], sep="  ", flush=True)


if __name__ == "__main__":
    main()
