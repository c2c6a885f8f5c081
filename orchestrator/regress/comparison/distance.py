"""How far each sample of a result is from what the reference allows."""

import numpy as np

from orchestrator.regress.comparison.envelope import values_at, window_range
from orchestrator.regress.comparison.jumps import SHORT_STEP, bends, isolated_steps, sampled_jumps
from orchestrator.regress.comparison.prepare import Pair
from orchestrator.regress.comparison.signal import Signal

# What a curve bends between samples matters from this share of the tolerance on.
NOTICEABLE = 0.1
# Interpolating between samples rounds by a few units in the last place.
_ROUNDING = 8 * np.finfo(float).eps

# The reference less and plus its local tolerance, (n,) each.
Curves = tuple[np.ndarray, np.ndarray]


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
        distance[far] = window_distances(pair, far, limit if np.ndim(limit) == 0 else np.asarray(limit)[far])
        too_far = ~(distance <= limit)
    return distance, too_far


def window_distances(pair: Pair, which: np.ndarray, limit: np.ndarray | float = 0.0) -> np.ndarray:
    """Return the exact distance of some result samples, shape (m,), from the reference within the time shift.

    What a record cannot know between its samples is only looked for where a sample exceeds the `limit`, one number or
    shape (m,).
    """
    result, reference, shift = pair.result, pair.around, pair.band.half_width
    time, values = result.time[which], result.values[which]
    low = high = reference.values
    if pair.band.local:
        local = pair.band.local * np.abs(reference.values)
        low, high = low - local, high + local
    lowest, highest = window_range(reference.time, low, high, time - shift, time + shift, reference.interpolation)
    distance = np.maximum(values - highest, lowest - values)
    if pair.excuses_sampling and (distance > limit).any():
        steps = np.diff(reference.time)
        short = (steps > 0) & (steps <= SHORT_STEP * (reference.time[-1] - reference.time[0]))
        _widen_between_samples(pair, time, lowest, highest, short)
        _widen_at_jumps(reference, time, (low, high), lowest, highest, short)
        distance = np.maximum(values - highest, lowest - values)
    beyond = np.maximum(time - reference.time[-1], reference.time[0] - time)
    # No tolerance in value makes up for a moment that the reference does not reach.
    return np.where(beyond > shift, np.inf, np.clip(distance, 0.0, None))


def _widen_between_samples(
    pair: Pair, time: np.ndarray, lowest: np.ndarray, highest: np.ndarray, short: np.ndarray
) -> None:
    """Let the ranges at times between two reference samples hold what the reference's curve bends there.

    Only within `short` steps, and where that is a noticeable share of the tolerance; at stamps nothing changes.
    """
    reference = pair.around
    if reference.interpolation == "hold" or pair.same_grid:
        return
    bent = bends(reference.values)
    bend = np.maximum(bent[:-1], bent[1:])
    steps = np.flatnonzero(short & (bend > NOTICEABLE * pair.band.half_height))
    here, step = _samples_of(time, reference.time[steps], reference.time[steps + 1], inside=True)
    lowest[here] -= bend[steps[step]]
    highest[here] += bend[steps[step]]


def _widen_at_jumps(
    reference: Signal, time: np.ndarray, curves: Curves, lowest: np.ndarray, highest: np.ndarray, short: np.ndarray
) -> None:
    """Let the ranges at times from one reference sample to the next hold both when the reference jumps in between.

    Such a jump is known to happen between the two, and not when; and one that falls on a sample may, by rounding,
    show there or at the next. Of a step that is not `short` that would excuse too much: there the time shift alone
    counts.
    """
    jumps = np.union1d(sampled_jumps(reference), isolated_steps(reference.values))
    jumps = jumps[short[jumps]]
    here, step = _samples_of(time, reference.time[jumps], reference.time[jumps + 1], inside=False)
    for end in (jumps[step], jumps[step] + 1):
        np.minimum.at(lowest, here, curves[0][end])
        np.maximum.at(highest, here, curves[1][end])


def _samples_of(time: np.ndarray, start: np.ndarray, end: np.ndarray, inside: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return which of the rising times lie in which of the intervals, both as indices; `inside` leaves out their ends."""
    first = np.searchsorted(time, start, "right" if inside else "left")
    length = np.maximum(np.searchsorted(time, end, "left" if inside else "right") - first, 0)
    begins = np.cumsum(length) - length
    return np.arange(length.sum()) + np.repeat(first - begins, length), np.repeat(np.arange(len(start)), length)
