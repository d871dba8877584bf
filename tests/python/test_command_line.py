"""The console script is the Rust program: the same output, files and exit codes."""

import os
import signal
import subprocess
import sys
import sysconfig
import time
from pathlib import Path

import pytest

PROGRAM = os.environ.get("LDI_OPS_PROGRAM")
SCRIPT = Path(sysconfig.get_path("scripts")) / "ldi-ops"

JOBS = [
    "--help",
    "--version",
    "volume --help",
    "",
    "volume missing.stl",
    "volume",
    "nothing",
    "volume a.stl --unit mm --quiet",
    "volume a.stl --unit mm --resolution 64 --estimate --quiet --axis z",
    "intersect a.stl b.stl --unit mm --quiet",
    "intersect a.stl b.stl --unit mm --quiet --assert-below 1",
    "intersect a.stl b.stl -o out.stl --unit mm --quiet",
    "check a.stl --quiet",
    "clash a.stl b.stl --unit mm --quiet --csv clash.csv",
    "sample a.stl --resolution 1000000 -o a.npz",
    "generate torus -o torus.stl --quiet",
    "completions bash",
]


def run(program, folder: Path, job: str):
    folder.mkdir()
    for name in ("a", "b"):
        model = {"a": "gyroid_sheet", "b": "bone"}[name]
        (folder / f"{name}.stl").write_bytes((Path(__file__).parents[2] / f"data/models/{model}.stl").read_bytes())
    done = subprocess.run([*program, *job.split()], cwd=folder, capture_output=True)
    files = {path.name: path.read_bytes() for path in folder.iterdir()}
    return done.returncode, done.stdout, done.stderr, files


@pytest.mark.parametrize("job", JOBS)
def test_the_console_script_is_the_program(tmp_path, job):
    assert PROGRAM, "LDI_OPS_PROGRAM names the Rust program"
    ours = run([str(SCRIPT)], tmp_path / "ours", job)
    theirs = run([PROGRAM], tmp_path / "theirs", job)
    assert ours == theirs


def test_the_module_runs_the_command_line():
    done = subprocess.run([sys.executable, "-m", "ldi_ops", "--version"], capture_output=True, text=True)
    assert done.returncode == 0 and done.stdout.startswith("ldi-ops ")


def test_interrupts_end_the_console_script_with_130(tmp_path):
    job = ["offset", Path(__file__).parents[2] / "data/models/gyroid_sheet.stl", "--distance", "0.2", "--resolution", "1000"]
    child = subprocess.Popen([SCRIPT, *job, "-o", tmp_path / "out.stl"], stderr=subprocess.DEVNULL)
    time.sleep(1)
    child.send_signal(signal.SIGINT)
    assert child.wait(timeout=60) == 130
    assert list(tmp_path.iterdir()) == []
