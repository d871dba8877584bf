#!/usr/bin/env python3
"""Counts the instructions of fixed commands of several builds of ldi-ops, by callgrind, and prints a Markdown table.

Runs each job once for each build under `valgrind --tool=callgrind`, on one thread and without a GPU, and counts what the whole
process executes: reading, the work, and writing. Counts do not depend on what else the machine does. They say nothing of caches,
memory, page faults, or the system's part, so that they complement times and do not replace them.

The last program makes the models, all of them from `ldi-ops generate`; all programs read the same files. A job that a program
refuses, or that does not end in time, has the cell "–", and its reason is beneath the table.
"""

import argparse
import dataclasses
import hashlib
import json
import os
import platform
import re
import shlex
import shutil
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

EXAMPLES = """\
examples:
  # Two builds side by side, all jobs: ten to twenty minutes.
  instructions.py --program before=/tmp/before/ldi-ops --program after=target/release/ldi-ops

  # One job, three times, to see how much its count differs from run to run.
  instructions.py --program now=target/release/ldi-ops --jobs read --runs 3

  # A table that grows: counts that the file has are not taken again, so that an interrupted run goes on.
  instructions.py --program a=old --program b=new --models /tmp/models --counts counts.json --output table.md

Builds to compare should have the same compiler and the same profile. Copy each of them away before the next is built:
  cargo build --release --package ldi-ops-cli --no-default-features && cp target/release/ldi-ops /tmp/before/
"""

# Every command has these: one thread, the CPU, and no progress, whose display would depend on time.
COMMON = ["--threads", "1", "--quiet"]
SAMPLING = ["--backend", "cpu"]

# The folder within that of the models to which jobs write; it is empty when a job starts.
OUT = "out"

# The move of the shifted lattice, in mm: that of `ldi-bench exact-models`.
SHIFT = (1.31, 2.17, 0.73)

# A record of a binary STL file: normal, three corners, attribute.
RECORD = struct.Struct("<12fH")
STL_HEAD = 84

# File: what `ldi-ops generate` takes.
MODELS = {
    "gyroid.stl": ["gyroid", "--resolution", "26"],
    "bone.stl": ["bone"],
    "lattice.stl": ["bcc", "--cells", "4", "--cell-size", "5", "--radius", "0.5", "--resolution", "18"],
    "organic.stl": ["organic", "--resolution", "75"],
    "sheet.stl": ["gyroid", "--cells", "2", "--resolution", "16"],
    "torus.stl": ["torus"],
    "ball.stl": ["sphere"],
}
SHIFTED = ("lattice.stl", "lattice-shifted.stl")
OFFSET = ["offset", "organic.stl", "--distance=0.1", "--resolution", "128"]


@dataclasses.dataclass(frozen=True, eq=False)
class Job:
    """A command of ldi-ops, and the words for it in the table."""

    name: str
    title: str
    arguments: list[str]
    # What gives the same result in builds that refuse the arguments.
    older: list[str] | None = None


JOBS = [
    # With few rays: what is left beside reading is to place all triangles on the raster.
    Job(
        "read",
        "read the gyroid, prove it closed, sample 8² rays",
        ["volume", "gyroid.stl", "--estimate", "--axis", "z", "--resolution", "8", *SAMPLING],
    ),
    Job("check", "check the gyroid for all defects", ["check", "gyroid.stl"]),
    Job(
        "estimate",
        "estimate of gyroid ∩ bone",
        ["intersect", "gyroid.stl", "bone.stl", "--estimate", "--axis", "z", "--resolution", "512", *SAMPLING],
    ),
    Job(
        "estimate-lattice",
        "estimate of lattice ∩ shifted",
        ["intersect", *SHIFTED, "--estimate", "--axis", "z", "--resolution", "512", *SAMPLING],
    ),
    Job("exact-one", "exact volume of the gyroid", ["volume", "gyroid.stl", "--exact", *SAMPLING]),
    Job("exact", "exact volume of gyroid ∩ bone", ["intersect", "gyroid.stl", "bone.stl", "--exact", *SAMPLING]),
    Job("exact-lattice", "exact volume of lattice ∩ shifted", ["intersect", *SHIFTED, "--exact", *SAMPLING]),
    Job(
        "exact-mesh",
        "exact mesh of lattice ∩ shifted",
        ["intersect", *SHIFTED, "--mesh", "exact", "-o", f"{OUT}/common.stl", *SAMPLING],
    ),
    Job(
        "full-mesh",
        "offset of an organic solid, full mesh",
        [*OFFSET, "-o", f"{OUT}/full.stl", "--surface-error", "0", *SAMPLING],
        # Full meshes were the default while an error of 0 was refused.
        [*OFFSET, "-o", f"{OUT}/full.stl", *SAMPLING],
    ),
    Job(
        "simplified",
        "the same offset, simplified mesh",
        [*OFFSET, "-o", f"{OUT}/few.stl", "--surface-error", "0.05h", *SAMPLING],
    ),
    Job("sum", "Minkowski sum of torus and ball", ["minkowski", "torus.stl", "ball.stl", "--resolution", "128", *SAMPLING]),
    Job(
        "report",
        "report on a gyroid sheet, 64 rays",
        ["report", "sheet.stl", "--resolution", "64", "-o", f"{OUT}/report", *SAMPLING],
    ),
]
JOB_NAMES = [job.name for job in JOBS]


class Refused(Exception):
    """A job that gave no count, with the reason."""


@dataclasses.dataclass(frozen=True)
class Program:
    """A build of ldi-ops, by the name of its column."""

    name: str
    path: Path
    digest: str


def program(text):
    name, mark, path = text.partition("=")
    if not (name and mark and path):
        raise argparse.ArgumentTypeError(f"expected NAME=PATH, not {text}")
    path = Path(path).resolve()
    if not (path.is_file() and os.access(path, os.X_OK)):
        raise argparse.ArgumentTypeError(f"{path}: not a program")
    return Program(name, path, hashlib.sha256(path.read_bytes()).hexdigest())


def jobs(text):
    names = text.split(",")
    unknown = [name for name in names if name not in JOB_NAMES]
    if unknown:
        raise argparse.ArgumentTypeError(f"no job is named {unknown[0]}; choose from {', '.join(JOB_NAMES)}")
    return [job for job in JOBS if job.name in names]


def environment():
    """Returns a small environment, the same everywhere, as its size is part of what a process reads."""
    return {"PATH": os.environ.get("PATH", os.defpath), "LC_ALL": "C"}


def make_models(maker, folder):
    """Writes the models that the folder lacks."""
    for file, arguments in MODELS.items():
        if not (folder / file).exists():
            command = [maker.path, "generate", *arguments, "-o", folder / file, "--quiet"]
            subprocess.run(command, check=True, env=environment(), stdout=subprocess.DEVNULL)
    plain, shifted = (folder / file for file in SHIFTED)
    if not shifted.exists():
        shifted.write_bytes(moved(plain.read_bytes(), SHIFT))


def moved(stl, by):
    """Returns a binary STL file whose corners are moved. Equal corners stay equal."""
    steps = (0.0, 0.0, 0.0, *by, *by, *by, 0)
    records = (RECORD.pack(*map(sum, zip(record, steps))) for record in RECORD.iter_unpack(stl[STL_HEAD:]))
    return stl[:STL_HEAD] + b"".join(records)


def count(program, arguments, folder, timeout):
    """Runs a command under callgrind in the folder of the models, and returns the number of instructions."""
    shutil.rmtree(folder / OUT, ignore_errors=True)
    (folder / OUT).mkdir()
    log = folder / OUT / "callgrind.log"
    valgrind = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", f"--log-file={OUT}/{log.name}"]
    command = [*valgrind, program.path, *arguments, *COMMON]
    try:
        run = subprocess.run(
            command, cwd=folder, env=environment(), timeout=timeout, stdin=subprocess.DEVNULL, capture_output=True, text=True
        )
    except subprocess.TimeoutExpired:
        raise Refused(f"did not end within {timeout:g} s") from None
    text = log.read_text(errors="replace") if log.exists() else ""
    if "unhandled instruction" in text:
        raise Refused("valgrind does not know an instruction of it")
    if run.returncode != 0:
        lines = [line for line in run.stderr.splitlines() if line.strip()]
        raise Refused(f"exit status {run.returncode}: {lines[0] if lines else 'no message'}")
    collected = re.search(r"Collected\s*:\s*(\d+)", text)
    if not collected:
        raise Refused("callgrind states no count")
    return int(collected[1])


def vector_instructions():
    """Returns the vector instructions that valgrind offers to programs, from what the dynamic loader finds when it runs in it."""
    loader = Path("/lib64/ld-linux-x86-64.so.2")
    if not loader.exists():
        return "not known"
    run = subprocess.run(["valgrind", "--tool=none", "--quiet", loader, "--help"], capture_output=True, text=True)
    supported = re.findall(r"(x86-64-v\d) \(supported", run.stdout)
    names = {"x86-64-v4": "AVX-512", "x86-64-v3": "AVX2", "x86-64-v2": "SSE4.2"}
    return next((text for level, text in names.items() if level in supported), "SSE2 or not known")


def processor():
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return line.partition(":")[2].strip()
    return platform.machine()


def version(command):
    return subprocess.run([*command, "--version"], capture_output=True, text=True, check=True).stdout.strip()


@dataclasses.dataclass(frozen=True)
class Cell:
    """The counts of a job by a program, and the note beneath the table, if it needs one."""

    runs: list[int]
    note: str | None


class Counts:
    """The counts that were taken, by program and command; kept in a file if one is given."""

    def __init__(self, file, runs, folder, timeout):
        self.file, self.runs, self.folder, self.timeout = file, runs, folder, timeout
        self.entries = json.loads(file.read_text()) if file and file.exists() else {}

    def cell(self, program, job):
        entry = self.take(program, job.arguments)
        if "refused" in entry and job.older:
            refused, entry = entry["refused"], self.take(program, job.older)
            if "refused" not in entry:
                return Cell(entry["runs"], f"`ldi-ops {shlex.join(job.older)}` ({refused})")
        return Cell(entry["runs"], entry.get("refused"))

    def take(self, program, arguments):
        """Runs a command until there are enough counts of it, or a reason why there are none."""
        entry = self.entries.setdefault(f"{program.digest[:16]} {shlex.join(arguments)}", {"runs": []})
        while len(entry["runs"]) < self.runs and "refused" not in entry:
            try:
                entry["runs"].append(count(program, arguments, self.folder, self.timeout))
            except Refused as refused:
                entry["refused"] = str(refused)
            if self.file:
                self.file.write_text(json.dumps(self.entries, indent=1, ensure_ascii=False) + "\n")
        return entry


def millions(instructions):
    return f"{instructions / 1e6:,.0f}".replace(",", " ")


def table(programs, cells):
    """Returns the table of the cells, a list for each job, and notes."""
    names = [program.name for program in programs]
    ratio = [f"{names[-1]} / {names[0]}"] if len(programs) > 1 else []
    lines = [f"| {' | '.join(['millions of instructions', *names, *ratio])} |", "|---|" + "---:|" * (len(names) + len(ratio))]
    notes = {}
    for job, row in cells.items():
        least = [min(cell.runs, default=None) for cell in row]
        texts = ["–" if instructions is None else millions(instructions) for instructions in least]
        if ratio:
            texts.append(f"{least[-1] / least[0]:.2f}" if least[0] and least[-1] else "–")
        lines.append(f"| {job.title} | {' | '.join(texts)} |")
        for name, cell in zip(names, row):
            if cell.note:
                notes.setdefault((job.title, cell.note), []).append(name)
    return lines, [f"- {title}, {', '.join(told)}: {note}" for (title, note), told in notes.items()]


def repeatability(programs, cells):
    """Returns a sentence about the differences between runs, if any cell has several."""
    repeated = [
        ((max(cell.runs) - min(cell.runs)) / min(cell.runs), job.title, program.name, cell.runs)
        for job, row in cells.items()
        for program, cell in zip(programs, row)
        if len(cell.runs) > 1
    ]
    if not repeated:
        return []
    share, title, name, runs = max(repeated)
    return [
        f"{len(repeated)} cells were counted more than once; they show the least count. The largest difference between counts of "
        f"one cell is {share:.1e} of it ({title}, {name}: {min(runs):,} to {max(runs):,}).",
    ]


def page(programs, cells, runs):
    """Returns the table, notes on cells, the repeatability of the counts, and the commands."""
    lines, notes = table(programs, cells)
    own = ["instructions.py", *(f"--program {program.name}=…" for program in programs), f"--runs {runs}"]
    parts = ["### Instructions", f"`{' '.join(own)}`", "\n".join(lines)]
    if notes:
        parts.append("\n".join(notes))
    parts += repeatability(programs, cells)
    parts.append(
        f"{version(['valgrind'])} on {processor()}. Within it, programs find {vector_instructions()} and no vector instructions "
        "beyond, and choose their code by that."
    )
    commands = [f"ldi-ops generate {shlex.join(arguments)} -o {file}" for file, arguments in MODELS.items()]
    commands.append(f"# {SHIFTED[1]}: {SHIFTED[0]} moved by {', '.join(map(str, SHIFT))}")
    commands += [f"ldi-ops {shlex.join([*job.arguments, *COMMON])}" for job in cells]
    parts.append("```sh\n" + "\n".join(commands) + "\n```")
    return "\n\n".join(parts) + "\n"


def main():
    arguments = argparse.ArgumentParser(
        description=__doc__, epilog=EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    arguments.add_argument(
        "--program", metavar="NAME=PATH", type=program, action="append", required=True,
        help="a build of ldi-ops and the head of its column; may be repeated",
    )
    arguments.add_argument("--jobs", type=jobs, default=JOBS, metavar="JOB,…", help=f"of {', '.join(JOB_NAMES)} (default: all)")
    arguments.add_argument("--runs", type=int, default=1, help="of each job by each program; the least is shown (default 1)")
    arguments.add_argument("--models", metavar="DIR", type=Path, help="keep the models there, and take those that are there")
    arguments.add_argument(
        "--counts", metavar="FILE", type=Path, help="keep counts there, and do not take those again; for one folder of models"
    )
    arguments.add_argument("--timeout", type=float, default=600, help="seconds for one run (default 600)")
    arguments.add_argument("--output", metavar="FILE", type=Path, help="write the table there, too")
    given = arguments.parse_args()
    if not shutil.which("valgrind"):
        arguments.error("valgrind is not installed")
    names = [build.name for build in given.program]
    if len(set(names)) < len(names):
        arguments.error("--program: two programs have one name")

    with tempfile.TemporaryDirectory() as temporary:
        folder = (given.models or Path(temporary)).resolve()
        folder.mkdir(parents=True, exist_ok=True)
        make_models(given.program[-1], folder)
        counts = Counts(given.counts, given.runs, folder, given.timeout)
        cells = {}
        for job in given.jobs:
            print(job.title, file=sys.stderr)
            cells[job] = [counts.cell(program, job) for program in given.program]
        shutil.rmtree(folder / OUT, ignore_errors=True)
    text = page(given.program, cells, given.runs)
    print(text, end="")
    if given.output:
        given.output.write_text(text)


if __name__ == "__main__":
    main()
