"""Gaps in the record of an input: nobody knows what it did meanwhile, so that much is noise."""

import numpy as np

from orchestrator.diagnosis.noise.thresholds import GAP


def unknown_in_gaps(time: np.ndarray, series: np.ndarray) -> np.ndarray:
    """Histories (n, k) of an input, four for each gap of its record, of the size that its mean over a gap may be off by.

    By how much the mean of a straight line over a gap errs is seen where nothing is missing: the root mean square over all
    other stretches of as many samples. Each history changes one of the four samples around its gap: together they stand for
    whatever a machine may have kept of what was done to it meanwhile, its speed and the phases of what swings in it.

    Args:
        time: (n,) s, even but for the gaps.
        series: (n,) the input at these times.
    """
    steps = np.diff(time)
    usual = float(np.median(steps))
    columns = []
    for place, missing in _gaps(time):
        whole = steps_are_even(steps, missing, usual)
        if not whole.any():
            continue
        sums = np.r_[0.0, np.cumsum(0.5 * (series[1:] + series[:-1]))]
        first = np.flatnonzero(whole)
        means = (sums[first + missing] - sums[first]) / missing
        off = means - 0.5 * (series[first] + series[first + missing])
        size = float(np.sqrt(np.mean(off**2)))
        columns += [
            size * (np.arange(len(time)) == near) for near in range(place - 1, place + 3) if 0 <= near < len(time)
        ]
    return np.column_stack(columns) if columns else np.zeros((len(time), 0))


def without_gaps(time: np.ndarray) -> np.ndarray:
    """The times (n,), and between them, in gaps, times (m,) in all that are as near to each other as samples are.

    >>> without_gaps(np.array([0.0, 1.0, 2.0, 5.0, 6.0]))
    array([0., 1., 2., 3., 4., 5., 6.])
    """
    inside = [np.linspace(time[place], time[place + 1], missing + 1)[1:-1] for place, missing in _gaps(time)]
    return np.sort(np.concatenate([time, *inside]))


def _gaps(time: np.ndarray) -> list[tuple[int, int]]:
    """The sample before each gap of times (n,), and the usual steps that the gap is long."""
    steps = np.diff(time)
    usual = float(np.median(steps))
    return [(int(place), round(steps[place] / usual)) for place in np.flatnonzero(steps > GAP * usual)]


def steps_are_even(steps: np.ndarray, count: int, usual: float) -> np.ndarray:
    """Whether `count` steps that begin at each sample, as far as there are so many, have no gap among them.

    Args:
        steps: time (n,) between samples, in s.
        count: number of steps that are to be even.
        usual: the usual step, in s.
    """
    gaps = np.r_[0, np.cumsum(steps > GAP * usual)]
    return np.asarray(gaps[count:] == gaps[:-count])
