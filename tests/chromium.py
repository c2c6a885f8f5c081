"""The system's Chromium, without a screen and without calls home."""

import os
import shutil

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
