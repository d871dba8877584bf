"""Sweeps: the metrics of many designs, in one table."""

from __future__ import annotations

import hashlib
import itertools
import json
import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any, get_type_hints

from . import _solids
from ._errors import InputError, MachineError, UsageError
from ._executor import reporting, results, threads_of_worker
from ._interop import need
from ._native import VERSION, Shape, catalogue, sweep_page
from ._settings import MetricsSettings

Make = Callable[..., Any]

# Columns of the table beside its parameters and metrics.
FACTS = ("design", "status", "error", "version", "length_unit", "passed", "warnings")

# The settings of a measurement.
SETTINGS = get_type_hints(MetricsSettings)

# The content of a metric in a row, and the endings of its columns.
CELL = {"value": "", "lower": ".lower", "upper": ".upper", "status": ".status"}

# The end of the message where a worker of a sweep died.
GO_ON = "; the designs that were measured are kept, and the same sweep with a new executor goes on with the others"


def sweep(
    make: Make | str,
    grid: Mapping[str, Iterable[Any]] | Sequence[Mapping[str, Any]],
    *,
    out: str | os.PathLike[str],
    executor: Executor | None = None,
    limits: dict[str, dict[str, str | float]] | None = None,
    threads: int | None = None,
    pareto: Mapping[str, str] | None = None,
    **settings: Any,
) -> Any:
    """Measures designs, writes a Parquet file with a row for each, and returns it as a `pandas.DataFrame`.

    A page about all designs is written beside it: `runs.html` of `runs.parquet`. `pareto` says what is better, such as
    `{"porosity": "max", "wall.thinnest": "max"}`, the default; the page shows the designs that no other dominates in all of these.

    `make` is a function that takes the parameters of a design and returns its shape, or a pair of shape and region; or the name
    of a model solid, such as 'gyroid'. `grid` has the values of each parameter, all combinations of which are designs, or is a
    list of designs as dicts. `settings` are those of `Shape.metrics`.

    `executor` is any `concurrent.futures.Executor`: a `ProcessPoolExecutor` whose `mp_context` is spawn, or Dask's
    `client.get_executor()`. Functions and parameters are sent to its workers, never meshes, so `make` must be importable there.
    Each worker uses `threads` threads, by default the processors divided by the workers. Without an executor, the designs are
    measured one after another in this process.

    A design that fails is a row with `status` 'failed' and the message in `error`. Rows are the same whatever the number of
    workers. A sweep that was stopped goes on where it was: designs in `out`, and in the folder beside it that an unfinished
    sweep leaves, are not measured again if the design, the settings and the version are the same; failed ones are. The file has
    the designs of the last sweep alone. Where the machine lacks memory or a device for a design, `MachineError` is raised.
    """
    pyarrow = need("pyarrow", "sweep")
    need("pandas", "sweep")
    unknown = set(settings) - set(SETTINGS)
    if unknown:
        raise UsageError(f"unknown keywords {', '.join(sorted(unknown))}: the settings are {', '.join(SETTINGS)}")
    designs = _designs(grid)
    plan = {"make": _name(make), "settings": settings, **({} if limits is None else {"limits": limits})}
    keys = [_key({**plan, "version": VERSION}, design) for design in designs]
    if len(set(keys)) < len(keys):
        raise UsageError("two designs of the grid have the same parameters")
    path = Path(out)
    objectives = json.dumps(dict(pareto or {}))
    sweep_page("", "[]", objectives)  # Refuses names that no metric has before anything is measured.
    parts = path.with_name(path.name + ".parts")
    rows = _finished(path, parts, set(keys))
    threads = threads if threads is not None else threads_of_worker(executor)
    wanted = zip(keys, designs, strict=True)
    calls = {key: (design, make, limits, settings, VERSION) for key, design in wanted if key not in rows}
    parts.mkdir(parents=True, exist_ok=True)
    with reporting("sweep", "designs") as report:
        for key, row in results(measure, calls, executor, threads, GO_ON):
            rows[key] = {"design": key, **row}
            _replace(parts / f"{key}.json", json.dumps(rows[key]).encode())
            report(len(rows), len(keys))
    ordered = [{**rows[key], "plan": plan, "parameters": design} for key, design in zip(keys, designs, strict=True)]
    table = _table(pyarrow, ordered)
    title = f"{len(designs)} designs of {make if isinstance(make, str) else getattr(make, '__name__', type(make).__name__)}"
    _replace(path.with_suffix(".html"), sweep_page(title, json.dumps(ordered, default=str), objectives).encode())
    _write(pyarrow, table, path)
    for key in keys:
        (parts / f"{key}.json").unlink(missing_ok=True)
    if not any(parts.iterdir()):
        parts.rmdir()
    return table.to_pandas()


def read_sweep(folder: str | os.PathLike[str], *, out: str | os.PathLike[str] | None = None) -> Any:
    """Returns the designs of a folder of `ldi-ops sweep` as a `pandas.DataFrame`, with the columns of `sweep`.

    `out` is a Parquet file to be written, with the units in the metadata of its columns.
    """
    pyarrow = need("pyarrow", "sweep")
    listed = Path(folder) / "sweep.csv"
    if not listed.exists():
        raise InputError(f"{listed} does not exist: the sweep has no table until all of its parts are measured")
    frame = need("pandas", "sweep").read_csv(listed, usecols=["design"], dtype=str)
    rows = [json.loads((Path(folder) / "rows" / f"{key}.json").read_bytes()) for key in frame["design"]]
    for row in rows:
        row["parameters"] = {name.replace("-", "_"): value for name, value in row["parameters"].items()}
    table = _table(pyarrow, rows)
    if out is not None:
        _write(pyarrow, table, Path(out))
    return table.to_pandas()


def _write(pyarrow: Any, table: Any, path: Path) -> None:
    """Writes a Parquet file completely or not at all."""
    sink = pyarrow.BufferOutputStream()
    need("pyarrow.parquet", "sweep").write_table(table, sink)
    _replace(path, sink.getvalue().to_pybytes())


def measure(
    design: Mapping[str, Any],
    make: Make | str,
    limits: dict[str, dict[str, str | float]] | None,
    settings: Mapping[str, Any],
    version: str,
) -> dict[str, Any]:
    """Returns the row of one design; runs in a worker."""
    if version != VERSION:
        raise UsageError(f"a worker has version {VERSION} of ldi_ops, and the process that called it {version}")
    row: dict[str, Any] = {
        "parameters": dict(design),
        "error": None,
        "passed": None,
        "warnings": [],
        "length_unit": None,
        "version": VERSION,
        "metrics": {},
    }
    try:
        made = _solids.FUNCTIONS[make](**design) if isinstance(make, str) else make(**design)
        shape, region = made if isinstance(made, tuple) else (made, None)
        if not isinstance(shape, Shape):
            raise UsageError(f"the design is a {type(shape).__name__}, not a Shape")
        metrics = shape.metrics(region=region, limits=limits, view=False, **settings)
    except MachineError:
        # Another machine, or this one with fewer workers, may measure the design: there is no row.
        raise
    except Exception as error:
        return {**row, "error": f"{type(error).__name__}: {error}"}
    cells = {id: {name: _finite(getattr(metric, name)) for name in CELL} for id, metric in metrics.items()}
    return {**row, "length_unit": metrics.unit, "passed": metrics.passed, "warnings": metrics.warnings, "metrics": cells}


def _finite(value: Any) -> Any:
    """Returns None of infinite values, which JSON cannot hold."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _designs(grid: Mapping[str, Iterable[Any]] | Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Returns the parameters of each design, as plain numbers and texts."""
    if isinstance(grid, Mapping):
        values = [_values(value) for value in grid.values()]
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


def _values(value: Any) -> list[Any]:
    """Returns the values of a parameter: those of a list, or a single one."""
    return [value] if isinstance(value, str) or not isinstance(value, Iterable) else list(value)


def _plain(value: Any) -> Any:
    """Returns a number of numpy as Python's, so that it has one text."""
    value = value.item() if hasattr(value, "item") and getattr(value, "ndim", 0) == 0 else value
    if isinstance(value, (tuple, list)) or hasattr(value, "tolist"):
        return [_plain(part) for part in value]
    if isinstance(value, float) and not math.isfinite(value):
        raise UsageError(f"a parameter is {value}, which no design can have")
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    raise UsageError(f"a parameter is a number, a text or a list of these, not a {type(value).__name__}")


def _name(make: Make | str) -> str:
    """Returns the name by which a design is known in later runs."""
    if isinstance(make, str):
        if make not in _solids.FUNCTIONS:
            raise UsageError(f"there is no model solid '{make}'; there are {', '.join(_solids.FUNCTIONS)}")
        return make
    name = getattr(make, "__qualname__", None)
    if name is None or "<" in name or hasattr(make, "__self__"):
        raise UsageError("later runs know a design by the name of its function: define it with def, at the top of a module")
    return f"{make.__module__}.{name}"


def _key(common: Mapping[str, Any], design: Mapping[str, Any]) -> str:
    """Returns a hash of a design, its settings and the version."""
    text = json.dumps({**common, "parameters": design}, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _finished(path: Path, parts: Path, keys: set[str]) -> dict[str, dict[str, Any]]:
    """Returns the measured rows of earlier runs."""
    found = need("pyarrow.parquet", "sweep").read_table(path).to_pylist() if path.exists() else []
    if found and not found[0].keys() >= set(FACTS):
        raise InputError(f"{path} is no table of a sweep of this version; delete it, or name another file")
    rows = [_row(columns) for columns in found if columns["design"] in keys]
    rows += [json.loads(part.read_bytes()) for part in sorted(parts.glob("*.json"))]
    return {row["design"]: row for row in rows if row["design"] in keys and row["error"] is None}


def _row(columns: dict[str, Any]) -> dict[str, Any]:
    """Returns a row of the table as it was measured."""
    ids = [id for id, _, _ in catalogue()]
    endings = {id + ending for id in ids for ending in CELL.values()}
    facts = {name: columns[name] for name in FACTS if name != "status"}
    facts["warnings"] = [warning.split(": ", 1) for warning in columns["warnings"]]
    parameters = {name: value for name, value in columns.items() if name not in endings and name not in FACTS}
    metrics = {id: {name: columns[id + ending] for name, ending in CELL.items()} for id in ids}
    return {**facts, "parameters": parameters, "metrics": metrics}


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


def _column(pyarrow: Any, values: list[Any]) -> tuple[Any, list[Any]]:
    """Returns the type of a column of parameters and its values, as texts if they are of several kinds."""
    try:
        return pyarrow.array(values).type, values
    except (pyarrow.ArrowInvalid, pyarrow.ArrowTypeError):
        return pyarrow.string(), [_shown(value) for value in values]


def _shown(value: Any) -> str:
    """Returns a parameter as the page shows it: 0.4, or 2,2,3 of a list."""
    return ",".join(map(_shown, value)) if isinstance(value, list) else value if isinstance(value, str) else json.dumps(value)


def _table(pyarrow: Any, rows: list[dict[str, Any]]) -> Any:
    """Returns the table of all rows: parameters, facts, and value, bounds and status of each metric of the catalogue."""
    units = {row["length_unit"] for row in rows if row["error"] is None}
    if len(units) > 1:
        raise UsageError(f"the designs have several units of length: {', '.join(sorted(unit or 'none' for unit in units))}")
    text, number = pyarrow.string(), pyarrow.float64()
    fields, columns = [], []

    def add(name: str, kind: Any, values: list[Any], about: dict[str, str] | None = None) -> None:
        fields.append(pyarrow.field(name, kind, metadata=about))
        columns.append(pyarrow.array(values, kind))

    add("design", text, [row["design"] for row in rows])
    for name in rows[0]["parameters"]:
        add(name, *_column(pyarrow, [row["parameters"][name] for row in rows]))
    add("status", text, ["measured" if row["error"] is None else "failed" for row in rows])
    add("error", text, [row["error"] for row in rows])
    add("passed", pyarrow.bool_(), [row["passed"] for row in rows])
    add("warnings", pyarrow.list_(text), [[f"{code}: {message}" for code, message in row["warnings"]] for row in rows])
    for id, unit, title in catalogue(next(iter(units), None)):
        for name, ending in CELL.items():
            values = [row["metrics"].get(id, {}).get(name) for row in rows]
            about = None if name == "status" else {"unit": unit, "name": title}
            add(id + ending, text if name == "status" else number, values, about)
    add("length_unit", text, [row["length_unit"] for row in rows])
    add("version", text, [row["version"] for row in rows])
    return pyarrow.Table.from_arrays(columns, schema=pyarrow.schema(fields))
