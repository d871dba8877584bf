"""Progress of long calls, as a bar."""

from __future__ import annotations

import sys
from typing import Any


class Bar:
    """Shows the stage of a call, by `tqdm` where it is installed, else on stderr. It vanishes at the end of the call."""

    def __init__(self) -> None:
        self._bar: Any = None
        self._width = 0

    def __call__(self, stage: str, done: int, total: int) -> None:
        try:
            from tqdm.auto import tqdm  # type: ignore[import-untyped]
        except ImportError:
            share = f"{100 * done // total:3d} % " if total else ""
            text = f"{share}{stage}"
            self._write(text)
            self._width = len(text)
            return
        if self._bar is None:
            self._bar = tqdm(total=total or None, leave=False)
        self._bar.total = total or None
        self._bar.n = done
        self._bar.set_description_str(stage, refresh=False)
        self._bar.refresh()

    def _write(self, text: str) -> None:
        sys.stderr.write("\r" + text.ljust(self._width))
        sys.stderr.flush()

    def close(self) -> None:
        """Removes the bar."""
        if self._bar is not None:
            self._bar.close()
            self._bar = None
        elif self._width:
            self._write("")
            sys.stderr.write("\r")
            self._width = 0
