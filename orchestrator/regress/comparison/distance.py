"""How far each sample of a result is from what the reference allows."""

import numpy as np

from orchestrator.regress.comparison.envelope import values_at, window_range
from orchestrator.regress.comparison.jumps import SHORT_STEP, sampled_jumps
from orchestrator.regress.comparison.prepare import Pair
from orchestrator.regress.comparison.signal import Signal

# Interpolating between samples rounds by a few units in the last place.
_ROUNDING = 8 * np.finfo(float).eps


def distances(pair: Pair, half_height: np.ndarray | float | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Return each result sample's distance from the reference within the time shift, and which are too far.

    The distance is how far the sample lies outside [min, max] of the reference, widened by its local tolerance, over
    [t - shift, t + shift]. Almost all samples of a good result are near the reference at their own time; only for
    the others the exact window is looked up, and they alone have the exact (smaller) distance.

    Args:
        pair: what to compare, n result samples.
        half_height: shape (n,) or one number, to be used instead of the band's.

    Returns:
        Distances, shape (n,), in the signal's unit; and which exceed the band, shape (n,).
    """
    limit = pair.band.limit if half_height is None else half_height
    result, reference = pair.result, pair.around
    same_grid = pair.same_grid
    expected = (
        reference.values
        if same_grid
        else values_at(reference.time, reference.values, result.time, reference.interpolation)
    )
    distance = result.values - expected
    np.abs(distance, out=distance)
    if pair.band.local:
        distance = np.clip(distance - pair.band.local * np.abs(expected), 0.0, None)
    if not same_grid:
        limit = limit + _ROUNDING * max(abs(reference.values.max()), abs(reference.values.min()))
    # Written so that a NaN would be too far.
    too_far = ~(distance <= limit)
    if too_far.any():
        far = np.flatnonzero(too_far)
        distance[far] = window_distances(pair, far)
        too_far = ~(distance <= limit)
    return distance, too_far


def window_distances(pair: Pair, which: np.ndarray) -> np.ndarray:
    """Return the exact distance of some result samples, shape (m,), from the reference within the time shift."""
    result, reference, shift = pair.result, pair.around, pair.band.half_width
    time, values = result.time[which], result.values[which]
    low = high = reference.values
    if pair.band.local:
        local = pair.band.local * np.abs(reference.values)
        low, high = low - local, high + local
    lowest, highest = window_range(reference.time, low, high, time - shift, time + shift, reference.interpolation)
    if pair.excuses_jumps:
        _widen_at_jumps(reference, time, low, high, lowest, highest)
    distance = np.maximum(values - highest, lowest - values)
    beyond = np.maximum(time - reference.time[-1], reference.time[0] - time)
    # No tolerance in value makes up for a moment that the reference does not reach.
    return np.where(beyond > shift, np.inf, np.clip(distance, 0.0, None))


def _widen_at_jumps(
    reference: Signal, time: np.ndarray, low: np.ndarray, high: np.ndarray, lowest: np.ndarray, highest: np.ndarray
) -> None:
    """Let the ranges at times from one reference sample to the next hold both when the reference jumps in between.

    Such a jump is known to happen between the two, and not when; and one that falls on a sample may, by rounding,
    show there or at the next. Of a record with long steps that would excuse too much: there the time shift alone counts.
    """
    jumps = sampled_jumps(reference)
    steps = reference.time[jumps + 1] - reference.time[jumps]
    jumps = jumps[steps <= SHORT_STEP * (reference.time[-1] - reference.time[0])]
    if not len(jumps):
        return
    first = np.searchsorted(time, reference.time[jumps], "left")
    length = np.searchsorted(time, reference.time[jumps + 1], "right") - first
    begins = np.cumsum(length) - length
    here = np.arange(length.sum()) + np.repeat(first - begins, length)
    for end in (np.repeat(jumps, length), np.repeat(jumps + 1, length)):
        np.minimum.at(lowest, here, low[end])
        np.maximum.at(highest, here, high[end])
