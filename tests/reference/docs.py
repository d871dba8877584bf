#!/usr/bin/env python3
"""Checks that the commands of README.md and docs/*.md print the output that these pages show.

usage: docs.py --program LDI-OPS [--update | --self-test] [DOCUMENT …]

Runs the commands in the fenced blocks of language `console`, and compares what they print with the block. A line that
begins with `$ ` is a command; one that ends with a backslash goes on in the next line. The lines after it, up to the next
command or the end of the block, are its output, of stdout and stderr together. The commands of a document run in order in
one temporary folder that holds a copy of data/, so that later commands read what earlier ones wrote. They run in a shell,
which finds the program as `ldi-ops`; `cargo run --release --` stands for the program, too. Each command must exit with 0: a
command that is to fail ends with `; echo "exit code $?"`.

Lines are compared as they are, with these exceptions:

- `…` in a line of the document stands for any characters, and a line of `…` alone for any number of lines;
- numbers are not compared where they are followed by s, ms, kB, MB or GB, nor in lines that begin with `time` or `memory`,
  or have them after `ldi-ops: `.

Links of the documents to files of the repository must lead to files. Exits 1 with a diff for each command whose output
differs, after the file and the line of the command. `--update` rewrites the output in the documents, and keeps lines with
`…` that still match. `--self-test` falsifies documents, and exits 1 unless each falsehood is found.
"""

import argparse
import dataclasses
import difflib
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

# Other names of the program in the documents, and the name by which the shell finds it.
PROGRAM_NAMES = ("cargo run --release --",)
PROGRAM_NAME = "ldi-ops"

# A command that takes longer, in seconds, hangs.
TIME_LIMIT = 300

# A line of this alone stands for any number of lines, and within a line for any characters.
ANY = "…"

TIMES = re.compile(r"\d[\d.]*(?:e[-+]?\d+)?(?= (?:s|ms|kB|MB|GB)\b)")
NUMBERS = re.compile(r"\d[\d.]*(?:e[-+]?\d+)?")
MASK = "#"

LINKS = re.compile(r"\]\(([^)\s#]+)(?:#[^)]*)?\)")


class DocumentError(Exception):
    """A document that breaks the rules of its blocks."""


@dataclasses.dataclass
class Command:
    """A command of a document, and the output that the document shows."""

    line: int  # of the command in the document, from 1
    text: str
    first: int  # index of the first line of output
    expected: list[str]


@dataclasses.dataclass
class Answer:
    """The exit status of a command, and the lines that it printed."""

    status: int
    lines: list[str]


# Reading


def blocks(lines: list[str]) -> list[tuple[int, int]]:
    """Returns the first line and the end of the content of each console block, as indices."""
    found, start, fence = [], None, None
    for i, line in enumerate(lines):
        if fence is None and line.startswith("```"):
            fence, start = line.strip(), i + 1
        elif fence is not None and line.strip() == "```":
            if fence == "```console":
                found.append((start, i))
            fence = None
    if fence is not None:
        raise DocumentError(f"line {start}: the block is not closed")
    return found


def commands(lines: list[str]) -> list[Command]:
    """Returns the commands of a document in their order."""
    found = []
    for start, end in blocks(lines):
        i = start
        if i == end or not lines[i].startswith("$ "):
            raise DocumentError(f"line {start + 1}: a console block begins with a command")
        while i < end:
            line, text = i + 1, lines[i][2:]
            while text.endswith("\\"):
                i += 1
                if i == end:
                    raise DocumentError(f"line {line}: the command does not end within its block")
                text = text[:-1].rstrip() + " " + lines[i].strip()
            i += 1
            first = i
            while i < end and not lines[i].startswith("$ "):
                i += 1
            if not text.startswith((PROGRAM_NAME + " ", *(name + " " for name in PROGRAM_NAMES))):
                raise DocumentError(f"line {line}: not a command of {PROGRAM_NAME}: {text}")
            found.append(Command(line, text, first, lines[first:i]))
    return found


def broken_links(path: Path, text: str) -> list[str]:
    """Returns the links of a document that lead to no file."""
    targets = [target for target in LINKS.findall(text) if "://" not in target and not target.startswith("mailto:")]
    return [target for target in targets if not (path.parent / target).exists()]


# Running


def run_all(program: Path, todo: list[Command]) -> list[Answer]:
    """Runs the commands of a document in a folder of their own and returns their answers."""
    with tempfile.TemporaryDirectory() as folder:
        work, found_as = Path(folder) / "work", Path(folder) / "bin"
        work.mkdir()
        found_as.mkdir()
        shutil.copytree(ROOT / "data", work / "data")
        (found_as / PROGRAM_NAME).symlink_to(program)
        environment = {**os.environ, "PATH": f"{found_as}{os.pathsep}{os.environ['PATH']}"}
        return [run(command.text, work, environment) for command in todo]


def run(text: str, folder: Path, environment: dict[str, str]) -> Answer:
    """Runs one command in a shell."""
    for name in PROGRAM_NAMES:
        text = text.replace(name, PROGRAM_NAME)
    try:
        done = subprocess.run(
            ["sh", "-c", text],
            cwd=folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            timeout=TIME_LIMIT,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return Answer(-1, [f"no end after {TIME_LIMIT} s"])
    printed = done.stdout.decode(errors="replace")
    return Answer(done.returncode, stripped([line.rstrip() for line in printed.splitlines()]))


# Comparing


def stripped(lines: list[str]) -> list[str]:
    """Returns the lines without empty ones at the end."""
    count = len(lines)
    while count and not lines[count - 1]:
        count -= 1
    return lines[:count]


def masked(line: str) -> str:
    """Returns a line with its times and memory replaced."""
    pattern = NUMBERS if line.removeprefix("ldi-ops: ").startswith(("time ", "memory ")) else TIMES
    return pattern.sub(MASK, line)


def line_matches(expected: str, printed: str) -> bool:
    """Returns whether a printed line is the one that a document shows."""
    parts = [re.escape(masked(part)) for part in expected.rstrip().split(ANY)]
    return re.fullmatch(".*".join(parts), masked(printed)) is not None


def alignment(expected: list[str], printed: list[str]) -> list[str | None] | None:
    """Returns the expected line of each printed line, None for lines under a `…` alone; None where the outputs differ."""
    if not expected:
        return None if printed else []
    if expected[0].strip() == ANY:
        for skipped in range(len(printed) + 1):
            rest = alignment(expected[1:], printed[skipped:])
            if rest is not None:
                return [None] * skipped + rest
        return None
    if not printed or not line_matches(expected[0], printed[0]):
        return None
    rest = alignment(expected[1:], printed[1:])
    return None if rest is None else [expected[0], *rest]


def agrees(command: Command, answer: Answer) -> bool:
    """Returns whether a command printed what the document shows, and exited with 0."""
    return answer.status == 0 and alignment(stripped(command.expected), answer.lines) is not None


def complaint(name: str, command: Command, answer: Answer) -> str:
    """Returns the place of a command and the difference between its output and the document."""
    text = f"{name}:{command.line}: $ {command.text}\n"
    if answer.status != 0:
        text += f"exit code {answer.status}\n"
    # Lines that match are shown as the document has them.
    printed = [next((line for line in command.expected if line_matches(line, each)), each) for each in answer.lines]
    difference = difflib.unified_diff(stripped(command.expected), printed, "document", "output", lineterm="", n=1)
    return text + "\n".join(difference)


def updated(lines: list[str], pairs: list[tuple[Command, Answer]]) -> list[str]:
    """Returns the lines of a document with the output of its commands; what matches stays as it is."""
    lines = list(lines)
    for command, answer in reversed(pairs):
        if not agrees(command, answer):
            patterns = [line for line in command.expected if ANY in line and line.strip() != ANY]
            fresh = [next((p for p in patterns if line_matches(p, line)), line) for line in answer.lines]
            lines[command.first : command.first + len(command.expected)] = fresh
    return lines


def lines_of(path: Path) -> list[str]:
    """Returns the lines of a document."""
    return path.read_text(encoding="utf-8").splitlines()


def examine(program: Path, path: Path, update: bool) -> tuple[int, list[str]]:
    """Runs a document; returns the number of its commands and the complaints."""
    name = str(path.relative_to(ROOT)) if path.is_relative_to(ROOT) else str(path)
    lines = lines_of(path)
    complaints = [f"{name}: no file at the link {target}" for target in broken_links(path, "\n".join(lines))]
    try:
        todo = commands(lines)
    except DocumentError as error:
        return 0, [*complaints, f"{name}: {error}"]
    pairs = list(zip(todo, run_all(program, todo)))
    if update:
        path.write_text("\n".join(updated(lines, pairs)) + "\n", encoding="utf-8")
        pairs = [pair for pair in pairs if pair[1].status != 0]
    return len(todo), complaints + [complaint(name, *pair) for pair in pairs if not agrees(*pair)]


def check(program: Path, documents: list[Path], update: bool) -> bool:
    """Returns whether all commands of the documents print what these show."""
    start, count, complaints = time.monotonic(), 0, []
    for path in documents:
        number, found = examine(program, path, update)
        count += number
        complaints += found
    for text in complaints:
        print(text)
    print(f"{len(documents)} documents, {count} commands, {len(complaints)} complaints; {time.monotonic() - start:.0f} s")
    return not complaints and count > 0


# Showing that a check can fail

TRUE_DOCUMENT = """\
# A document that is filled in by the self-test

```console
$ ldi-ops generate cuboid -o block.stl
$ cargo run --release -- generate sphere \\
    --radius 4 -o ball.stl
$ ldi-ops intersect block.stl ball.stl --unit mm --estimate --resolution 64 -v
ldi-ops: backend     …
$ ldi-ops check missing.stl; echo "exit code $?"
```
"""


def changed_figures(line: str) -> list[str]:
    """Returns the line with each of the digits changed that count."""
    result = []
    for place, digit in enumerate(line):
        changed = line[:place] + str((int(digit) + 5) % 10) + line[place + 1 :] if digit.isdecimal() else line
        if masked(changed) != masked(line):
            result.append(changed)
    return result


def falsehoods(command: Command) -> list[tuple[str, list[str]]]:
    """Returns other outputs than the right one of a command, each with what is wrong."""
    lines, wrong = stripped(command.expected), []
    for i, line in enumerate(lines):
        before, after = lines[:i], lines[i + 1 :]
        wrong.append(("a line that is missing", before + after))
        wrong.append(("a line twice", [*before, line, line, *after]))
        wrong += [("a changed figure", [*before, changed, *after]) for changed in changed_figures(line)]
    wrong.append(("a line too many", [*lines, "another line"]))
    wrong.append(("a wrong line after any lines", [ANY, "another line"]))
    return wrong


def self_test(program: Path) -> bool:
    """Returns whether every falsehood in a document is found, and nothing in the true one."""
    missed, count = [], 0
    lines = TRUE_DOCUMENT.splitlines()
    todo = commands(lines)
    lines = updated(lines, list(zip(todo, run_all(program, todo))))
    todo = commands(lines)
    answers = run_all(program, todo)
    if not any(ANY in line for line in lines):
        missed.append("a pattern that an update replaces")
    for command, answer in zip(todo, answers):
        if not answer.lines or not agrees(command, answer):
            missed.append(f"a true output is called false: {complaint('self-test', command, answer)}")
        if not agrees(dataclasses.replace(command, expected=[ANY]), answer):
            missed.append("any lines are called false")
        for what, expected in falsehoods(command):
            count += 1
            if agrees(dataclasses.replace(command, expected=expected), answer):
                missed.append(f"{what} of $ {command.text}: {expected}")
        count += 1
        if agrees(command, dataclasses.replace(answer, status=2)):
            missed.append("a command that fails")
    if not any("memory" in line or "time" in line for command in todo for line in command.expected):
        missed.append("no line of time or memory was compared")
    broken = (
        ("another program", ["```console", "$ rm block.stl", "```"]),
        ("output without a command", ["```console", "volume 1", "```"]),
        ("a block that does not end", ["```console", "$ ldi-ops devices"]),
        ("a command that does not end", ["```console", "$ ldi-ops devices \\", "```"]),
    )
    for what, bad in broken:
        count += 1
        try:
            commands(bad)
            missed.append(what)
        except DocumentError:
            pass
    count += 2
    if broken_links(ROOT / "README.md", "[here](README.md#top) [there](https://example.org)"):
        missed.append("a good link is called broken")
    if not broken_links(ROOT / "README.md", "[nowhere](docs/no-such-guide.md)"):
        missed.append("a broken link")
    # Both are found in a file. Python takes the command for a script that is not there.
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "changed.md"
        figure = next(i for i, line in enumerate(lines) if line.startswith("intersect "))
        for what, text, tried in (
            ("a changed figure in a file", changed_figures(lines[figure])[0], program),
            ("a program that fails", lines[figure], Path(sys.executable)),
        ):
            count += 1
            path.write_text("\n".join([*lines[:figure], text, *lines[figure + 1 :]]), encoding="utf-8")
            if not any(f"{path}:" in found for found in examine(tried, path, update=False)[1]):
                missed.append(what)
    for what in missed:
        print(f"not found: {what}")
    print(f"self-test: {count} falsehoods, {len(missed)} not found")
    return not missed


def main() -> None:
    """Reads the arguments and runs the check."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("documents", nargs="*", type=Path, metavar="DOCUMENT", help="only these documents")
    parser.add_argument("--program", type=Path, required=True, help="the built command line")
    parser.add_argument("--update", action="store_true", help="write the output into the documents")
    parser.add_argument("--self-test", action="store_true", help="falsify documents and see that it is found")
    arguments = parser.parse_args()
    program = arguments.program.resolve()
    if not program.is_file():
        parser.error(f"no program at {program}")
    if arguments.self_test:
        sys.exit(0 if self_test(program) else 1)
    documents = [path.resolve() for path in arguments.documents]
    documents = documents or [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
    sys.exit(0 if check(program, documents, arguments.update) else 1)


if __name__ == "__main__":
    main()
