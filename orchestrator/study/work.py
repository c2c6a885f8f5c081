"""Who does the tasks of the study: this process, several, or a Dask cluster; finished ones are kept until all are done."""

import hashlib
import shutil
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from fmus.children import BrokenWorker, Workers
from fmus.errors import ComponentError
from fmus.files import cache_folder
from orchestrator.work import Cluster, Resumable, Task, Work

_CODE = {".py", ".mo", ".c", ".h"}


def digest(thing: Any) -> str:
    """SHA-256 over the content of a task and of the program, the same in every process."""
    found = hashlib.sha256(_program())
    _feed(found, thing)
    return found.hexdigest()


def _feed(into: Any, thing: Any) -> None:
    if is_dataclass(thing):
        into.update(type(thing).__name__.encode())
        for field in fields(thing):
            into.update(field.name.encode())
            _feed(into, getattr(thing, field.name))
    elif isinstance(thing, np.ndarray):
        into.update(repr((thing.shape, thing.dtype.str)).encode() + np.ascontiguousarray(thing).tobytes())
    elif isinstance(thing, dict):
        for name, part in thing.items():
            into.update(repr(name).encode())
            _feed(into, part)
    elif isinstance(thing, tuple):
        into.update(f"({len(thing)}".encode())
        for part in thing:
            _feed(into, part)
    else:
        into.update(repr(thing).encode() + b";")


@cache
def _program() -> bytes:
    root = Path(__file__).parents[2]
    files = [path for room in ("orchestrator", "fmus") for path in (root / room).rglob("*") if path.suffix in _CODE]
    return hashlib.sha256(b"".join(path.read_bytes() for path in sorted(files))).digest()


Told = Callable[[int, int], None]


class Processes:
    """Tasks in processes of their own; with one worker in this one."""

    def __init__(self, workers: int) -> None:
        self.callers: int | None = workers
        self._pool = Workers(workers) if workers > 1 else None

    def do(self, task: Task) -> Any:
        """Result of a task.

        Raises:
            ComponentError: if a worker process dies.
        """
        if self._pool is None:
            return alone(task)
        try:
            return self._pool.submit(alone, task).result()
        except BrokenWorker as error:
            raise ComponentError(
                "a worker process of the study died, perhaps for lack of memory; try fewer --workers; finished parts are kept"
            ) from error

    def close(self) -> None:
        """End the processes; what has not begun is not done."""
        if self._pool is not None:
            self._pool.close()


def alone(task: Task) -> Any:
    """Run a task with one BLAS thread, so that every worker rounds alike and factorisations of this size are quick."""
    with threadpool_limits(limits=1, user_api="blas"):
        return task.run()


@contextmanager
def working(name: str, workers: int, scheduler: str | None) -> Iterator[Work]:
    """Work that goes on where an interrupted study of that name stopped; what it kept is forgotten once all ends well.

    Args:
        workers: processes here.
        scheduler: address of a Dask scheduler instead, None for processes.
    """
    inner: Processes | Cluster = Processes(workers) if scheduler is None else Cluster(scheduler)
    folder = cache_folder("resume") / hashlib.sha256(name.encode()).hexdigest()[:24]
    try:
        yield Resumable(inner, folder)
    finally:
        inner.close()
    shutil.rmtree(folder, ignore_errors=True)


def do_all(work: Work, tasks: Sequence[Task], told: Told = lambda done, total: None) -> list[Any]:
    """Results of tasks in their order, whoever did them; `told` hears how many are done of how many."""
    found = []
    with ThreadPoolExecutor(work.callers or 1) as callers:
        try:
            for result in callers.map(work.do, tasks):
                found.append(result)
                told(len(found), len(tasks))
        except BaseException:
            callers.shutdown(cancel_futures=True)
            raise
    return found
