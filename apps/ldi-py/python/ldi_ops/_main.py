"""The console script `ldi-ops`: the command line of the Rust program, in this process."""

import os
import sys
from typing import NoReturn

from . import _native


def main() -> NoReturn:
    # ldi-ops chooses the adapter itself; Mesa's layer would reorder adapters, and print errors where there is no desktop.
    os.environ.setdefault("NODEVICE_SELECT", "1")
    sys.exit(_native.main(sys.argv))
