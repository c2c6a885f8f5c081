"""The system's Chromium, without a screen and without calls home."""

import os
import shutil
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress

import psutil

NAMES = ("chromium", "chromium-browser", "google-chrome")
FLAGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-dev-shm-usage",  # shared memory is small in containers
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]


def program() -> str | None:
    """Where it is: `MISFIT_CHROMIUM`, or the first of the usual names; None if there is none."""
    return os.environ.get("MISFIT_CHROMIUM") or next(filter(None, map(shutil.which, NAMES)), None)


@contextmanager
def children_killed_after(seconds: float) -> Iterator[None]:
    """Kill the browser and its driver if they do not end by themselves: Playwright waits for them without a limit."""
    timer = threading.Timer(seconds, _kill_children)
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


def _kill_children() -> None:
    for child in psutil.Process().children(recursive=True):
        with suppress(psutil.NoSuchProcess):
            child.kill()
