"""Pictures of a session as SVG; each says in words what it shows."""

import math
from collections.abc import Sequence
from html import escape

import numpy as np

from hil.bench_view.residual_map import CELLS
from hil.bench_view.watched import PAST_S, Past
from hil.view.glance import Glance
from hil.view.layout import EDGES
from orchestrator.report.numbers import digits
from orchestrator.report.palette import SURFACES, Colour

# Least range of the residual's scale, N.m, so that noise does not look like a finding.
LEAST_TORQUE = 0.1
# A normal error lies within so many standard deviations with a probability of 90 %.
Z90 = 1.645
_EMPTY = SURFACES["rule"]


def histogram(glance: Glance) -> str:
    """Cycles by how late they began; the bars' heights go with the logarithm, so that single late cycles are seen."""
    width, height, base = 460, 130, 104
    counts, total = glance.lateness, max(sum(glance.lateness), 1)
    step = (width - 20) / len(counts)
    top = math.log10(total + 1)
    bars = []
    for k, count in enumerate(counts):
        if count:
            tall = 92 * math.log10(count + 1) / top
            colour = Colour.IMPROVED if k < len(EDGES) and EDGES[k] * 1e3 < glance.period_ns / 2 else Colour.BAD
            bars.append(
                f'<rect x="{10 + k * step:.1f}" y="{base - tall:.1f}" width="{step - 1:.1f}" height="{tall:.1f}" fill="{colour}"/>'
            )
    marks = [
        f'<text x="{10 + (10 * k) * step:.1f}" y="120" font-size="12" fill="{Colour.INK}">{words}</text>'
        for k, words in enumerate(("1 µs", "10 µs", "100 µs", "1 ms", "10 ms"))
    ]
    alt = (
        f"Histogram of how late {total} cycles began: half within {micro(glance.late_us(0.5))},"
        f" 99 % within {micro(glance.late_us(0.99))}, the latest {micro(glance.latest_us)}"
    )
    line = f'<line x1="10" x2="{width - 10}" y1="{base}" y2="{base}" stroke="{SURFACES["rule-strong"]}"/>'
    return _svg(width, height, alt, [*bars, line, *marks])


def micro(microseconds: float) -> str:
    """A time in us as people read it.

    Example:
        >>> micro(63.0), micro(2500.0)
        ('63.0 µs', '2.50 ms')
    """
    return f"{digits(microseconds)} µs" if microseconds < 1000 else f"{digits(microseconds * 1e-3)} ms"


def residual_map(
    means: np.ndarray, joint: int, low: Sequence[float], high: Sequence[float], now: np.ndarray | None
) -> str:
    """The map (cells, cells) of one joint's residual in N.m, shoulder to the right, elbow upwards; a ring where the arm is."""
    left, size = 44, 200
    step = size / CELLS
    scale = max(float(np.nanmax(np.abs(means))) if np.isfinite(means).any() else 0.0, LEAST_TORQUE)
    parts = [
        f'<rect x="{left}" y="6" width="{size}" height="{size}" fill="{_EMPTY}" stroke="{SURFACES["rule-strong"]}"/>'
    ]
    for i, j in np.argwhere(np.isfinite(means)):
        x, y = left + i * step, 6 + size - (j + 1) * step
        colour = diverging(float(means[i, j]) / scale)
        parts.append(
            f'<rect x="{x:.1f}" y="{y:.1f}" width="{step + 0.3:.1f}" height="{step + 0.3:.1f}" fill="{colour}"/>'
        )
    where = ""
    if now is not None:
        share = np.clip((now - np.array(low)) / (np.array(high) - np.array(low)), 0.0, 1.0)
        x, y = left + share[0] * size, 6 + (1 - share[1]) * size
        parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="6" fill="none" stroke="{Colour.INK}" stroke-width="2.5"/>')
        where = f"; the arm is at {now[0]:.2f} and {now[1]:.2f} rad"
    parts += _axes(left, size, low, high)
    parts += _scale(left + size + 14, size, scale)
    seen = int(np.isfinite(means).sum())
    alt = f"Residual torque of joint {joint} over shoulder and elbow angle: {seen} of {CELLS * CELLS} cells seen lately, at most {digits(scale)} N.m{where}"
    return _svg(left + size + 80, size + 44, alt, parts)


def _axes(left: float, size: float, low: Sequence[float], high: Sequence[float]) -> list[str]:
    bottom = size + 22
    said = [
        (left, bottom, "start", f"{low[0]:.1f}"),
        (left + size / 2, bottom + 14, "middle", "shoulder (rad)"),
        (left + size, bottom, "end", f"{high[0]:.1f}"),
        (left - 5, size + 6, "end", f"{low[1]:.1f}"),
        (left - 5, 16, "end", f"{high[1]:.1f}"),
    ]
    upright = f'<text transform="translate(14 {6 + size / 2}) rotate(-90)" text-anchor="middle" font-size="12" fill="{Colour.INK}">elbow (rad)</text>'
    return [_text(*each) for each in said] + [upright]


def _scale(x: float, size: float, scale: float) -> list[str]:
    steps = 20
    parts = [
        f'<rect x="{x}" y="{6 + k * size / steps:.1f}" width="12" height="{size / steps + 0.3:.1f}" fill="{diverging(1 - 2 * (k + 0.5) / steps)}"/>'
        for k in range(steps)
    ]
    said = [(16, f"+{digits(scale)}"), (6 + size / 2 + 4, "0"), (size + 6, f"-{digits(scale)}")]
    return parts + [_text(x + 16, y, "start", words) for y, words in said]


def diverging(share: float) -> str:
    """A colour from -1 to 1: blue, white, orange.

    Example:
        >>> diverging(0.0), diverging(-1.0) == "#0072b2"
        ('#ffffff', True)
    """
    end = Colour.MODEL if share > 0 else Colour.IMPROVED
    part = min(abs(share), 1.0)
    mixed = (round(255 + part * (int(end[k : k + 2], 16) - 255)) for k in (1, 3, 5))
    return "#" + "".join(f"{value:02x}" for value in mixed)


def traces(past: Sequence[Past], joint: int) -> str:
    """The last seconds of one joint: the residual, what was learned of it, and its 90 % interval as a band."""
    width, height, left = 460, 120, 52
    past = [each for each in past if past[-1].time_s - each.time_s <= PAST_S]
    if len(past) < 2:
        return _svg(width, height, f"No residual of joint {joint} yet", [_text(left, 60, "start", "no residual yet")])
    times = np.array([each.time_s for each in past])
    residual = np.array([each.residual[joint - 1] for each in past])
    learned = np.array([each.learned[joint - 1] for each in past])
    band = Z90 * np.array([each.unsure for each in past])
    most = max(float(np.max(np.abs(residual))), float(np.max(np.abs(learned))), LEAST_TORQUE)
    x = left + (width - left - 10) * (1.0 - (times[-1] - times) / PAST_S)

    def y(values: np.ndarray) -> np.ndarray:
        return np.asarray(55.0 - 48.0 * np.clip(values / most, -1.0, 1.0))

    outline = [*zip(x, y(learned + band), strict=True), *reversed([*zip(x, y(learned - band), strict=True)])]
    parts = [
        f'<polygon points="{_points(outline)}" fill="{Colour.IMPROVED}" fill-opacity="0.18"/>',
        f'<line x1="{left}" x2="{width - 10}" y1="55" y2="55" stroke="{SURFACES["rule-strong"]}"/>',
        _line(x, y(residual), Colour.RESIDUAL, ""),
        _line(x, y(learned), Colour.IMPROVED, "6 3"),
        _text(left - 6, 14, "end", f"+{digits(most)}"),
        _text(left - 6, 59, "end", "0"),
        _text(left - 6, 106, "end", f"-{digits(most)}"),
        _text(left, 117, "start", f"{PAST_S:.0f} s ago"),
        _text(width - 10, 117, "end", "now"),
    ]
    alt = f"Joint {joint}, last {PAST_S:.0f} s: residual now {digits(residual[-1])} N.m, learned {digits(learned[-1])} N.m, ± {digits(band[-1])} N.m (90 %)"
    return _svg(width, height, alt, parts)


def _line(x: np.ndarray, y: np.ndarray, colour: str, dashes: str) -> str:
    pattern = f' stroke-dasharray="{dashes}"' if dashes else ""
    points = _points([*zip(x, y, strict=True)])
    return f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="1.8"{pattern}/>'


def _points(pairs: Sequence[tuple[float, float]]) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in pairs)


def _text(x: float, y: float, anchor: str, words: str) -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" font-size="12" fill="{Colour.INK}">{escape(words)}</text>'


def _svg(width: float, height: float, alt: str, parts: Sequence[str]) -> str:
    return (
        f'<svg role="img" aria-label="{escape(alt)}" viewBox="0 0 {width:g} {height:g}" width="{width:g}" height="{height:g}"'
        f' font-family="system-ui, sans-serif">{"".join(parts)}</svg>'
    )
