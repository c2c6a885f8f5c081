"""Who does the tasks of a long computation: this process, or a Dask cluster; what is done survives a kill.

A task holds all that it needs, so it gives the same numbers wherever it runs. Results are kept by the content of the task
and of the program in a folder of the cache until the computation is finished.
"""

import hashlib
import pickle
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any, Protocol

from fmus.files import cache_folder, write_atomically
from orchestrator.cluster import client_of


class Task(Protocol):
    """Something to compute, with all that it needs."""

    def run(self) -> Any:
        """Compute it; the same task gives the same result everywhere."""
        ...

    @property
    def key(self) -> str:
        """Content hash of all that the result depends on, the program included."""
        ...


class Work(Protocol):
    """Runs tasks one at a time for each caller; callers may be many threads."""

    def do(self, task: Task) -> Any:
        """Result of a task.

        Raises:
            ComponentError: if a model fails on the way.
        """
        ...

    @property
    def callers(self) -> int | None:
        """Threads that should call at a time, None for as many as the search likes."""
        ...


class Here:
    """Work in this process."""

    callers: int | None = None

    def do(self, task: Task) -> Any:
        """Run a task."""
        return task.run()


class Cluster:
    """Work on a Dask cluster.

    Raises:
        MisfitError: if Dask is not installed or no scheduler answers at the address.
    """

    callers: int | None = 64

    def __init__(self, address: str) -> None:
        self._client = client_of(address)

    def do(self, task: Task) -> Any:
        """Send a task to some worker and wait for it."""
        return self._client.submit(_run_alone, task, pure=False).result()

    def close(self) -> None:
        """Leave the cluster."""
        self._client.close()


def _run_alone(task: Task) -> Any:
    """Run a task on a worker, whose BLAS must not use threads of its own."""
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1, user_api="blas"):
        return task.run()


class Resumable:
    """Work that remembers finished tasks in a folder."""

    def __init__(self, inner: Work, folder: Path) -> None:
        self._inner, self._folder = inner, folder
        self.remembered = 0

    @property
    def callers(self) -> int | None:
        """As the inner work says."""
        return self._inner.callers

    def do(self, task: Task) -> Any:
        """Result of a task, from the folder if it was finished before."""
        file = self._folder / f"{task.key}.pickle"
        if file.is_file():
            self.remembered += 1
            return pickle.loads(file.read_bytes())
        result = self._inner.do(task)
        write_atomically(file, pickle.dumps(result))
        return result


@contextmanager
def resumable(name: str, scheduler: str | None = None) -> Iterator[Work]:
    """Work that goes on where an interrupted run with the same tasks stopped; forgotten once it ends well.

    Args:
        name: what the diagnosis is of; another name starts afresh.
        scheduler: address of a Dask scheduler, None for this process.
    """
    inner: Work = Here() if scheduler is None else Cluster(scheduler)
    folder = cache_folder("resume") / hashlib.sha256(name.encode()).hexdigest()[:24]
    try:
        yield Resumable(inner, folder)
    finally:
        if isinstance(inner, Cluster):
            inner.close()
    shutil.rmtree(folder, ignore_errors=True)


@cache
def program_digest() -> bytes:
    """SHA-256 over the files of the program, for the keys of tasks."""
    root = Path(__file__).parent
    files = sorted(path for pattern in ("**/*.py", "**/*.c", "**/*.toml", "**/*.mo") for path in root.glob(pattern))
    return hashlib.sha256(b"".join(path.read_bytes() for path in files)).digest()
