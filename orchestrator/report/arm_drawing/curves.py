"""Curves over time as SVG, with a time mark that a replay moves: one panel for each quantity."""

import html
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from orchestrator.report.numbers import digits, ticks
from orchestrator.report.palette import SURFACES, Colour
from orchestrator.report.thinning import extremes

MOST_POINTS = 700
WIDTH, HEIGHT, LEFT, RIGHT, ABOVE, BELOW = 620, 150, 62, 8, 22, 20


@dataclass(frozen=True, eq=False)
class Line:
    """One curve (n,), with its 1.645-fold standard deviation as a band where there is one."""

    name: str
    colour: str
    values: np.ndarray
    std: np.ndarray | None = None
    dashed: bool = False


@dataclass(frozen=True, eq=False)
class Panel:
    """Curves of one quantity over the same time."""

    quantity: str
    unit: str
    lines: tuple[Line, ...]


def curves_svg(time: np.ndarray, panels: Sequence[Panel], mark: float | None = None) -> str:
    """Return an `<svg>` element with the panels below one another; a line of class `now` marks the time `mark` in s.

    Attributes `data-left` and `data-right` are the places of the first and the last moment.
    """
    height = HEIGHT * len(panels) + BELOW
    parts = [_panel(time, panel, HEIGHT * k) for k, panel in enumerate(panels)]
    shown = ", ".join(html.escape(panel.quantity) for panel in panels)
    begin, end = digits(float(time[0])), digits(float(time[-1]))
    place = 0.0 if mark is None else _Frame(time, 0.0, 1.0, 0).x(mark)
    line = f'<line class="now" x1="{place:.1f}" x2="{place:.1f}" y1="{ABOVE}" y2="{HEIGHT * len(panels)}" stroke="{Colour.INK}" stroke-width="1.5"/>'
    return (
        f'<svg class="curves" xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" role="img" font-size="12"'
        f' data-left="{LEFT}" data-right="{WIDTH - RIGHT}" aria-label="{shown} over time from {begin} to {end} s">'
        f"{''.join(parts)}{_time_axis(time, height)}{'' if mark is None else line}</svg>"
    )


def _panel(time: np.ndarray, panel: Panel, top: int) -> str:
    ends = [np.concatenate([line.values - _half(line), line.values + _half(line)]) for line in panel.lines]
    values = np.concatenate(ends)
    values = values[np.isfinite(values)]
    low, high = (float(values.min()), float(values.max())) if values.size else (0.0, 1.0)
    spare = 0.05 * (high - low) or 0.5
    low, high = low - spare, high + spare
    frame = _Frame(time, low, high, top)
    unit = f" ({html.escape(panel.unit)})" if panel.unit not in ("", "1") else ""
    text = f'<text x="{LEFT}" y="{top + 14}" font-weight="600" fill="{Colour.INK}">{html.escape(panel.quantity)}{unit}</text>'
    return text + _legend(panel, top) + _grid(frame) + "".join(frame.drawn(line) for line in panel.lines)


def _legend(panel: Panel, top: int) -> str:
    if [line.name for line in panel.lines] == [panel.quantity]:
        return ""
    names = [
        f'<tspan fill="{line.colour}">{"╌" if line.dashed else "—"} {html.escape(line.name)}{"  " * (line is not panel.lines[-1])}</tspan>'
        for line in panel.lines
    ]
    return f'<text x="{WIDTH - RIGHT}" y="{top + 14}" text-anchor="end" xml:space="preserve">{"".join(names)}</text>'


def _grid(frame: "_Frame") -> str:
    found = []
    for value in ticks(frame.low, frame.high):
        y = frame.y(value)
        found.append(f'<line x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y:.1f}" y2="{y:.1f}" stroke="{SURFACES["rule"]}"/>')
        found.append(f'<text x="{LEFT - 5}" y="{y + 4:.1f}" text-anchor="end" fill="{Colour.QUIET}">{value:g}</text>')
    return "".join(found)


def _time_axis(time: np.ndarray, height: int) -> str:
    frame = _Frame(time, 0.0, 1.0, 0)
    shown = "".join(
        f'<text x="{frame.x(value):.1f}" y="{height - 6}" text-anchor="middle" fill="{Colour.QUIET}">{value:g}</text>'
        for value in ticks(float(time[0]), float(time[-1]), 8)
    )
    return f'{shown}<text x="4" y="{height - 6}" fill="{Colour.QUIET}">time (s)</text>'


def _half(line: Line) -> np.ndarray:
    return np.zeros(len(line.values)) if line.std is None else 1.645 * line.std


@dataclass(frozen=True, eq=False)
class _Frame:
    """Places of values of one panel in the picture."""

    time: np.ndarray
    low: float
    high: float
    top: int

    def x(self, t: float) -> float:
        span = float(self.time[-1] - self.time[0]) or 1.0
        return LEFT + (WIDTH - LEFT - RIGHT) * (t - float(self.time[0])) / span

    def y(self, value: float) -> float:
        return self.top + HEIGHT - (HEIGHT - ABOVE) * (value - self.low) / (self.high - self.low)

    def drawn(self, line: Line) -> str:
        keep = extremes(line.values, MOST_POINTS)
        points = [(self.x(self.time[k]), self.y(line.values[k])) for k in keep if np.isfinite(line.values[k])]
        dash = ' stroke-dasharray="7 4"' if line.dashed else ""
        curve = (
            f'<path d="M{_path(points)}" fill="none" stroke="{line.colour}" stroke-width="1.6"{dash}/>'
            if points
            else ""
        )
        return self._band(line, keep) + curve

    def _band(self, line: Line, keep: np.ndarray) -> str:
        if line.std is None:
            return ""
        upper, lower = line.values + _half(line), line.values - _half(line)
        around = [(self.x(self.time[k]), self.y(upper[k])) for k in keep]
        around += [(self.x(self.time[k]), self.y(lower[k])) for k in keep[::-1]]
        return f'<path d="M{_path(around)} Z" fill="{line.colour}" opacity="0.2"/>'


def _path(points: Sequence[tuple[float, float]]) -> str:
    return " ".join(f"{x:.1f} {y:.1f}" for x, y in points)
