"""Sweeps: the metrics of many designs, in one table."""

from __future__ import annotations

import hashlib
import itertools
import json
import os
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, as_completed
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from . import _solids
from ._errors import Cancelled, UsageError
from ._interop import need
from ._native import VERSION, Shape, catalogue
from ._options import current, options
from ._settings import Settings

Make = Callable[..., Any]

# Columns of a row beside its parameters and metrics.
FACTS = ("design", "status", "error", "version", "length_unit", "passed")


def sweep(
    make: Make | str,
    grid: Mapping[str, Iterable[Any]] | Sequence[Mapping[str, Any]],
    *,
    out: str | os.PathLike[str],
    executor: Executor | None = None,
    limits: dict[str, dict[str, str | float]] | None = None,
    threads: int | None = None,
    **settings: Any,
) -> Any:
    """Measures designs, writes a Parquet file with a row for each, and returns it as a `pandas.DataFrame`.

    `make` is a function that takes the parameters of a design and returns its shape, or a pair of shape and region; or the name
    of a model solid, such as 'gyroid'. `grid` has the values of each parameter, all combinations of which are designs, or is a
    list of designs as dicts. `settings` are those of `Shape.metrics`.

    `executor` is any `concurrent.futures.Executor`: a `ProcessPoolExecutor` whose `mp_context` is spawn, or Dask's
    `client.get_executor()`. Functions and parameters are sent to its workers, never meshes, so `make` must be importable there.
    Each worker uses `threads` threads, by default the processors divided by the workers. Without an executor, the designs are
    measured one after another in this process.

    A design that fails is a row with `status` 'failed' and the message in `error`. Rows are the same whatever the number of
    workers. A sweep that was stopped goes on where it was: designs in `out`, and in the folder beside it that an unfinished
    sweep leaves, are not measured again if the design, the settings and the version are the same; failed ones are.
    """
    pyarrow = need("pyarrow")
    need("pandas")
    unknown = set(settings) - set(Settings.__annotations__)
    if unknown:
        raise UsageError(f"unknown keywords {', '.join(sorted(unknown))}: the settings are {', '.join(Settings.__annotations__)}")
    designs = _designs(grid)
    common = {"make": _name(make), "limits": limits, "settings": settings, "version": VERSION}
    keys = [_key(common, design) for design in designs]
    if len(set(keys)) < len(keys):
        raise UsageError("two designs of the grid have the same parameters")
    path = Path(out)
    parts = path.with_name(path.name + ".parts")
    rows = _finished(path, parts, set(keys))
    missing = [(key, design) for key, design in zip(keys, designs, strict=True) if key not in rows]
    threads = threads if threads is not None else _threads(executor)
    parts.mkdir(parents=True, exist_ok=True)
    with _closing(current().progress) as progress:
        for key, row in _measured(missing, executor, (make, limits, settings, threads)):
            rows[key] = {"design": key, **row}
            _replace(parts / f"{key}.json", json.dumps(rows[key]).encode())
            counts = len(rows), len(keys)
            answer = progress("designs", *counts) if progress is not None else None
            if answer is not None and not answer:
                raise Cancelled(f"the progress function stopped the sweep after {counts[0]} of {counts[1]} designs")
    table = _table(pyarrow, [rows[key] for key in keys], designs)
    sink = pyarrow.BufferOutputStream()
    need("pyarrow.parquet").write_table(table, sink)
    _replace(path, sink.getvalue().to_pybytes())
    shutil.rmtree(parts)
    return table.to_pandas()


@contextmanager
def _closing(progress: Any) -> Iterator[Any]:
    """Closes a bar at the end."""
    try:
        yield progress
    finally:
        if hasattr(progress, "close"):
            progress.close()


def _measured(
    missing: list[tuple[str, dict[str, Any]]], executor: Executor | None, common: tuple[Any, ...]
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yields the key and the row of each design, as they are finished."""
    if executor is None:
        for key, design in missing:
            yield key, measure(design, *common)
        return
    futures = {executor.submit(measure, design, *common): key for key, design in missing}
    try:
        for future in as_completed(futures):
            yield futures[future], future.result()
    finally:
        for future in futures:
            future.cancel()


def measure(
    design: Mapping[str, Any],
    make: Make | str,
    limits: dict[str, dict[str, str | float]] | None,
    settings: Mapping[str, Any],
    threads: int | None,
) -> dict[str, Any]:
    """Returns the row of one design; runs in a worker."""
    row: dict[str, Any] = {**design, "version": VERSION}
    try:
        with options(threads=threads, progress=False):
            made = _solids.FUNCTIONS[make](**design) if isinstance(make, str) else make(**design)
            shape, region = made if isinstance(made, tuple) else (made, None)
            if not isinstance(shape, Shape):
                raise UsageError(f"the design is a {type(shape).__name__}, not a Shape")
            metrics = shape.metrics(region=region, limits=limits, **settings)
    except Exception as error:
        return {**row, "status": "failed", "error": f"{type(error).__name__}: {error}"}
    row |= {"status": "measured", "length_unit": metrics.unit, "passed": metrics.passed}
    for id, metric in metrics.items():
        row |= {id: metric.value, f"{id}.lower": metric.lower, f"{id}.upper": metric.upper, f"{id}.status": metric.status}
    return row


def _designs(grid: Mapping[str, Iterable[Any]] | Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Returns the parameters of each design, as plain numbers and texts."""
    if isinstance(grid, Mapping):
        values = [list(values) for values in grid.values()]
        designs = [dict(zip(grid, design, strict=True)) for design in itertools.product(*values)]
    else:
        designs = [dict(design) for design in grid]
    if not designs:
        raise UsageError("the grid has no designs")
    if len({tuple(design) for design in designs}) > 1:
        raise UsageError("all designs have the same parameters, in one order")
    clash = set(designs[0]) & {*FACTS, *(id for id, _, _ in catalogue())}
    if clash:
        raise UsageError(f"the table has columns of these names; rename the parameters: {', '.join(sorted(clash))}")
    return [{name: _plain(value) for name, value in design.items()} for design in designs]


def _plain(value: Any) -> Any:
    """Returns a number of numpy as Python's, so that it has one text."""
    value = value.item() if hasattr(value, "item") and getattr(value, "ndim", 0) == 0 else value
    if isinstance(value, (tuple, list)) or hasattr(value, "tolist"):
        return [_plain(part) for part in value]
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    raise UsageError(f"a parameter is a number, a text or a list of these, not a {type(value).__name__}")


def _name(make: Make | str) -> str:
    """Returns the name by which a design is known in later runs."""
    if isinstance(make, str):
        if make not in _solids.FUNCTIONS:
            raise UsageError(f"there is no model solid '{make}'; there are {', '.join(_solids.FUNCTIONS)}")
        return make
    return f"{getattr(make, '__module__', '')}.{getattr(make, '__qualname__', repr(type(make)))}"


def _key(common: Mapping[str, Any], design: Mapping[str, Any]) -> str:
    """Returns a hash of a design, its settings and the version."""
    text = json.dumps({**common, "parameters": design}, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _threads(executor: Executor | None) -> int | None:
    if executor is None:
        return None
    workers = getattr(executor, "_max_workers", None) or os.cpu_count() or 1
    return max(1, (os.cpu_count() or 1) // workers)


def _finished(path: Path, parts: Path, keys: set[str]) -> dict[str, dict[str, Any]]:
    """Returns the measured rows of earlier runs."""
    rows: dict[str, dict[str, Any]] = {}
    if path.exists():
        rows = {row["design"]: row for row in need("pyarrow.parquet").read_table(path).to_pylist()}
    for part in sorted(parts.glob("*.json")):
        row = json.loads(part.read_bytes())
        rows[row["design"]] = row
    return {key: row for key, row in rows.items() if key in keys and row["status"] == "measured"}


def _replace(path: Path, content: bytes) -> None:
    """Writes a file completely or not at all."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        with open(temporary, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def _table(pyarrow: Any, rows: list[dict[str, Any]], designs: list[dict[str, Any]]) -> Any:
    """Returns the table of all rows: parameters, facts, and value, bounds and status of each metric of the catalogue."""
    units = {row["length_unit"] for row in rows if row["status"] == "measured"}
    if len(units) > 1:
        raise UsageError(f"the designs have several units of length: {', '.join(sorted(unit or 'none' for unit in units))}")
    text, number = pyarrow.string(), pyarrow.float64()
    fields = [pyarrow.field("design", text)]
    fields += [pyarrow.field(name, pyarrow.array([design[name] for design in designs]).type) for name in designs[0]]
    fields += [pyarrow.field(name, kind) for name, kind in (("status", text), ("error", text), ("passed", pyarrow.bool_()))]
    for id, unit, title in catalogue(next(iter(units), None)):
        about = {"unit": unit, "name": title}
        fields += [pyarrow.field(id + ending, number, metadata=about) for ending in ("", ".lower", ".upper")]
        fields.append(pyarrow.field(f"{id}.status", text))
    fields += [pyarrow.field("length_unit", text), pyarrow.field("version", text)]
    columns = [pyarrow.array([row.get(field.name) for row in rows], field.type) for field in fields]
    return pyarrow.Table.from_arrays(columns, schema=pyarrow.schema(fields))
