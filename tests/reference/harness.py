"""Parts that the checks of this folder share: arguments, runs of a program, tables of complaints, and self-tests."""

import argparse
import subprocess
import sys
from pathlib import Path


def parser(document, self_test="falsify results and see that it shows", program="the built command line"):
    """Returns a parser with `--self-test`, and `--program` unless its help is None; `document` is that of the script."""
    arguments = argparse.ArgumentParser(description=document.splitlines()[0])
    if program is not None:
        arguments.add_argument("--program", type=lambda path: Path(path).resolve(), required=True, help=program)
    arguments.add_argument("--self-test", action="store_true", help=self_test)
    return arguments


def leave(is_good):
    """Ends the script with the exit code of a check."""
    sys.exit(0 if is_good else 1)


def run(words, is_right=lambda code: code == 0):
    """Runs a command and returns its stdout; raises ValueError unless its exit code is right."""
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, check=False)
    if not is_right(done.returncode):
        raise ValueError(f"exit code {done.returncode}: {done.stderr.strip()}")
    return done.stdout


def print_rows(rows):
    """Prints complaints, a line each."""
    for row in rows:
        print("  ".join(str(value) for value in row))


class Falsehoods:
    """The falsehoods that a self-test shows to a check, and the check's mistakes about them."""

    def __init__(self):
        self.count = 0
        self.unnoticed = []
        self.false_alarms = []

    def expect(self, what, complaints):
        """Counts a falsehood, which the check notices if it has complaints."""
        self.count += 1
        if not complaints:
            self.unnoticed.append(what)

    def expect_error(self, what, examine):
        """Counts a falsehood, which the check notices if `examine` raises ValueError."""
        try:
            examine()
        except ValueError:
            self.expect(what, True)
        else:
            self.expect(what, False)

    def accept(self, name, complaints):
        """Takes the complaints about a true result, which has none; returns whether that holds."""
        if complaints:
            self.false_alarms.append(f"{name}: {complaints}")
        return not complaints

    def vary(self, name, truth, complaints, falsehoods):
        """Accepts a true result, and expects each of its falsehoods, (what, *false), to be noticed.

        `truth` and `false` are the arguments of `complaints`; those of `falsehoods` are `truth`.
        """
        if self.accept(name, complaints(*truth)):
            for what, *false in falsehoods(*truth):
                self.expect(f"{name}: {what}", complaints(*false))

    def report(self):
        """Prints the mistakes, and returns whether there is none."""
        for alarm in self.false_alarms:
            print(f"a true result was called false: {alarm}")
        for what in self.unnoticed:
            print(f"not noticed: {what}")
        print(f"self-test: {self.count} falsehoods, {len(self.unnoticed)} not noticed")
        return self.count > 0 and not self.unnoticed and not self.false_alarms
