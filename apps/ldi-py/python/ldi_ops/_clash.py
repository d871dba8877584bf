"""Clash of parts."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from typing import Any, NamedTuple

from . import _native
from ._errors import InputError, UsageError
from ._executor import calls_at_once, reporting, results, threads_of_worker
from ._load import load
from ._native import VERSION, Clashes, Shape, Solid, unit_symbol
from ._options import options

Path = str | os.PathLike[str]

# Tiles for each call that an executor runs at the same time, so that workers end at about the same time.
TILES_OF_WORKER = 4


class File(NamedTuple):
    """A part as the driver read it."""

    name: str
    path: str
    # The path as it was given, for messages.
    title: str
    size: int | None
    # A hash of the mesh.
    fingerprint: int


def clash(
    parts: Mapping[str, Shape | Path],
    *,
    clearance: float | None = None,
    touching: float | None = None,
    allow_touching: bool = False,
    ignore: Sequence[str] = (),
    resolution: int | None = None,
    pitch: float | None = None,
    tolerance: float | None = None,
    fill: str = "even-odd",
    unit: str | None = None,
    executor: Executor | None = None,
    threads: int | None = None,
) -> Clashes:
    """Compares the parts of an assembly: which overlap, touch, or come nearer than `clearance`.

    `parts` has the shape of each name, or the path of its file, which is one part. `unit` is the unit of files that state none.
    Lengths are in the unit of the first part that has one; all others are converted to it.

    `touching` is the largest gap or depth that counts as touching; by default, the rounding of 32-bit coordinates. `ignore` has
    pairs that are not compared, such as 'bolt*:nut*'. `resolution` is the number of rays along the longest side of the box that
    two parts share, where their overlap has no exact volume; 128 by default. `pitch`, the distance between rays in the unit of the
    comparison, or `tolerance`, the share of an overlap that its estimated error must fall below, may take its place.

    `executor` is any `concurrent.futures.Executor`: a `ProcessPoolExecutor` whose `mp_context` is spawn, or Dask's
    `client.get_executor()`. Then each part is a path, and its workers must see the files: each compares the pairs of some tiles of
    the assembly, and reads the parts of a tile once. Each worker uses `threads` threads, by default the processors divided by the
    workers. The result does not depend on the number of workers unless memory is short: then a volume may be estimated instead of
    exact, a `tolerance` missed, or images refused. The limit of a worker is 80 % of the free memory by default.
    """
    if not isinstance(parts, Mapping):
        raise TypeError(f"parts is a dict of names and solids, not a {type(parts).__name__}")
    paths = {name: os.fsdecode(part) for name, part in parts.items() if isinstance(part, (str, os.PathLike))}
    if executor is not None:
        _check_paths(parts, paths)
    sizes = {name: _size(path) for name, path in paths.items()}
    read = dict(zip(paths, _native.Solid.open_all(list(paths.values())), strict=True))
    if unit is not None:
        unit = unit_symbol(unit)
        if all(solid.unit is not None for solid in read.values()):
            warnings.warn(f"no part is a file without a unit, so unit={unit!r} is ignored", stacklevel=2)
    solids = {name: _with_unit(read[name], unit) if name in read else _solid(part, fill) for name, part in parts.items()}
    shared: dict[str, Any] = {
        "touching": touching,
        "resolution": resolution,
        "pitch": pitch,
        "tolerance": tolerance,
        "fill": fill,
    }
    comparison = _native.Clash(
        list(solids.items()), clearance=clearance, allow_touching=allow_touching, ignore=list(ignore), **shared
    )
    if executor is None:
        with options(threads=threads):
            return comparison.compare()
    plan = comparison.plan()
    files = [
        File(name, os.path.abspath(path), path, sizes[name], fingerprint)
        for (name, path), fingerprint in zip(paths.items(), plan.fingerprints(), strict=True)
    ]
    tiles = plan.tiles(TILES_OF_WORKER * calls_at_once(executor))
    calls = {at: (*_of_tile(files, tile), unit, {**shared, "unit": plan.unit}, VERSION) for at, tile in enumerate(tiles)}
    compared: list[tuple[tuple[int, int], Any]] = []
    with reporting("clash", "pairs") as report:
        threads = threads if threads is not None else threads_of_worker(executor)
        for at, found in results(compare_tile, calls, executor, threads):
            compared += zip(tiles[at], found, strict=True)
            report(len(compared), sum(map(len, tiles)))
    return plan.join(compared)


def compare_tile(
    files: Sequence[File],
    pairs: Sequence[tuple[int, int]],
    unit: str | None,
    settings: Mapping[str, Any],
    version: str,
) -> list[tuple[dict[str, Any], list[tuple[str, str]]]]:
    """Returns what is found of pairs of files, by their places in the list; runs in a worker."""
    if version != VERSION:
        raise UsageError(f"a worker has version {VERSION} of ldi_ops, and the process that called it {version}")
    _check_same(files, (_size(file.path) in (None, file.size) for file in files))
    read = zip(files, _native.Solid.open_all([file.path for file in files]), strict=True)
    solids = [(file.name, _with_unit(solid.named(file.title), unit)) for file, solid in read]
    plan = _native.Clash(solids, **settings).plan()
    prints = zip(files, plan.fingerprints(), strict=True)
    _check_same(files, (file.fingerprint == fingerprint for file, fingerprint in prints))
    return plan.compare(pairs)


def _of_tile(files: Sequence[File], tile: Sequence[tuple[int, int]]) -> tuple[list[File], list[tuple[int, int]]]:
    """Returns the files of a tile, and its pairs by their places among these."""
    parts = sorted({part for pair in tile for part in pair})
    places = {part: place for place, part in enumerate(parts)}
    return [files[part] for part in parts], [(places[a], places[b]) for a, b in tile]


def _check_paths(parts: Mapping[str, Any], paths: Mapping[str, str]) -> None:
    """Checks that all parts are paths."""
    for name, part in parts.items():
        if name not in paths:
            raise UsageError(
                f"part {name!r} is a {type(part).__name__}: with an executor, each part is the path of a file, as meshes are not "
                "sent to workers; save it to a file and give its path"
            )


def _check_same(files: Sequence[File], are_same: Iterator[bool]) -> None:
    """Checks that a worker sees the files that the driver read."""
    for file, is_same in zip(files, are_same, strict=True):
        if not is_same:
            raise InputError(
                f"{file.path}: the file of part {file.name!r} is another in a worker than in the process that called it; it was "
                "changed meanwhile, or the worker sees another folder"
            )


def _size(path: str) -> int | None:
    """Returns the size of a file; None if it cannot be read, which the reader reports."""
    try:
        return os.path.getsize(path)
    except OSError:
        return None


def _with_unit(solid: Solid, unit: str | None) -> Solid:
    return solid if unit is None else solid.with_unit(unit)


def _solid(part: Any, fill: str) -> Solid:
    """Returns a part as a solid; the mesh of another library, too."""
    if isinstance(part, Solid):
        return part
    return part.solid(fill=fill) if isinstance(part, Shape) else load(part)
