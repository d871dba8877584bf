"""Clash of parts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from . import _native
from ._load import load
from ._native import Clashes, Shape, Solid


def clash(
    parts: Mapping[str, Shape],
    *,
    clearance: float | None = None,
    touching: float | None = None,
    allow_touching: bool = False,
    ignore: Sequence[str] = (),
    resolution: int | None = None,
    fill: str = "even-odd",
) -> Clashes:
    """Compares the parts of an assembly: which overlap, touch, or come nearer than `clearance`.

    `touching` is the largest gap or depth that counts as touching; by default, the rounding of 32-bit coordinates. `ignore` has
    pairs that are not compared, such as 'bolt*:nut*'. `resolution` is the number of rays along the longest side of the box that
    two parts share, where their overlap has no exact volume. Lengths are in the unit of the parts.
    """
    if not isinstance(parts, Mapping):
        raise TypeError(f"parts is a dict of names and solids, not a {type(parts).__name__}")
    return _native.clash(
        [(name, _solid(part)) for name, part in parts.items()],
        clearance=clearance,
        touching=touching,
        allow_touching=allow_touching,
        ignore=list(ignore),
        resolution=resolution,
        fill=fill,
    )


def _solid(part: Shape) -> Solid:
    """Returns a part as a solid; the mesh of another library, too."""
    if isinstance(part, Solid):
        return part
    return part.solid() if isinstance(part, Shape) else load(part)
