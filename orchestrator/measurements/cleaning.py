"""Samples that a recorder got wrong: outliers, which stand out of their neighbours, and held ones, which repeat the last."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from orchestrator.measurements.trial import Array

# An outlier is this many robust standard deviations from the cubic through its neighbours, a held sample from where the
# signal was on its way.
STANDS_OUT = 6.0
# More than this share is the signal itself: pulses, or a sensor that reads anew every few samples.
MOST_SHARE = 0.02
# A signal this exact, as a share of its size, is computed.
ROUNDING = 1e-9
# Steps in time of more than this many usual ones are gaps.
GAP = 1.5
_MEDIAN_OF_UNIT_NORMAL = 0.6744897501960817


@dataclass(frozen=True, eq=False)
class Cleaned:
    """A series (n,) with wrong samples replaced, and which these were, (n,) each."""

    values: Array
    outliers: NDArray[np.bool_]
    held: NDArray[np.bool_]


def cleaned(time: Array, values: Array) -> Cleaned:
    """Replace outliers and held samples of a measured signal by the cubic through their neighbours.

    An outlier is far from the cubic through two samples on either side (Hampel's identifier on that distance), and
    without it the samples around it agree, and neither side runs into it; else the signal has a step or an impact,
    which stays. Held samples repeat one before them while the signal was moving as fast before and after as it must
    have moved meanwhile.
    """
    nothing = np.zeros(len(values), bool)
    if len(values) < 20:
        return Cleaned(values, nothing, nothing)
    held = _held(values)
    without_held = _bridged(time, values, held)
    outliers = _outliers(without_held)
    return Cleaned(_bridged(time, values, held | outliers), outliers, held)


def gaps(time: Array) -> NDArray[np.intp]:
    """Places of the samples before the gaps of a clock."""
    steps = np.diff(time)
    return np.flatnonzero(steps > GAP * np.median(steps))


def pieces(time: Array, values: Array) -> list[Array]:
    """Cut a series at the gaps of its clock."""
    return np.split(values, gaps(time) + 1)


def _outliers(values: Array) -> NDArray[np.bool_]:
    distance = np.abs(_from_neighbours(values))
    limit = STANDS_OUT * float(np.median(distance)) / _MEDIAN_OF_UNIT_NORMAL
    found = np.zeros(len(values), bool)
    if limit <= ROUNDING * float(np.max(np.abs(values))):
        return found
    for place in np.flatnonzero(distance > limit):
        first = max(int(place) - 4, 0)
        window, own = values[first : place + 5].copy(), int(place) - first
        if distance[place] < distance[max(place - 2, 0) : place + 3].max():
            continue  # the shadow of a worse neighbour
        if min(_off_course(window, own), _off_course(window[::-1], len(window) - 1 - own)) < 3 * limit:
            continue  # one side runs into it, as into an impact
        window[own] -= _from_neighbours(window)[own]
        found[place] = bool(np.all(np.abs(_from_neighbours(window)) <= limit))
    return found if np.mean(found) <= MOST_SHARE else np.zeros(len(values), bool)


def _from_neighbours(values: Array) -> Array:
    """Distance of each sample from the cubic through two neighbours on either side; 0 at the ends."""
    inner = values[2:-2] - (4 * (values[1:-3] + values[3:-1]) - values[:-4] - values[4:]) / 6
    return np.pad(inner, 2)


def _off_course(window: Array, own: int) -> float:
    """Distance of a sample from where a parabola through the three before it runs to; infinite if there are fewer."""
    if own < 3:
        return float("inf")
    return float(abs(window[own] - 3 * window[own - 1] + 3 * window[own - 2] - window[own - 3]))


def _held(values: Array) -> NDArray[np.bool_]:
    change = np.diff(values)
    spread = float(np.median(np.abs(_from_neighbours(values)))) / _MEDIAN_OF_UNIT_NORMAL
    found = np.zeros(len(values), bool)
    for first, last in _runs(change == 0.0):  # values[first] == ... == values[last]
        length = last - first + 1
        if length < 3 or first < length or last + length + 1 > len(values) - 1:
            continue
        jump = values[last + 1] - values[first]
        before = (values[first] - values[first - length]) / length
        after = (values[last + 1 + length] - values[last + 1]) / length
        expected = 0.5 * (before + after) * length
        if abs(jump) > STANDS_OUT * spread and abs(jump - expected) < 0.5 * abs(expected):
            found[first + 1 : last + 1] = True
    return found if np.mean(found) <= 5 * MOST_SHARE else np.zeros(len(values), bool)


def _runs(flags: NDArray[np.bool_]) -> Sequence[tuple[int, int]]:
    """First and last sample of each stretch of samples between which all flags (n - 1,) are set."""
    edges = np.flatnonzero(np.diff(np.r_[False, flags, False].astype(int)))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _bridged(time: Array, values: Array, wrong: NDArray[np.bool_]) -> Array:
    """Values with the wrong ones on the cubic (Lagrange's) through the two right samples on either side."""
    if not wrong.any():
        return values
    result, right = values.copy(), np.flatnonzero(~wrong)
    for place in np.flatnonzero(wrong):
        after = int(np.clip(np.searchsorted(right, place), 2, len(right) - 2))
        near = right[after - 2 : after + 2]
        weights = [np.prod([(time[place] - time[k]) / (time[j] - time[k]) for k in near if k != j]) for j in near]
        result[place] = float(np.dot(weights, values[near]))
    return result


def bridged(time: Array, values: Array) -> Array:
    """Move the two samples at each gap so that the straight line between them has the mean of a smooth curve.

    The curve is the cubic spline through all samples. Both move by the same, and by so little less that the line over
    the gap and the two steps beside it together gain what the curve has above the line. Pieces of a signal with steps,
    such as a command, are left as they are: a curve through them means nothing.
    """
    steps, places = np.diff(time), gaps(time)
    if not places.size or len(time) < 4 or _has_steps(values):
        return values
    usual = float(np.median(steps))
    curve, result = scipy.interpolate.CubicSpline(time, values), values.astype(float)
    for place in places:
        length = float(steps[place])
        excess = float(curve.integrate(time[place], time[place + 1])) - 0.5 * length * (
            values[place] + values[place + 1]
        )
        result[place : place + 2] += excess / (length + usual)
    return result


def _has_steps(values: Array) -> bool:
    """Whether most samples repeat the one before them."""
    return bool(np.mean(np.diff(values) == 0.0) > 0.5)
