"""A look at a session as people read it: rates, lateness, joints, force, and what the safety core does."""

import math
from bisect import bisect_left
from collections.abc import Sequence

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from hil.robots.absent import warning
from hil.safety.cycle import Reaction
from hil.view.glance import Glance
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
