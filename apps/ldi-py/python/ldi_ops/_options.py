"""Options of all calls within a `with` block."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, replace

from ._errors import UsageError

Listener = Callable[[str, int, int], object]


@dataclass(frozen=True)
class Options:
    """Threads, the most bytes that the process may hold, and the progress function; None is the default of the library."""

    threads: int | None = None
    memory: int | None = None
    progress: Listener | None = None


_options: ContextVar[Options] = ContextVar("ldi_ops.options", default=Options())  # noqa: B039


def current() -> Options:
    return _options.get()


@contextmanager
def options(
    *,
    threads: int | None = None,
    memory: int | str | None = None,
    progress: bool | Listener | None = None,
) -> Iterator[None]:
    """Sets options of all calls in the block, in this thread or task.

    `threads` is the number of threads of each call; by default, one for each processor. `memory` is the most that the process
    may hold, in bytes or as a text such as '8 GB'; by default, a share of the free memory. `progress=True` shows a bar, by
    `tqdm` where it is installed. A function `progress(stage, done, total)` is called about every 50 ms, with `total` 0 if it is
    unknown; it stops the call by returning False or 0, which raises `Cancelled`. If it has a method `close`, that is called at the
    end of each call.

    >>> with options(threads=2, memory="8 GB"):
    ...     pass
    """
    if threads is not None and threads < 1:
        raise UsageError(f"threads={threads}: at least one thread is needed")
    changed = current()
    if threads is not None:
        changed = replace(changed, threads=threads)
    if memory is not None:
        changed = replace(changed, memory=_bytes(memory))
    if progress is not None:
        changed = replace(changed, progress=_listener(progress))
    token = _options.set(changed)
    try:
        yield
    finally:
        _options.reset(token)


def _listener(progress: bool | Listener) -> Listener | None:
    if callable(progress):
        return progress
    if not progress:
        return None
    from ._progress import Bar

    return Bar()


_POWERS = {"": 0, "k": 1, "m": 2, "g": 3, "t": 4}


def _bytes(memory: int | str) -> int:
    """Returns a number of bytes; `8 GB` is 8e9, and `8 GiB` 8 · 2³⁰."""
    if not isinstance(memory, str):
        count = int(memory)
    else:
        found = re.fullmatch(r"\s*([0-9.]+)\s*([kmgt]?)(i?)b?\s*", memory.lower())
        try:
            number, power, binary = found.groups()  # type: ignore[union-attr]
            count = int(float(number) * (1024 if binary else 1000) ** _POWERS[power])
        except (AttributeError, ValueError):
            raise UsageError(f"memory={memory!r}: a number of bytes, such as 8000000000, '8 GB' or '500 MiB'") from None
    if count <= 0:
        raise UsageError(f"memory={memory!r}: the process needs some memory")
    return count
