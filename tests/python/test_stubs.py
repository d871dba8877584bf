"""The type stubs say what the module has."""

import subprocess
import sys
from pathlib import Path

PACKAGE = Path(__file__).parents[2] / "apps" / "ldi-py"


def test_stubs_of_the_package_are_up_to_date():
    done = subprocess.run([sys.executable, PACKAGE / "stubs.py", "--check"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_stubs_agree_with_the_module(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "mypy.stubtest", "ldi_ops"],
        capture_output=True,
        text=True,
        cwd=tmp_path,
    )
    assert done.returncode == 0, done.stdout + done.stderr
