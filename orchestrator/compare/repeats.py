"""Noise from repeats: two trials with the same inputs differ by the noise of both."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from orchestrator.measurements import BoundSet, BoundTrial

# Inputs are the same if they differ by their noise and this share of their range.
SAME = 0.01
# Clocks of two trials may begin this many samples apart.
LATEST = 5


def noise_of_repeats(data: BoundSet, trials: Sequence[BoundTrial]) -> dict[str, float]:
    """Root of half the mean square difference of repeated trials, by output, in its unit.

    Repeats are trials along which the same inputs move; they are aligned to the sample at which their inputs agree best.
    A straight line is taken out of each difference, since trials never begin at quite the same place and speed.

    Returns:
        Nothing if no two trials are repeats.
    """
    squares = []
    for one, other in combinations(trials, 2):
        lag = _lag(data, one, other)
        if lag is not None:
            first, second = _overlap(one.outputs, other.outputs, lag)
            time = np.linspace(-1.0, 1.0, len(first))
            line = np.column_stack([np.ones_like(time), time])
            change = first - second
            left = change - line @ np.linalg.lstsq(line, change, rcond=None)[0]
            squares.append(0.5 * np.sum(left**2, axis=0) / max(len(left) - 2, 1))
    if not squares:
        return {}
    return dict(zip(data.output_names, np.sqrt(np.mean(squares, axis=0)).tolist(), strict=True))


def _lag(data: BoundSet, one: BoundTrial, other: BoundTrial) -> int | None:
    """By how many samples the other trial is late; None if it is no repeat."""
    steps = [float(np.median(np.diff(t.time))) for t in (one, other)]
    moving = np.ptp(one.inputs, axis=0) > 0
    if not moving.any() or abs(steps[0] / steps[1] - 1) > 1e-3 or min(len(one.time), len(other.time)) < 4 * LATEST:
        return None
    noise = np.array([data.noise_std.get(name, 0.0) for name in data.input_names])
    allowed = 2.0 * noise + SAME * np.ptp(one.inputs, axis=0)
    found: list[tuple[float, int]] = []
    for lag in range(-LATEST, LATEST + 1):
        first, second = _overlap(one.inputs, other.inputs, lag)
        off = np.sqrt(np.mean((first - second) ** 2, axis=0))
        if len(first) > 0.8 * max(len(one.time), len(other.time)) and np.all(off <= allowed):
            found.append((float(np.max(off[moving] / allowed[moving])), lag))
    return min(found, key=lambda entry: (entry[0], abs(entry[1])))[1] if found else None


def _overlap(first: np.ndarray, second: np.ndarray, lag: int) -> tuple[np.ndarray, np.ndarray]:
    """The rows that two series have in common if the second is `lag` samples late."""
    first, second = first[max(-lag, 0) :], second[max(lag, 0) :]
    count = min(len(first), len(second))
    return first[:count], second[:count]
