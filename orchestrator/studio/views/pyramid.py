"""Extremes of a long series at every scale, so that a picture of any part of it costs the same and loses no peak."""

from dataclasses import dataclass

import numpy as np

# Blocks below this size are reduced when asked for; from here on their extremes are kept, 1/8 of the series' memory.
SMALLEST_KEPT = 32


@dataclass(frozen=True, eq=False)
class Blocks:
    """Extremes of consecutive blocks of `size` samples; block k covers samples [(first + k) size, (first + k + 1) size).

    `low` and `high` have shape (m,); values that are not finite are left out, a block without any other is NaN.
    """

    first: int
    size: int
    low: np.ndarray
    high: np.ndarray

    @property
    def bounds(self) -> np.ndarray:
        """First sample of each block and the one after the last block, (m + 1,)."""
        return (self.first + np.arange(len(self.low) + 1)) * self.size


@dataclass(frozen=True, eq=False)
class Pyramid:
    """A series (n,) of float32, possibly memory-mapped, with the extremes of its blocks of 32, 64, 128 ... samples.

    `levels[k]` has shape (2, ceil(n / (32 * 2**k))): smallest above largest.
    """

    series: np.ndarray
    levels: tuple[np.ndarray, ...]

    def blocks(self, start: int, stop: int, most: int) -> Blocks:
        """Extremes over samples start to stop (exclusive) in at most `most` blocks, as small as that allows.

        Block bounds are multiples of the block size wherever one looks, so a picture does not flicker while it moves.
        The first and the last block may reach beyond the range by less than one block.
        """
        start, stop = max(0, start), min(stop, len(self.series))
        size = block_size(start, stop, most)
        first, last = start // size, -(-stop // size)
        if size >= SMALLEST_KEPT:
            low, high = self.levels[(size // SMALLEST_KEPT).bit_length() - 1][:, first:last]
        else:
            low, high = extremes(self.series[first * size : last * size], size)
        return Blocks(first, size, low, high)

    @property
    def span(self) -> tuple[float, float]:
        """Smallest and largest value of all; NaN twice for a series without a finite value."""
        low, high = self.levels[-1][:, 0]
        return float(low), float(high)


def block_size(start: int, stop: int, most: int) -> int:
    """Smallest power of two whose aligned blocks cover start to stop (exclusive) with at most `most` of them."""
    size = 1
    while -(-stop // size) - start // size > max(most, 1):
        size *= 2
    return size


def base_level(series: np.ndarray) -> np.ndarray:
    """Extremes (2, m) of blocks of 32 samples of a series (n,): what is worth keeping beside it on the disk."""
    return np.stack(extremes(series, SMALLEST_KEPT))


def pyramid(series: np.ndarray, base: np.ndarray) -> Pyramid:
    """Put a pyramid on a series and its `base_level`."""
    levels = [base]
    while levels[-1].shape[1] > 1:
        low, high = levels[-1]
        levels.append(np.stack([extremes(low, 2)[0], extremes(high, 2)[1]]))
    return Pyramid(series, tuple(levels))


def extremes(series: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Smallest and largest value of each block of `size` samples, the last may be shorter; only finite values count."""
    if size == 1:
        return series, series
    whole = len(series) // size * size
    blocks = np.asarray(series[:whole]).reshape(-1, size)
    low, high = np.fmin.reduce(blocks, axis=1), np.fmax.reduce(blocks, axis=1)
    if whole == len(series):
        return low, high
    rest = np.asarray(series[whole:])
    return np.append(low, np.fmin.reduce(rest)), np.append(high, np.fmax.reduce(rest))
