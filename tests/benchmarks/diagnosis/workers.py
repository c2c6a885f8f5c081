"""Jobs on several processes; one that takes its process down costs that job and no other."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from queue import Empty, SimpleQueue
from threading import Thread
from typing import Generic, TypeVar

from tests.benchmarks.diagnosis.child import end_with_parent

Job = TypeVar("Job")
Found = TypeVar("Found")


class _Worker(Generic[Job, Found]):
    """A process that does one job after another, and is replaced when it dies."""

    def __init__(self, work: Callable[[Job], Found], lost: Callable[[Job, Exception], Found]) -> None:
        self._work, self._lost = work, lost

    def run(self, jobs: "SimpleQueue[Job]", results: "SimpleQueue[Found | None]") -> None:
        pool = _one_process()
        while True:
            try:
                job = jobs.get_nowait()
            except Empty:
                break
            try:
                results.put(pool.submit(self._work, job).result())
            except Exception as error:
                pool.shutdown(wait=False)
                pool = _one_process()
                results.put(self._lost(job, error))
        pool.shutdown()
        results.put(None)


def _one_process() -> ProcessPoolExecutor:
    # Spawned, as threads and forks do not mix.
    return ProcessPoolExecutor(1, mp_context=get_context("spawn"), initializer=end_with_parent)


def side_by_side(
    work: Callable[[Job], Found], lost: Callable[[Job, Exception], Found], jobs: Sequence[Job], workers: int
) -> Iterator[Found]:
    """Results of `work` as they come, jobs begun in their order; `lost` answers for a job whose process raised or died.

    `work` must not return None.
    """
    waiting: SimpleQueue[Job] = SimpleQueue()
    for job in jobs:
        waiting.put(job)
    results: SimpleQueue[Found | None] = SimpleQueue()
    threads = [Thread(target=_Worker(work, lost).run, args=(waiting, results), daemon=True) for _ in range(workers)]
    for thread in threads:
        thread.start()
    left = len(threads)
    while left:
        found = results.get()
        if found is None:
            left -= 1
        else:
            yield found
