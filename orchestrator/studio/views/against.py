"""The error in bins of one coordinate and in bands of frequency: all learning trials, and the selected samples."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import signal as signals

from orchestrator.report.numbers import digits, quantity
from orchestrator.studio.views.chosen import Chosen
from orchestrator.studio.views.coordinates import Coordinates
from orchestrator.studio.views.data import ViewData
from orchestrator.studio.views.sums import NOTHING, moments

FREQUENCY = "frequency"
# Samples of a window of the spectrum, as in the comparison.
LONGEST = 1024
SHORTEST = 16


@dataclass(frozen=True)
class Bar:
    """The rms residual where the coordinate is `low` to `high`.

    `rms` is that of the comparison; `selected` that of the selected samples, None where there are none.
    """

    low: float
    high: float
    rms: float
    selected: float | None = None


@dataclass(frozen=True)
class Bars:
    """Bars over one coordinate, or over frequency in Hz."""

    signal: str
    against: str
    unit: str
    bars: tuple[Bar, ...]

    def sentence(self, unit: str, floor: float) -> str:
        """Where the error is largest."""
        if not self.bars:
            return f"The comparison has no map of {self.signal} over {self.against}: it does not vary, or there are too few samples."
        worst = max(self.bars, key=lambda bar: bar.rms)
        times = f", {digits(worst.rms / floor)} times the noise floor" if floor else ""
        text = f"The residual of {self.signal} is largest, {quantity(worst.rms, unit)} rms{times}, where {self.against} is {self.place(worst)}"
        known = [bar for bar in self.bars if bar.selected is not None]
        if known:
            most = max(known, key=lambda bar: bar.selected or 0.0)
            text += f"; of the selected samples, {quantity(most.selected or 0.0, unit)}, where it is {self.place(most)}"
        return f"{text}."

    def place(self, bar: Bar) -> str:
        """The range of a bar in words."""
        return f"{digits(bar.low)} to {digits(bar.high)} {self.unit}".rstrip()


def offered(data: ViewData, signal: str) -> tuple[str, ...]:
    """Coordinates for which the comparison has a map of the signal's error, the strongest dependence first."""
    strength = {str(row["against"]): float(row["strength"]) for row in data.against if row["signal"] == signal}
    return tuple(sorted(strength, key=lambda name: -strength[name]))


def bars_against(coordinates: Coordinates, signal: str, against: str, chosen: Mapping[int, Chosen] | None) -> Bars:
    """Error in the comparison's bins of a coordinate; `chosen` are the selected samples, None for no selection."""
    rows = [row for row in coordinates.data.against if (row["signal"], row["against"]) == (signal, against)]
    found = [Bar(row["from"], row["to"], row["rmse"]) for row in rows]
    unit = str(rows[0]["unit"]) if rows else ""
    if chosen is None or not rows:
        return Bars(signal, against, unit, tuple(found))
    edges = np.array([rows[0]["from"], *(row["to"] for row in rows)])
    return _with_selected(
        Bars(signal, against, unit, tuple(found)), _binned(coordinates, signal, against, edges, chosen)
    )


def bars_of_frequency(data: ViewData, signal: str, chosen: Mapping[int, Chosen] | None) -> Bars:
    """Error in the comparison's octaves; selected are the parts of trials in one piece, long enough for a spectrum."""
    rows = [row for row in data.frequency if row["signal"] == signal]
    found = Bars(
        signal,
        FREQUENCY,
        "Hz",
        tuple(Bar(row["from_hz"], row["to_hz"], row["rmse"]) for row in rows),
    )
    if chosen is None or not rows:
        return found
    return _with_selected(found, _octaves(data, signal, rows, chosen))


def _with_selected(bars: Bars, selected: Sequence[float | None]) -> Bars:
    marked = tuple(replace(bar, selected=value) for bar, value in zip(bars.bars, selected, strict=True))
    return Bars(bars.signal, bars.against, bars.unit, marked)


def _binned(
    coordinates: Coordinates, signal: str, against: str, edges: np.ndarray, chosen: Mapping[int, Chosen]
) -> list[float | None]:
    totals = [NOTHING] * (len(edges) - 1)
    for place, samples in chosen.items():
        trial = coordinates.data.trials[place]
        mask = samples.mask(len(trial.time))[:: coordinates.stride]
        residual, values = coordinates.residual(signal)[place][mask], coordinates.values(against)[place][mask]
        at = np.searchsorted(edges.astype(np.float32), values, side="right") - 1
        at = np.clip(at, 0, len(edges) - 2)
        totals = [total + moments(residual[at == k]) for k, total in enumerate(totals)]
    return [total.rms if total.count else None for total in totals]


def _octaves(
    data: ViewData, signal: str, rows: Sequence[Mapping[str, Any]], chosen: Mapping[int, Chosen]
) -> list[float | None]:
    """Root of the power of Welch's spectrum in each band, averaged by length over pieces that resolve the band."""
    pieces = [
        (data.trials[place].time, data.trials[place].signals[signal].residual.series, start, stop)
        for place, samples in chosen.items()
        for start, stop in samples
        if stop - start >= SHORTEST
    ]
    power, weight = np.zeros(len(rows)), np.zeros(len(rows))
    for time, residual, start, stop in pieces:
        step = float(time[stop - 1] - time[start]) / (stop - start - 1)
        part = np.nan_to_num(np.asarray(residual[start:stop], float))
        frequency, density = signals.welch(part, 1 / step, nperseg=min(len(part), LONGEST), detrend="constant")
        # Bounds are frequencies of the comparison's spectrum, so rounding must not decide on which side one falls.
        band = np.searchsorted([row["from_hz"] for row in rows], frequency * (1 + 1e-9), side="right") - 1
        # A short piece has nothing to say on what is slower than itself.
        resolved = (frequency > 0) | (len(part) >= LONGEST)
        for k in range(len(rows)):
            inside = (band == k) & resolved
            if inside.any():
                power[k] += len(part) * density[inside].sum() * (frequency[1] - frequency[0])
                weight[k] += len(part)
    return [float(np.sqrt(p / w)) if w else None for p, w in zip(power, weight, strict=True)]
