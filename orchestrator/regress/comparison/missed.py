"""What the reference does between two samples of the result, which a look at the result's samples alone cannot see."""

import numpy as np

from orchestrator.regress.comparison.envelope import values_at, window_range
from orchestrator.regress.comparison.jumps import SHORT_STEP, bends
from orchestrator.regress.comparison.prepare import Pair
from orchestrator.regress.comparison.signal import Signal


def missed(pair: Pair) -> tuple[np.ndarray, np.ndarray]:
    """Return the indices of reference samples that the result, between its own samples, cannot have followed.

    With them comes by how much the result missed each, in the signal's unit, before any tolerance. A result may leave
    the line between two samples by what its curve bends there, and it may have been anywhere between the two; when it
    holds its values, only within a short step. A pulse that begins and ends between two samples is outside that.
    """
    result, reference, limit = pair.result, pair.reference, pair.band.limit
    if pair.same_grid:
        return np.zeros(0, dtype=int), np.zeros(0)
    inside = (reference.time >= result.time[0]) & (reference.time <= result.time[-1])
    found = values_at(result.time, result.values, reference.time, result.interpolation)
    allowed = limit + pair.band.local * np.abs(reference.values)
    far = np.flatnonzero(inside & ~(np.abs(found - reference.values) <= allowed))
    if not len(far):
        return far, np.zeros(0)
    low, high = _reach(result, reference.time[far], pair.band.half_width)
    amount = np.maximum(reference.values[far] - high, low - reference.values[far])
    lost = ~(amount <= allowed[far])
    return far[lost], amount[lost]


def _reach(result: Signal, time: np.ndarray, shift: float) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest value that the result may have had around each time, shape (m,) each."""
    low, high = window_range(
        result.time, result.values, result.values, time - shift, time + shift, result.interpolation
    )
    bent = bends(result.values)
    linear = result.interpolation == "linear"
    longest = np.inf if linear else SHORT_STEP * (result.time[-1] - result.time[0])
    # A time that is a stamp of the result touches the steps on both sides of it.
    for side in ("left", "right"):
        other = np.clip(np.searchsorted(result.time, time, side), 1, len(result.time) - 1)
        one = other - 1
        short = result.time[other] - result.time[one] <= longest
        bend = np.maximum(bent[one], bent[other]) if linear else 0.0
        ends = result.values[one], result.values[other]
        low = np.where(short, np.minimum(low, np.minimum(*ends) - bend), low)
        high = np.where(short, np.maximum(high, np.maximum(*ends) + bend), high)
    return low, high
