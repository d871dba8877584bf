"""Calls on the workers of an executor: their threads, their progress, and what is raised where a worker dies."""

from __future__ import annotations

import os
import sys
import uuid
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor, Future, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from typing import Any, TypeVar

from ._errors import Cancelled, MachineError
from ._options import current, options

Key = TypeVar("Key")


def threads_of_worker(executor: Executor | None) -> int | None:
    """Returns the threads of each worker: the processors here divided by the workers, or those of the options if these are fewer.

    Where the number of workers is not known, as on a cluster, it is that of the options, or 1.
    """
    if executor is None:
        return None
    asked = current().threads
    workers: int | None = getattr(executor, "_max_workers", None)
    if workers is None:
        return asked or 1
    share = max(1, _processors() // workers)
    return share if asked is None else min(asked, share)


def calls_at_once(executor: Executor) -> int:
    """Returns the number of calls that an executor runs at the same time: an estimate, by which work is divided."""
    client: Any = getattr(executor, "_client", None)
    if hasattr(client, "nthreads"):
        # Dask's.
        return max(1, sum(client.nthreads().values()))
    workers: int = getattr(executor, "_max_workers", None) or _processors()
    return workers


def _processors() -> int:
    """Returns the number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def results(
    function: Callable[..., Any],
    calls: Mapping[Key, tuple[Any, ...]],
    executor: Executor | None,
    threads: int | None,
    way_out: str = "",
) -> Iterator[tuple[Key, Any]]:
    """Yields the key and the result of each call of a function, as they are finished.

    The calls run on the workers of an executor, or one after another here, with so many threads each and the memory limit of the
    options. `way_out` ends the message of the error where a worker dies. Calls that have not begun are cancelled at the end.
    """
    memory = current().memory
    if executor is None:
        for key, arguments in calls.items():
            yield key, call("", threads, memory, function, arguments)
        return
    # Dask gives equal calls the result of the first, but a file may have changed since.
    id = uuid.uuid4().hex
    futures: dict[Future[Any], Key] = {}
    try:
        for key, arguments in calls.items():
            futures[executor.submit(call, id, threads, memory, function, arguments)] = key
        for future in as_completed(futures):
            yield futures[future], future.result()
    except _deaths() as error:
        raise MachineError(
            "a worker died: its machine may have too little memory (use fewer workers, or limit each of them by "
            "ldi_ops.options(memory=…)), or it could not import the function (define it in a module, and start the executor under "
            f"`if __name__ == '__main__':`){way_out}"
        ) from error
    finally:
        for future in futures:
            future.cancel()


def call(_id: str, threads: int | None, memory: int | None, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
    """Calls a function with options; runs in a worker."""
    with options(threads=threads, memory=memory, progress=False):
        return function(*arguments)


def _deaths() -> tuple[type[BaseException], ...]:
    """Returns the exceptions by which executors report that a worker died."""
    distributed = sys.modules.get("distributed")
    return (BrokenProcessPool,) if distributed is None else (BrokenProcessPool, distributed.KilledWorker)


@contextmanager
def reporting(name: str, stage: str) -> Iterator[Callable[[int, int], None]]:
    """Yields a function that tells the progress function how many steps of a stage are done; closes a bar at the end.

    `name` is that of the call, for the message where the progress function stops it.
    """
    progress = current().progress

    def report(done: int, total: int) -> None:
        answer = progress(stage, done, total) if progress is not None else None
        if answer is not None and not answer:
            raise Cancelled(f"the progress function stopped the {name} after {done} of {total} {stage}")

    try:
        yield report
    finally:
        close = getattr(progress, "close", None)
        if close is not None:
            close()
