"""How far two curves are apart, in value and in time: jumps, distances, and events moved onto each other."""

from dataclasses import dataclass, replace

import numpy as np

from orchestrator.regress.comparison.prepare import Pair, values_at, window_range
from orchestrator.regress.comparison.signal import Signal

# A step from sample to sample is a jump when it is this share of the whole range ...
RANGE_SHARE = 0.05
# ... and this many times the median step; ordinary curves, sampled well, have no such steps.
MEDIAN_STEPS = 20.0
MEDIAN_SAMPLES = 4096
# A small step is a jump, too, when it is this many times its neighbours.
STANDS_OUT = 3.0
# Share of a record's length up to which a step is short: the moment of a jump within it does not count.
SHORT_STEP = 0.01


def sampled_jumps(signal: Signal) -> np.ndarray:
    """Return the indices k where the signal jumps at an unknown moment between the samples k and k + 1.

    All changes of a "hold" signal between different stamps; of a "linear" one the steps that stand out.
    """
    steps = np.abs(np.diff(signal.values))
    apart = np.diff(signal.time) > 0
    if signal.interpolation == "hold":
        return np.flatnonzero((steps > 0) & apart)
    if not len(steps):
        return np.zeros(0, dtype=int)
    large = max(RANGE_SHARE * float(np.ptp(signal.values)), MEDIAN_STEPS * _median(steps))
    return np.flatnonzero((steps >= large) & (steps > 0) & apart)


def isolated_steps(values: np.ndarray) -> np.ndarray:
    """Return the indices k where the step from sample k to k + 1 is several times that before and that after it.

    On a curve that is sampled well neighbouring steps are alike, also around an extreme, where at most one is small.
    """
    steps = np.abs(np.diff(values))
    if len(steps) < 3:
        return np.zeros(0, dtype=int)
    around = np.maximum(steps[:-2], steps[2:])
    return np.flatnonzero(steps[1:-1] > STANDS_OUT * around) + 1


def bends(values: np.ndarray) -> np.ndarray:
    """Return what a curve may leave the straight line between two samples by, at each of them, shape (n,).

    Half the second difference: what a kink between two samples leaves the line by, and four times what a parabola does.
    """
    found = np.zeros(len(values))
    if len(values) > 2:
        found[1:-1] = np.abs(values[:-2] - 2 * values[1:-1] + values[2:]) / 2
    return found


def exact_jumps(signal: Signal) -> np.ndarray:
    """Return the indices k where the samples k and k + 1 share a stamp and differ."""
    shared = np.flatnonzero(signal.time[1:] == signal.time[:-1])
    return shared[signal.values[shared + 1] != signal.values[shared]]


def jump_times(signal: Signal, smallest: float = 0.0, direction: str = "any") -> np.ndarray:
    """Return when the signal jumps, s, rising; of a linear one the middle of the two samples around a jump.

    A "hold" signal changes at the second of the two samples. Changes up to `smallest`, in the signal's unit, do not
    count; `direction` is "any", "rising" or "falling".

    Args:
        signal: the signal.
        smallest: changes up to this, in the signal's unit, do not count.
        direction: "any", "rising" or "falling".
    """
    k = np.sort(np.concatenate([sampled_jumps(signal), exact_jumps(signal)]))
    heights = signal.values[k + 1] - signal.values[k]
    if direction != "any":
        heights = heights if direction == "rising" else -heights
        k, heights = k[heights > 0], heights[heights > 0]
    k = k[np.abs(heights) > smallest]
    if signal.interpolation == "hold":
        return signal.time[k + 1]
    return (signal.time[k] + signal.time[k + 1]) / 2


def _median(steps: np.ndarray) -> float:
    """The median, of evenly spread samples where there are many: it is only a yardstick."""
    return float(np.median(steps[:: 1 + len(steps) // MEDIAN_SAMPLES]))


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

    Args:
        pair: result and reference.
        which: numbers of the result's samples, (m,).
        limit: distance, in the signal's unit, beyond which what lies between samples matters.
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


@dataclass(frozen=True, eq=False)
class Alignment:
    """Jumps of a result, `found`, and of its reference, `due`: moments in s, rising."""

    found: np.ndarray
    due: np.ndarray

    @property
    def paired(self) -> bool:
        """Whether there are jumps, as many in the result as in the reference."""
        return len(self.found) == len(self.due) > 0

    @property
    def worst(self) -> int:
        """Which pair is farthest apart."""
        return int(np.argmax(np.abs(self.found - self.due)))

    @property
    def shift_s(self) -> float | None:
        """The largest shift, s, positive when the result is late; None without pairs."""
        return float(self.found[self.worst] - self.due[self.worst]) if self.paired else None


def align(pair: Pair) -> Alignment:
    """Return the jumps of both, in order; those that fit into the band do not count."""
    smallest = 2 * pair.band.half_height
    return Alignment(jump_times(pair.result, smallest), jump_times(pair.reference, smallest))


def amplitude_error(pair: Pair, jumps: Alignment) -> float:
    """Return the largest distance left once all paired jumps are moved onto the reference's, in the signal's unit.

    The result's time runs faster or slower between its jumps, so that each one falls on the reference's.
    """
    ends = pair.result.time[[0, -1]]
    found = np.concatenate([ends[:1], jumps.found, ends[1:]])
    due = np.concatenate([ends[:1], np.clip(jumps.due, *ends), ends[1:]])
    moved = replace(pair.result, time=np.interp(pair.result.time, found, due))
    return float(distances(replace(pair, result=moved))[0].max())
