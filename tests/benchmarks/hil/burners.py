"""Company for a measurement: one process for each core that does nothing but count."""

import multiprocessing
import os
from collections.abc import Iterator
from contextlib import contextmanager


def _burn() -> None:
    count = 0
    while True:
        count += 1


@contextmanager
def burning(cores: int | None = None) -> Iterator[None]:
    """Keep all cores busy at normal priority."""
    context = multiprocessing.get_context("fork")
    processes = [context.Process(target=_burn, daemon=True) for _ in range(cores or os.cpu_count() or 1)]
    for process in processes:
        process.start()
    try:
        yield
    finally:
        for process in processes:
            process.terminate()
            process.join()
