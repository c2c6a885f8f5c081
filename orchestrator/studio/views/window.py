"""The part of the curves that is in sight: at most so many points, whatever the length of the trials."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from orchestrator.studio.views.chosen import NONE, Chosen
from orchestrator.studio.views.data import ViewData, ViewTrial
from orchestrator.studio.views.pyramid import Blocks
from orchestrator.studio.views.selection import Range

# Points that one picture holds altogether: what a browser without a graphics card still draws at some 60 per second.
MOST_POINTS = 48_000
LINES_PER_TRIAL = 3
# Two standard deviations hold 95 % of noise of this size.
BAND = 2


@dataclass(frozen=True, eq=False)
class TrialWindow:
    """Points of one trial, each array (m,): `time` in s from the begin of the window, signals in their unit.

    If it is `paired`, points are the smallest and the largest value of a block of samples in turn, else they are the
    samples. `chosen` tells which points hold selected samples.
    """

    place: int
    paired: bool
    time: np.ndarray
    measured: np.ndarray
    modelled: np.ndarray
    residual: np.ndarray
    chosen: np.ndarray


@dataclass(frozen=True, eq=False)
class CurveWindow:
    """Curves of one signal within a range of time, and the smallest and largest values in it."""

    signal: str
    time: Range
    trials: tuple[TrialWindow, ...]
    values: Range
    residuals: Range

    @property
    def points(self) -> int:
        """Number of points of all lines."""
        return sum(LINES_PER_TRIAL * len(trial.time) for trial in self.trials)


def curve_window(
    data: ViewData,
    signal: str,
    trials: Sequence[int],
    time: Range,
    columns: int,
    chosen: Mapping[int, Chosen] | None = None,
) -> CurveWindow:
    """Reduce what is within `time` to extremes in at most `columns` blocks a trial, fewer if there are many trials.

    `chosen` are the selected samples of trials by place; trials that are not in it have none.
    """
    most = max(2, min(columns, MOST_POINTS // (2 * LINES_PER_TRIAL * max(1, len(trials)))))
    parts = [_trial(data.trials[k], k, signal, time, most, (chosen or {}).get(k, NONE)) for k in trials]
    floor = BAND * data.noise_floor[signal]
    values = [part for w in parts for part in (w.measured, w.modelled)]
    residuals = [*(w.residual for w in parts), np.array([-floor, floor])]
    return CurveWindow(signal, time, tuple(parts), _limits(values), _limits(residuals))


def packed(window: CurveWindow) -> bytes:
    """The window as the browser reads it, little-endian: length of a header (uint32), the header as JSON, padded, then for
    each trial `time`, `measured`, `modelled`, `residual` as float32, and `chosen` as bytes, padded to four."""
    head = {
        "from": window.time.low,
        "values": [window.values.low, window.values.high],
        "residuals": [window.residuals.low, window.residuals.high],
        "trials": [{"place": trial.place, "paired": trial.paired, "count": len(trial.time)} for trial in window.trials],
    }
    text = _padded(json.dumps(head).encode(), b" ")
    parts = [len(text).to_bytes(4, "little"), text]
    for trial in window.trials:
        numbers = np.stack([trial.time, trial.measured, trial.modelled, trial.residual])
        parts += [numbers.astype("<f4").tobytes(), _padded(trial.chosen.astype("u1").tobytes(), b"\0")]
    return b"".join(parts)


def _padded(content: bytes, filler: bytes) -> bytes:
    return content + filler * (-len(content) % 4)


def _trial(trial: ViewTrial, place: int, signal: str, time: Range, most: int, chosen: Chosen) -> TrialWindow:
    start, stop = trial.samples(time)
    found = trial.signals[signal]
    # One sample beyond either end, so that lines reach the edges of the picture.
    blocks = [series.blocks(start - 1, stop + 1, most) for series in (found.measured, found.modelled, found.residual)]
    bounds = np.minimum(blocks[0].bounds, len(trial.time))
    raw = blocks[0].size == 1
    # Both extremes stand in the middle of their block, so that rising and falling lines look alike.
    at = bounds[:-1] if raw else np.repeat((bounds[:-1] + bounds[1:]) // 2, 2)
    flags = chosen.touches(bounds)
    measured, modelled, residual = (_points(part, raw) for part in blocks)
    chosen_points = flags if raw else np.repeat(flags, 2)
    return TrialWindow(place, not raw, trial.time[at] - time.low, measured, modelled, residual, chosen_points)


def _points(blocks: Blocks, raw: bool) -> np.ndarray:
    return blocks.low if raw else np.stack([blocks.low, blocks.high], axis=1).ravel()


def _limits(parts: Sequence[np.ndarray]) -> Range:
    """Smallest and largest finite value; a range around zero if there is none, and never an empty one."""
    lows = [float(np.nanmin(part)) for part in parts if np.isfinite(part).any()]
    highs = [float(np.nanmax(part)) for part in parts if np.isfinite(part).any()]
    low, high = (min(lows), max(highs)) if lows else (-1.0, 1.0)
    return Range(low, high) if low < high else Range(low - 1.0, high + 1.0)
