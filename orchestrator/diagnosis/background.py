"""A thread for work that a search does not wait for."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

Found = TypeVar("Found")


class Background:
    """A thread for what a search does not wait for, in the gaps that it leaves; none for a single worker."""

    def __init__(self, workers: int) -> None:
        self._pool = ThreadPoolExecutor(1) if workers > 1 else None

    def __enter__(self) -> "Background":
        return self

    def __exit__(self, *reason: object) -> None:
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)

    def begin(self, work: Callable[[], Found]) -> Callable[[], Found]:
        """Begin work, and return what gives its result."""
        return work if self._pool is None else self._pool.submit(work).result
