"""The live view, a process of its own: `misfit hil view`."""

import time
from pathlib import Path

from rich.console import Console
from rich.live import Live

from hil.view.glance import Look
from hil.view.picture import picture

# How often it looks.
PAUSE_S = 0.1
# A session that shows nothing new for so long has ended.
GONE_S = 2.0


def watch(path: Path, console: Console, seconds: float = float("inf")) -> int:
    """Show a session until it ends, or so long; returns how many cycles were seen."""
    window = Look(path)
    end = time.monotonic() + seconds
    seen, before, changed = 0, (0, time.monotonic()), time.monotonic()
    rate = 0.0
    try:
        with Live(console=console, auto_refresh=False) as live:
            while time.monotonic() < min(end, changed + GONE_S) and path.exists():
                glance = window.look()
                now = time.monotonic()
                if glance is not None and glance.cycles != seen:
                    seen, changed = glance.cycles, now
                    if now - before[1] >= 1.0 or not rate:
                        rate = (seen - before[0]) / max(now - before[1], PAUSE_S)
                        before = (seen, now)
                    live.update(picture(glance, rate, window.about.get("without", ())), refresh=True)
                time.sleep(PAUSE_S)
    finally:
        window.close()
    return seen
