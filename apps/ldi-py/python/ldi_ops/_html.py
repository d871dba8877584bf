"""Facts about solids, for notebooks."""

from __future__ import annotations

import base64
import html
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ._native import Solid


def solid(shape: Solid) -> str:
    """Returns a picture of a solid, with its name, size and volume."""
    unit = f" {shape.unit}" if shape.unit else ""
    low, high = shape.bounds
    sides = " × ".join(f"{b - a:.6g}" for a, b in zip(low, high, strict=True))
    rows = {
        "Solid": shape.name,
        "Triangles": f"{len(shape.faces):,}",
        "Size": f"{sides}{unit}",
        "Volume": str(shape.volume()),
        "Unit": shape.unit or "not stated: pass unit= to load",
    }
    cells = "".join(f"<tr><th>{name}</th><td>{html.escape(value)}</td></tr>" for name, value in rows.items())
    picture = base64.b64encode(shape.picture()).decode()
    return f'<img width="600" alt="" src="data:image/png;base64,{picture}"><table>{cells}</table>'
