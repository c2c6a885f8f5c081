"""Smallest and largest value of many index ranges of one array."""

import numpy as np


def range_extremes(
    low: np.ndarray, high: np.ndarray, first: np.ndarray, stop: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return min(low[first:stop]) and max(high[first:stop]) for each range; infinite for an empty one.

    Few short ranges are looked at sample by sample. Otherwise a sparse table (Bender and Farach-Colton, 2000) that
    keeps one level at a time covers each range by two overlapping blocks of 2^k samples, so that it costs
    O(n log(longest range)), whatever the grid.

    Args:
        low, high: shape (n,), without NaN.
        first, stop: shape (m,), indices into them, 0 <= first, stop <= n.

    Returns:
        Two arrays of shape (m,).

    Example:
        >>> import numpy as np
        >>> range_extremes(np.array([3.0, 1.0, 2.0]), np.array([3.0, 1.0, 2.0]), np.array([0, 2]), np.array([2, 2]))
        (array([ 1., inf]), array([  3., -inf]))
    """
    smallest = np.full(first.shape, np.inf)
    largest = np.full(first.shape, -np.inf)
    length = stop - first
    some = np.flatnonzero(length > 0)
    if len(some) and length[some].sum() <= len(low):
        _by_sample(low, high, first[some], length[some], some, smallest, largest)
    elif len(some):
        _by_table(low, high, first, stop, smallest, largest)
    return smallest, largest


def _by_sample(
    low: np.ndarray,
    high: np.ndarray,
    first: np.ndarray,
    length: np.ndarray,
    which: np.ndarray,
    smallest: np.ndarray,
    largest: np.ndarray,
) -> None:
    """Fill in the answers `which` from all samples of their ranges, none of them empty."""
    begins = np.cumsum(length) - length
    samples = np.arange(length.sum()) + np.repeat(first - begins, length)
    smallest[which] = np.minimum.reduceat(low[samples], begins)
    largest[which] = np.maximum.reduceat(high[samples], begins)


def _by_table(
    low: np.ndarray, high: np.ndarray, first: np.ndarray, stop: np.ndarray, smallest: np.ndarray, largest: np.ndarray
) -> None:
    """Fill in the answers of all ranges that are not empty."""
    # frexp gives length = fraction * 2**exponent with 0.5 <= fraction < 1, so that 2**(exponent - 1) <= length.
    level = np.where(stop > first, np.frexp(stop - first)[1] - 1, -1)
    for k in range(int(level.max()) + 1):
        here = np.flatnonzero(level == k)
        if len(here):
            begin, end = first[here], stop[here] - 2**k
            smallest[here] = np.minimum(low[begin], low[end])
            largest[here] = np.maximum(high[begin], high[end])
        low = np.minimum(low[: -(2**k)], low[2**k :])
        high = np.maximum(high[: -(2**k)], high[2**k :])
