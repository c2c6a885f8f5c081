"""What the reference does between two samples of the result, which a look at the result's samples alone cannot see."""

import numpy as np

from orchestrator.regress.comparison.envelope import values_at
from orchestrator.regress.comparison.extremes import range_extremes
from orchestrator.regress.comparison.prepare import Pair


def missed(pair: Pair) -> tuple[np.ndarray, np.ndarray]:
    """Return the indices of reference samples that the result, between its own samples, cannot have followed.

    With them comes by how much the result missed each, in the signal's unit, before any tolerance.

    Between two samples a result may have been anywhere between their values, and beyond them by what its curve bends
    there. A pulse that begins and ends between two samples is outside that.
    """
    result, reference, limit = pair.result, pair.reference, pair.band.limit
    if pair.same_grid:
        return np.zeros(0, dtype=int), np.zeros(0)
    inside = (reference.time >= result.time[0]) & (reference.time <= result.time[-1])
    found = values_at(result.time, result.values, reference.time, reference.interpolation)
    allowed = limit + pair.band.local * np.abs(reference.values)
    far = np.flatnonzero(inside & ~(np.abs(found - reference.values) <= allowed))
    if not len(far):
        return far, np.zeros(0)
    time = reference.time[far]
    first = np.searchsorted(result.time, time - pair.band.half_width, "right") - 1
    stop = np.searchsorted(result.time, time + pair.band.half_width, "left") + 1
    first, stop = np.clip(first, 0, None), np.clip(stop, None, len(result.time))
    low, high = range_extremes(result.values, result.values, first, stop)
    amount = np.maximum(reference.values[far] - high, low - reference.values[far])
    lost = np.flatnonzero(~(amount <= allowed[far]))
    bends = _bends(result.values)
    amount = amount[lost] - range_extremes(bends, bends, first[lost], stop[lost])[1]
    far = far[lost]
    lost = ~(amount <= allowed[far])
    return far[lost], amount[lost]


def _bends(values: np.ndarray) -> np.ndarray:
    """Twice what a smooth curve through samples leaves the straight line by between them, at each sample, shape (n,)."""
    bends = np.zeros(len(values))
    if len(values) > 2:
        # A parabola through three samples leaves the chord by an eighth of their second difference.
        bends[1:-1] = np.abs(values[:-2] - 2 * values[1:-1] + values[2:]) / 4
    return bends
