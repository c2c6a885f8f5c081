"""The picture of a ledger: the error of each version, falling step by step towards the noise floor."""

import html
import math
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass

from orchestrator.ledger import LedgerEntry
from orchestrator.report.numbers import digits
from orchestrator.report.palette import SURFACES, Colour
from orchestrator.report.sentences import effect_name, errors


@dataclass(frozen=True)
class Step:
    """One version: what was added to the one before, and its errors as multiples of the noise floor.

    `decisive` is the error on held-out trials where there are any, else that on learning trials. Errors of signals are
    in words.
    """

    version: int
    name: str
    added: str
    learning: float
    held_out: float | None
    signals: str

    @property
    def decisive(self) -> float:
        """The error that counts."""
        return self.learning if self.held_out is None else self.held_out


def steps_of(entries: Sequence[LedgerEntry]) -> tuple[Step, ...]:
    """The versions of a ledger, in its order."""
    found, known = [], set[str]()
    for entry in entries:
        names = [effect_name(effect) for effect in entry.effects]
        added = [name for name in names if name not in known]
        known = set(names)
        decisive = entry.learning if entry.held_out is None else entry.held_out
        found.append(
            Step(
                entry.version,
                entry.name,
                " + ".join(added) or ("as given" if entry.version == 0 else "the same effects, fitted again"),
                entry.learning.over_floor,
                None if entry.held_out is None else entry.held_out.over_floor,
                errors(decisive.rmse, entry.units),
            )
        )
    return tuple(found)


def summary(steps: Sequence[Step]) -> str:
    """The picture in a sentence."""
    if not steps:
        return "No version has been recorded yet."
    first, last = steps[0], steps[-1]
    trials = "learning" if last.held_out is None else "held-out"
    if len(steps) == 1:
        return f"The model as given has an error on {trials} trials of {digits(first.decisive)} times the noise floor."
    verb = "fell" if last.decisive < first.decisive else "went"
    return (
        f"The error on {trials} trials {verb} from {digits(first.decisive)} to {digits(last.decisive)} times the noise"
        f" floor in {len(steps) - 1} {'step' if len(steps) == 2 else 'steps'}."
    )


def decades(steps: Sequence[Step]) -> tuple[int, int]:
    """Powers of ten, lower and upper, that hold all drawable errors and the floor with room above and below it."""
    values = [value for step in steps for value in (step.learning, step.held_out) if drawable(value)]
    drawn = [1.0, *(float(value) for value in values if value is not None)]
    return min(-1, math.floor(math.log10(min(drawn)))), max(1, math.ceil(math.log10(max(drawn))))


def drawable(value: float | None) -> bool:
    """Whether a log axis has a place for a value: not for the infinite error of a model that diverged."""
    return value is not None and math.isfinite(value) and value > 0


# Of the place of one version, of which a picture has room for a few at least: it is no wider than a phone if it has few.
VERSION, FEWEST = 110, 3
HEIGHT = 318
LEFT, RIGHT, TOP, BOTTOM = 70, 20, 46, 90
LETTER = 7.5
FALL_S = 0.9

STYLE = f"""
.steps-drawing {{ width: 100%; height: auto; display: block; font: 14px system-ui, sans-serif; }}
.steps-drawing .falls {{ transform-box: fill-box; transform-origin: bottom;
  animation: steps-fall {FALL_S}s ease-in-out both; }}
.steps-drawing .appears {{ animation: steps-appear 0.3s ease-in both; }}
@keyframes steps-fall {{ from {{ transform: scaleY(var(--from)); }} }}
@keyframes steps-appear {{ from {{ opacity: 0; }} }}
@media (prefers-reduced-motion: reduce), print {{
  .steps-drawing .falls, .steps-drawing .appears {{ animation: none; }} }}
"""


def drawing(steps: Sequence[Step], already_shown: int | None = None) -> str:
    """Return the picture as SVG.

    Bars beyond the first `already_shown` begin at the height of the version before and fall, one after the other; by
    default none moves. `STYLE` has to be in the page once.
    """
    moving = len(steps) if already_shown is None else already_shown
    low, high = decades(steps)
    right = LEFT + VERSION * max(len(steps), FEWEST)
    parts = [_axis(low, high, right), _floor(low, high, right)]
    for place, step in enumerate(steps):
        before = steps[max(0, place - 1)]
        delay = (place - moving) * FALL_S if place >= moving else None
        parts.append(_version(step, before, LEFT + place * VERSION, (low, high), delay))
    parts.append(_legend(any(step.held_out is not None for step in steps), right))
    text = html.escape(summary(steps))
    return f'<svg class="steps-drawing" style="max-width: {right + RIGHT}px" viewBox="0 0 {right + RIGHT} {HEIGHT}" role="img" aria-label="{text}">{"".join(parts)}</svg>'


def height_of(value: float, decade: tuple[int, int]) -> float:
    """Height of a bar above the lower end of the axis; equal ratios are equal heights."""
    low, high = decade
    return (math.log10(value) - low) / (high - low) * (HEIGHT - TOP - BOTTOM)


def _version(step: Step, before: Step, left: float, decade: tuple[int, int], delay: float | None) -> str:
    kinds = [("learning", step.learning, before.learning), ("held-out", step.held_out, before.held_out)]
    bars = [(kind, value, earlier) for kind, value, earlier in kinds if value is not None]
    bar = min(60.0, 0.86 * VERSION / len(bars))
    start = left + (VERSION - bar * len(bars)) / 2
    drawn = [
        _bar(kind, value, earlier, start + k * bar, bar, decade, delay) for k, (kind, value, earlier) in enumerate(bars)
    ]
    middle = left + VERSION / 2
    lines = [f"version {step.version}", *textwrap.wrap(step.added, int(VERSION / LETTER))[:3]]
    words = "".join(_label(middle, HEIGHT - BOTTOM + 20 + 18 * k, text, VERSION) for k, text in enumerate(lines))
    return "".join(drawn) + words


def _bar(
    kind: str, value: float, earlier: float | None, x: float, wide: float, decade: tuple[int, int], delay: float | None
) -> str:
    ground = HEIGHT - BOTTOM
    if not drawable(value):
        return _label(x + wide / 2, ground - 8, digits(value), wide)
    tall = max(2.0, height_of(value, decade))
    moves, appears = "", ""
    if delay is not None:
        start = height_of(earlier, decade) if earlier is not None and drawable(earlier) else tall
        moves = f' class="falls" style="--from: {start / tall:.4f}; animation-delay: {delay:g}s"'
        appears = f' class="appears" style="animation-delay: {delay + FALL_S:g}s"'
    fill = Colour.HELD_OUT if kind == "held-out" else SURFACES["paper"]
    edge = Colour.HELD_OUT if kind == "held-out" else Colour.LEARNING
    return (
        f'<rect{moves} x="{x + 2:.1f}" y="{ground - tall:.1f}" width="{wide - 4:.1f}" height="{tall:.1f}" fill="{fill}"'
        f' stroke="{edge}" stroke-width="2"><title>{kind} trials: {digits(value)} times the noise floor</title></rect>'
        f'<text{appears} x="{x + wide / 2:.1f}" y="{ground - tall - 6:.1f}" text-anchor="middle" fill="{Colour.INK}"'
        f' stroke="{SURFACES["paper"]}" stroke-width="4" paint-order="stroke">{digits(value)}</text>'
    )


def _axis(low: int, high: int, right: int) -> str:
    lines = []
    for power in range(low, high + 1):
        y = HEIGHT - BOTTOM - height_of(10.0**power, (low, high))
        lines.append(
            f'<line x1="{LEFT}" x2="{right}" y1="{y:.1f}" y2="{y:.1f}" stroke="{SURFACES["rule"]}"/>'
            f'<text x="{LEFT - 8}" y="{y + 5:.1f}" text-anchor="end" fill="{Colour.QUIET}">{10.0**power:g}</text>'
        )
    title = f'<text x="0" y="14" fill="{Colour.QUIET}">error / noise floor</text>'
    return title + "".join(lines)


def _floor(low: int, high: int, right: int) -> str:
    y = HEIGHT - BOTTOM - height_of(1.0, (low, high))
    return (
        f'<line x1="{LEFT}" x2="{right}" y1="{y:.1f}" y2="{y:.1f}" stroke="{Colour.FLOOR}" stroke-width="2"'
        f' stroke-dasharray="7 4"/><text x="{right}" y="{y - 6:.1f}" text-anchor="end" fill="{Colour.FLOOR}">'
        "noise floor</text>"
    )


def _legend(held_out: bool, right: int) -> str:
    kinds = [("learning trials", SURFACES["paper"], Colour.LEARNING)]
    kinds += [("held-out trials", Colour.HELD_OUT, Colour.HELD_OUT)] if held_out else []
    marks = []
    for place, (name, fill, edge) in enumerate(reversed(kinds)):
        x = right - 126 * (place + 1)
        marks.append(
            f'<circle cx="{x}" cy="9" r="6" fill="{fill}" stroke="{edge}" stroke-width="2"/>'
            f'<text x="{x + 12}" y="14" fill="{Colour.INK}">{name}</text>'
        )
    return "".join(marks)


def _label(x: float, y: float, text: str, wide: float) -> str:
    most = max(6, int(wide / LETTER))
    short = text if len(text) <= most else text[: most - 1] + "…"
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="middle" fill="{Colour.INK}">{html.escape(short)}'
        f"<title>{html.escape(text)}</title></text>"
    )
