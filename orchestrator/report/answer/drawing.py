"""The pictures of the answer as SVG that follows the colours of the page, light or dark."""

import html
import math
import re
from collections.abc import Sequence

import numpy as np

from orchestrator.report.answer.answer import Bar
from orchestrator.report.answer.residual import Residual
from orchestrator.report.answer.witness import Witness
from orchestrator.report.answer.words import unit_text
from orchestrator.report.numbers import digits, engineering_exponent, prefixed, takes_prefix, ticks

# Points of a curve that a picture of this width can show.
MOST_POINTS = 500
# The longest bar; answer.css lets the bar of the effects fall from there.
LONGEST = 255
# How wide a picture is drawn: for a column of a page, for half of it, and for a phone, where letters of the wide one would be of 6 pixels.
WIDE, HALF, NARROW = 560, 300, 340
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
# Letters that a title has room for.
MOST_TITLE, MOST_TITLE_NARROW = 70, 48


class _Axes:
    """A frame with grid and numbers; `x` and `y` turn values into places."""

    def __init__(self, box: tuple[float, float, float, float], x: tuple[float, float], y: tuple[float, float]) -> None:
        self.left, self.top, self.right, self.bottom = box
        self.x_range, self.y_range = x, y

    def x(self, value: float) -> float:
        low, high = self.x_range
        return self.left + (value - low) / (high - low) * (self.right - self.left)

    def y(self, value: float) -> float:
        low, high = self.y_range
        return self.bottom - (value - low) / (high - low) * (self.bottom - self.top)

    def grid(self, x_label: str) -> str:
        parts = []
        for value in ticks(*self.y_range):
            y = self.y(value)
            parts.append(f'<line class="a-grid" x1="{self.left}" x2="{self.right}" y1="{y:.1f}" y2="{y:.1f}"/>')
            parts.append(f'<text class="a-axis" x="{self.left - 6}" y="{y + 4:.1f}" text-anchor="end">{value:g}</text>')
        for value in ticks(*self.x_range):
            parts.append(
                f'<text class="a-axis" x="{self.x(value):.1f}" y="{self.bottom + 16}" text-anchor="middle">{value:g}</text>'
            )
        middle = (self.left + self.right) / 2
        parts.append(
            f'<text class="a-axis" x="{middle}" y="{self.bottom + 31}" text-anchor="middle">{html.escape(x_label)}</text>'
        )
        return "".join(parts)

    def line(self, x: np.ndarray, y: np.ndarray, kind: str) -> str:
        step = max(1, -(-len(x) // MOST_POINTS))
        points = " ".join(f"{self.x(a):.1f},{self.y(b):.1f}" for a, b in zip(x[::step], y[::step], strict=True))
        return f'<polyline class="{kind}" points="{points}"/>'


def witness_svg(found: Witness, whole: int = HALF) -> str:
    """Dots with bands, and the fitted law as a line, in a picture of a width."""
    exponent = _exponent(max(map(abs, found.force)), found.unit)
    scale = 10.0**-exponent
    x, force = np.array(found.x), scale * np.array(found.force)
    band = scale * np.array(found.band) if found.band else np.zeros_like(force)
    law = scale * np.array(found.law) if found.law else None
    seen = [force - band, force + band, *([law] if law is not None else [])]
    low, high = _room(float(min(part.min() for part in seen)), float(max(part.max() for part in seen)))
    axes = _Axes((46, 24, whole - 8, 132), _room(float(x.min()), float(x.max())), (low, high))
    title = f"{_first_capital(found.balance)} ({_unit(found.unit, exponent)})"
    parts = [f'<text class="a-title" x="46" y="13">{html.escape(title)}</text>']
    parts.append(axes.grid(_named(found.coordinate, found.coordinate_unit)))
    if law is not None:
        parts.append(axes.line(x, law, "a-law"))
    for a, b, half in zip(x, force, band, strict=True):
        if half > 0:
            parts.append(
                f'<line class="a-band" x1="{axes.x(a):.1f}" x2="{axes.x(a):.1f}" y1="{axes.y(b - half):.1f}" y2="{axes.y(b + half):.1f}"/>'
            )
        parts.append(f'<circle class="a-dot" cx="{axes.x(a):.1f}" cy="{axes.y(b):.1f}" r="3.5"/>')
    words = f"{title} over {found.coordinate}: {len(x)} dots" + (", with the fitted law as a line" if found.law else "")
    return _svg(whole, 168, words, parts)


def bars_svg(bars: Sequence[Bar], narrow: bool = False) -> str:
    """Errors as multiples of the noise, on a linear scale from 0; in a `narrow` picture labels stand above the bars."""
    longest = max((bar.value for bar in bars if math.isfinite(bar.value)), default=1.0)
    left, row, above = (0, 42, 18) if narrow else (196, 34, 0)
    parts = []
    for place, bar in enumerate(bars):
        y = 4 + row * place
        width = max(1.5, LONGEST * min(bar.value / longest, 1.0)) if math.isfinite(bar.value) else LONGEST
        label = bar.label if len(bar.label) <= 30 else f"{bar.label[:29]}…"
        at = f'x="0" y="{y + 12}"' if narrow else f'x="{left - 8}" y="{y + 15}" text-anchor="end"'
        parts.append(f'<text class="a-axis" {at}>{html.escape(label)}</text>')
        parts.append(f'<rect class="a-{bar.kind}" x="{left}" y="{y + above}" width="{width:.1f}" height="20"/>')
        parts.append(
            f'<text class="a-title" x="{left + width + 6:.1f}" y="{y + above + 15}">{"1" if bar.kind == "floor" else digits(bar.value)} ×</text>'
        )
    words = "Error on held-out trials: " + ", ".join(f"{bar.label} {digits(bar.value)} times the noise" for bar in bars)
    return _svg(NARROW if narrow else WIDE, row * len(bars), words, parts)


def residual_svg(found: Residual, narrow: bool = False) -> str:
    """Before and after on one axis, with the noise as a grey band."""
    exponent = _exponent(float(np.abs(found.before).max()), found.unit)
    scale = 10.0**-exponent
    before, noise = scale * found.before, 2 * scale * found.noise
    after = None if found.after is None else scale * found.after
    whole = NARROW if narrow else WIDE
    # The range is that of the model as given: what improves is seen to shrink.
    axes = _Axes(
        (46, 24, whole - 8, 146),
        (float(found.time[0]), float(found.time[-1])),
        _room(min(float(before.min()), -noise), max(float(before.max()), noise)),
    )
    unit = _unit(found.unit, exponent)
    start, most = (0, MOST_TITLE_NARROW) if narrow else (46, MOST_TITLE)
    room = max(9, most - len(f"Error of {found.signal},  ({unit}): before, after"))
    title = f"Error of {found.signal}, {_short(found.trial, room)} ({unit}):"
    legend = f'<tspan class="a-ink-given"> {"as given" if after is None else "before"}</tspan>'
    legend += ', <tspan class="a-ink-after">after</tspan>' if after is not None else ""
    parts = [f'<text class="a-title" x="{start}" y="13">{html.escape(title)}{legend}</text>']
    parts.append(axes.grid("time (s)"))
    top, bottom = axes.y(noise), axes.y(-noise)
    parts.append(
        f'<rect class="a-noise" x="{axes.left}" width="{axes.right - axes.left}" y="{top:.1f}" height="{max(bottom - top, 1):.1f}"/>'
    )
    parts.append(axes.line(found.time, before, "a-before"))
    if after is not None:
        parts.append(axes.line(found.time, np.clip(after, *axes.y_range), "a-after"))
    words = f"Error of {found.signal} along {found.trial}: rms {np.sqrt(np.mean(before**2)):.3g} as given"
    words += f", {np.sqrt(np.mean(after**2)):.3g} with the effect" if after is not None else ""
    return _svg(whole, 182, f"{words} ({_unit(found.unit, exponent)})", parts)


def _svg(width: int, height: int, words: str, parts: Sequence[str]) -> str:
    label = html.escape(words, quote=True)
    return f'<svg class="a-svg" role="img" aria-label="{label}" viewBox="0 0 {width} {height}">{"".join(parts)}</svg>'


def _room(low: float, high: float) -> tuple[float, float]:
    """Limits with a little room; zero is in sight where the values are near it."""
    span = high - low or abs(high) or 1.0
    return low - 0.06 * span, high + 0.06 * span


def _exponent(value: float, unit: str) -> int:
    """Power of ten that leaves numbers short enough for the room beside an axis."""
    return engineering_exponent(value) if takes_prefix(unit) or not 0.1 <= value < 1e5 else 0


def _unit(unit: str, exponent: int) -> str:
    if takes_prefix(unit) or not exponent:
        return unit_text(prefixed(unit, exponent)) or "no unit"
    return f"10{str(exponent).translate(_RAISED)} {unit_text(unit)}".rstrip().replace(" 1/", "/")


def _short(name: str, most: int) -> str:
    """A trial's name without its ending, shortened in its middle."""
    bare = re.sub(r"\.(csv|parquet|mf4)\b", "", name)
    behind = (most - 1) // 2
    return bare if len(bare) <= most else f"{bare[: most - 1 - behind]}…{bare[-behind:]}"


def _named(name: str, unit: str) -> str:
    shown = unit_text(unit)
    return f"{name} ({shown})" if shown else name


def _first_capital(text: str) -> str:
    return text[:1].upper() + text[1:]
