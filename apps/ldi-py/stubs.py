#!/usr/bin/env python3
"""Writes ldi_ops/__init__.pyi: what the package exports, and a function for each model solid of the library.

usage: python apps/ldi-py/stubs.py [--check]    with the package installed; --check only compares
"""

import inspect
import sys
from pathlib import Path

from ldi_ops._solids import FUNCTIONS

STUB = Path(__file__).parent / "python" / "ldi_ops" / "__init__.pyi"

HEADER = '''# Written by apps/ldi-py/stubs.py.
from collections.abc import Sequence

from ._clash import clash as clash
from ._errors import Cancelled as Cancelled
from ._errors import Error as Error
from ._errors import InputError as InputError
from ._errors import MachineError as MachineError
from ._errors import NotClosed as NotClosed
from ._errors import UsageError as UsageError
from ._load import from_voxels as from_voxels
from ._load import load as load
from ._native import Clashes as Clashes
from ._native import Image as Image
from ._native import Metric as Metric
from ._native import Metrics as Metrics
from ._native import Shape as Shape
from ._native import Solid as Solid
from ._native import Volume as Volume
from ._options import options as options
from ._settings import MetricsSettings as MetricsSettings
from ._settings import Settings as Settings
from ._sweep import read_sweep as read_sweep
from ._sweep import sweep as sweep

__version__: str
'''


def kind_of(default: object) -> str:
    """Returns the type of a parameter by its default; a number may be one for all axes, or one each."""
    if isinstance(default, str):
        return "str"
    return "float | Sequence[float]"


def stub() -> str:
    functions = []
    for name, function in FUNCTIONS.items():
        parameters = inspect.signature(function).parameters.values()
        lines = [f"    {p.name}: {kind_of(p.default)} = {p.default!r},\n" for p in parameters]
        functions.append(f"def {name}(\n    *,\n{''.join(lines)}) -> Solid: ...\n")
    import ldi_ops

    exported = "".join(f'    "{name}",\n' for name in ldi_ops.__all__)
    return HEADER + "\n" + "".join(functions) + f"\n__all__ = [\n{exported}]\n"


if __name__ == "__main__":
    if sys.argv[1:] == ["--check"]:
        if STUB.read_text() != stub():
            sys.exit(f"{STUB} is not what the module exports; run python apps/ldi-py/stubs.py")
    else:
        STUB.write_text(stub())
