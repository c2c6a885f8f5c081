"""The live view, a process of its own: `misfit hil view`."""

import math
import time
from bisect import bisect_left
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.table import Table
from rich.text import Text

from hil.robots.absent import warning
from hil.safety.cycle import Reaction
from hil.view.glance import Glance, Look
from hil.view.layout import EDGES

_STAGES = ("not armed", "armed", "stopped")
_WIDTH = 30
# Upper ends of the rows of the histogram, in us.
_ROWS = (10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0, 10000.0)


def picture(now: Glance, rate_hz: float, without: Sequence[str] = ()) -> RenderableType:
    """Draw a glance; `rate_hz` is how many cycles a second there have been lately, `without` the safeguards that are waived."""
    reaction = Reaction(now.reaction)
    calm = reaction is Reaction.PASS and not now.reason
    seconds = (now.time_ns - now.began_ns) * 1e-9
    head = Text.assemble(
        (f"{_STAGES[now.stage]}, {reaction.name.lower()}", "bold green" if calm else "bold red"),
        f"   {seconds:.1f} s, {now.cycles} cycles, {rate_hz:.0f} Hz of {1e9 / now.period_ns:.0f},"
        f" {now.missing} answers missing",
    )
    joints = Table("joint", "angle rad", "speed rad/s", "sent N.m", "asked N.m", box=None, pad_edge=False)
    rows = zip(now.angles, now.speeds, now.torques, now.asked, strict=True)
    for number, row in enumerate(rows, start=1):
        joints.add_row(str(number), *(f"{value:+.3f}" for value in row))
    size = sum(value * value for value in now.force) ** 0.5
    force = Text(f"force at the wrist {size:.1f} N ({', '.join(f'{value:+.1f}' for value in now.force)})")
    parts: list[RenderableType] = [head, joints, force, _histogram(now.lateness)]
    if without:
        parts.insert(0, Text(warning(without), "bold red"))
    if now.reason:
        parts.append(Text(now.reason, "bold red"))
    return Group(*parts)


def _histogram(counts: tuple[int, ...]) -> Table:
    """Cycles by how late they began; the bars are as long as their shares."""
    table = Table("late by us", "cycles", "", box=None, pad_edge=False)
    names = [f"< {edge:g}" for edge in _ROWS] + [f">= {_ROWS[-1]:g}"]
    rows = [0] * len(names)
    for edge, count in zip((*EDGES, math.inf), counts, strict=True):
        rows[bisect_left(_ROWS, edge)] += count
    total = max(sum(counts), 1)
    for name, count in zip(names, rows, strict=True):
        if count:
            table.add_row(name, str(count), "█" * max(round(_WIDTH * count / total), 1))
    return table


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
