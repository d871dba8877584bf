#!/usr/bin/env python3
"""Builds the runner of the open Boolean benchmark: copies this folder's ldi-bench and states what was built.

usage: build.py [--mode release|debug] [--clean]
"""

import argparse
import json
import shutil
import subprocess
from datetime import datetime, timezone
from pathlib import Path

HERE = Path(__file__).resolve().parent


def said(*command):
    run = subprocess.run(command, cwd=HERE, capture_output=True, text=True)
    return run.stdout.strip() if run.returncode == 0 else None


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--mode", choices=("release", "debug"), default="release")
    arguments.add_argument("--clean", action="store_true", help="remove what was built")
    given = arguments.parse_args()
    output = HERE / "bin"
    if given.clean:
        shutil.rmtree(output, ignore_errors=True)
        return
    root = next(folder for folder in HERE.parents if (folder / "Cargo.lock").exists())
    command = ["cargo", "build", "--package", "ldi-bench", "--no-default-features", "--message-format", "json"]
    command += ["--release"] if given.mode == "release" else []
    told = subprocess.run(command, cwd=root, check=True, stdout=subprocess.PIPE, text=True).stdout
    messages = (json.loads(line) for line in told.splitlines())
    program = next(m["executable"] for m in messages if m.get("executable") and m["target"]["name"] == "ldi-bench")
    output.mkdir(exist_ok=True)
    shutil.copy2(program, output / "ldi-bench")
    info = {
        "runner_id": "ldi-ops-0.1",
        "build_mode": given.mode,
        "timestamp_utc": datetime.now(timezone.utc).isoformat(timespec="seconds"),
        "upstream": {"resolved_commit": said("git", "rev-parse", "HEAD")},
        "adapter": {"dirty": bool(said("git", "status", "--porcelain"))},
        "toolchain": {"compiler": said("rustc", "--version")},
        "artifacts": ["bin/ldi-bench"],
    }
    (output / "build-info.json").write_text(json.dumps(info, indent=2) + "\n")


if __name__ == "__main__":
    main()
