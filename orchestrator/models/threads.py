"""Threads shared by nested loops: fits run side by side, and the trials of each fit on threads that have become idle.

Without that, the last fits of a stage would take one thread each while the others wait. Results do not depend on the number
of threads.
"""

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar, copy_context
from threading import Semaphore
from typing import TypeVar

Item = TypeVar("Item")
Found = TypeVar("Found")


class Threads:
    """So many workers, of which the thread that asks is one."""

    def __init__(self, count: int) -> None:
        self._idle = Semaphore(max(count - 1, 0))

    def do(self, work: Callable[[Item], Found], items: Sequence[Item]) -> list[Found]:
        """Do work on items, with idle workers if there are any; results in the order of the items.

        Raises:
            Exception: what the work on the first item that fails raises, when all are done.
        """
        parts = [Future[Found]() for _ in items]
        left = deque(zip(parts, items, strict=True))
        with ThreadPoolExecutor(max(len(items) - 1, 1)) as pool:  # which starts no thread before it needs one
            helpers = list[Future[None]]()
            while left:
                while len(left) > 1 and self._idle.acquire(blocking=False):
                    helpers.append(pool.submit(copy_context().run, self._help, work, left))
                _take_one(work, left)
            self._idle.release()  # who waits is idle, too
            for helper in helpers:
                helper.result()
            self._idle.acquire()
        return [part.result() for part in parts]

    def _help(self, work: Callable[[Item], Found], left: deque[tuple[Future[Found], Item]]) -> None:
        try:
            while left:
                _take_one(work, left)
        finally:
            self._idle.release()


def _take_one(work: Callable[[Item], Found], left: deque[tuple[Future[Found], Item]]) -> None:
    """Do the next of the items, unless another worker was faster."""
    try:
        part, item = left.popleft()
    except IndexError:
        return
    try:
        part.set_result(work(item))
    except Exception as error:
        part.set_exception(error)


_AT_WORK: ContextVar[Threads | None] = ContextVar("threads", default=None)


@contextmanager
def threads(count: int) -> Iterator[Threads]:
    """So many workers for all that this thread, and whoever helps it, does meanwhile."""
    workers = Threads(count)
    before = _AT_WORK.set(workers)
    try:
        yield workers
    finally:
        _AT_WORK.reset(before)


def on_idle_threads(work: Callable[[Item], Found], items: Sequence[Item]) -> list[Found]:
    """Do work on items with those of this thread's workers that are idle; alone if it has none.

    >>> on_idle_threads(abs, [-1, 2])
    [1, 2]
    """
    return (_AT_WORK.get() or Threads(1)).do(work, items)
