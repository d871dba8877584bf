"""Exceptions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np


class Error(Exception):
    """The reason why an operation gave no result. The message names the file where there is one, and the way out."""


class InputError(Error, ValueError):
    """An input is invalid: a file that cannot be read, or a mesh that bounds no solid."""


class NotClosed(InputError):
    """A mesh is not closed.

    `name` is the name of the solid. `places` has the ends of the first edges of each kind of defect (`open_edges`, `odd_edges`,
    `unbalanced_edges`), float64 (n, 2, 3), at most five of each.
    """

    def __init__(self, message: str, name: str, places: dict[str, np.ndarray]) -> None:
        super().__init__(message)
        self.name = name
        self.places = places

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (str(self), self.name, self.places)


class UsageError(Error, ValueError):
    """The arguments of a call contradict one another or are out of range."""


class MachineError(Error, RuntimeError):
    """The machine has too little memory or disk, or lacks a device, or the process is a fork of one that computed."""


class Cancelled(Error):
    """The progress function stopped the operation by returning False."""
