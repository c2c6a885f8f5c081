"""How far each sample of a result is from what the reference allows."""

import numpy as np

from orchestrator.regress.comparison.envelope import values_at, window_range
from orchestrator.regress.comparison.jumps import sampled_jumps
from orchestrator.regress.comparison.prepare import Pair

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
    result, reference = pair.result, pair.reference
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
        far = np.flatnonzero(too_far)
        between = far[_within_jump(pair, far, limit)]
        distance[between] = 0.0
        too_far[between] = False
    return distance, too_far


def window_distances(pair: Pair, which: np.ndarray) -> np.ndarray:
    """Return the exact distance of some result samples, shape (m,), from the reference within the time shift."""
    result, reference, shift = pair.result, pair.reference, pair.band.half_width
    time, values = result.time[which], result.values[which]
    low = high = reference.values
    if pair.band.local:
        local = pair.band.local * np.abs(reference.values)
        low, high = low - local, high + local
    low, high = window_range(reference.time, low, high, time - shift, time + shift, reference.interpolation)
    distance = np.maximum(values - high, low - values)
    beyond = np.maximum(time - reference.time[-1], reference.time[0] - time)
    # No tolerance in value makes up for a moment that the reference does not reach.
    return np.where(beyond > shift, np.inf, np.clip(distance, 0.0, None))


def _within_jump(pair: Pair, which: np.ndarray, limit: np.ndarray | float) -> np.ndarray:
    """Return which positions of `which` hold samples between the two ends of a jump between two reference samples.

    When a jump falls between two samples of the reference, it is known to happen there and not when.
    """
    reference, result = pair.reference, pair.result
    jumps = sampled_jumps(reference) if len(which) else which
    if not len(jumps):
        return np.zeros(0, dtype=int)
    starts_jump = np.zeros(len(reference.time), dtype=bool)
    starts_jump[jumps] = True
    segment = np.maximum(np.searchsorted(reference.time, result.time[which], "right") - 1, 0)
    within = np.flatnonzero(starts_jump[segment])
    segment, which = segment[within], which[within]
    one, other = reference.values[segment], reference.values[segment + 1]
    room = limit if np.ndim(limit) == 0 else np.asarray(limit)[which]
    values = result.values[which]
    return within[(values >= np.minimum(one, other) - room) & (values <= np.maximum(one, other) + room)]
