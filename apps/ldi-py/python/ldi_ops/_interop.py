"""Results as objects of other libraries. Each is imported when it is asked for."""

from __future__ import annotations

import importlib
import json
from collections.abc import Mapping
from typing import Any


def need(module: str, extra: str | None = None) -> Any:
    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = module.partition(".")[0]
        raise ImportError(f"{package} is not installed: pip install {package}, or ldi-ops[{extra or package}]") from error


def to_trimesh(vertices: Any, faces: Any) -> Any:
    return need("trimesh").Trimesh(vertices, faces, process=False)


def to_pyvista(vertices: Any, faces: Any) -> Any:
    return need("pyvista").PolyData.from_regular_faces(vertices, faces)


def to_xarray(image: Any) -> Any:
    import numpy as np

    coordinates = {
        axis: ((axis,), origin + image.spacing * np.arange(count), {"units": image.unit or ""})
        for axis, origin, count in zip("xyz", image.origin, image.shape, strict=True)
    }
    return need("xarray").DataArray(image.to_numpy(), coords=coordinates, dims=("x", "y", "z"), name="inside")


def metrics_to_pandas(metrics: Any) -> Any:
    columns = ("id", "name", "value", "error", "lower", "upper", "unit", "status", "symbol", "method")
    rows = [[getattr(metric, column) for column in columns] for metric in metrics.values()]
    frame = need("pandas").DataFrame(rows, columns=list(columns)).set_index("id")
    numbers = ["value", "error", "lower", "upper"]
    return frame.astype(dict.fromkeys(numbers, "float64"))


CLASH_COLUMNS = {
    "a": "str",
    "b": "str",
    "state": "str",
    "finding": "object",
    "distance": "float64",
    "volume": "float64",
    "volume_lower": "float64",
    "volume_upper": "float64",
    "depth": "float64",
    "depth_upper": "float64",
    "x": "float64",
    "y": "float64",
    "z": "float64",
}


def clashes_to_pandas(clashes: Any) -> Any:
    return need("pandas").DataFrame(clashes.pairs, columns=list(CLASH_COLUMNS)).astype(CLASH_COLUMNS)


def limits_as_toml(limits: dict[str, Any]) -> str:
    """Returns limits as the text of a limits file."""
    lines = []
    for metric, limit in limits.items():
        if not isinstance(limit, Mapping):
            raise TypeError(f"the limit of {metric!r} must be a dict with 'min', 'max' or both, not {limit!r}")
        bounds = ", ".join(f"{name} = {json.dumps(value)}" for name, value in limit.items())
        lines.append(f"{json.dumps(metric)} = {{ {bounds} }}\n")
    return "".join(lines)
