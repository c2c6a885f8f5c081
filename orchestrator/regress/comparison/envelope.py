"""The range that a reference covers around a moment."""

import numpy as np

from orchestrator.regress.comparison.extremes import range_extremes
from orchestrator.regress.comparison.signal import Interpolation


def values_at(time: np.ndarray, values: np.ndarray, query: np.ndarray, interpolation: Interpolation) -> np.ndarray:
    """Return one value of a curve at each queried time, shape (m,); at an event, one of those it has there.

    Before the first and after the last sample the nearest sample counts.
    """
    if interpolation == "hold":
        return values[np.clip(np.searchsorted(time, query, "right") - 1, 0, None)]
    return np.interp(query, time, values)


def window_range(
    time: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
    begin: np.ndarray,
    end: np.ndarray,
    interpolation: Interpolation,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the smallest value of one curve and the largest of another within each window.

    A curve runs in straight lines from sample to sample ("linear") or keeps each sample until the next ("hold"). Where
    a stamp occurs twice the curve runs up or down a vertical line, and a window that holds the stamp holds both values.
    Windows beyond either end see the nearest sample.

    Args:
        time: shape (n,), s, never falling.
        low, high: shape (n,), the two curves; the same array twice for the range of one curve.
        begin, end: shape (m,), s, begin <= end.
        interpolation: how both curves run between samples.

    Returns:
        Smallest and largest values, shape (m,) each.
    """
    first = np.minimum(np.searchsorted(time, begin, "left"), len(time) - 1)
    stop = np.maximum(np.searchsorted(time, end, "right"), 1)
    smallest, largest = range_extremes(low, high, first, stop)
    if interpolation == "hold":
        # A sample that lies on the window's begin has already replaced the one before it.
        held = np.where(time[first] > begin, np.maximum(first - 1, 0), first)
        return np.minimum(smallest, low[held]), np.maximum(largest, high[held])
    for edge in (begin, end):
        at_edge = np.interp(edge, time, low)
        smallest = np.minimum(smallest, at_edge)
        largest = np.maximum(largest, at_edge if high is low else np.interp(edge, time, high))
    return smallest, largest
