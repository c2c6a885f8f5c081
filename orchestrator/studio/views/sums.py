"""Sums over any part of a long series without reading all of it."""

from dataclasses import dataclass

import numpy as np

from orchestrator.studio.views.pyramid import SMALLEST_KEPT


@dataclass(frozen=True)
class Moments:
    """Number of finite values, their sum and the sum of their squares."""

    count: int
    total: float
    square: float

    def __add__(self, other: "Moments") -> "Moments":
        return Moments(self.count + other.count, self.total + other.total, self.square + other.square)

    @property
    def rms(self) -> float:
        """Root of the mean square; NaN without a value."""
        return float(np.sqrt(self.square / self.count)) if self.count else float("nan")

    @property
    def mean(self) -> float:
        """Mean; NaN without a value."""
        return self.total / self.count if self.count else float("nan")


NOTHING = Moments(0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Sums:
    """A series (n,) with the moments (3, m) of its whole blocks of 32 samples.

    Blocks are added up when asked for, 1/32 of the work: differences of running sums would drown the error of a quiet
    stretch in the rounding of a peak before it.
    """

    series: np.ndarray
    blocks: np.ndarray

    def between(self, start: int, stop: int) -> Moments:
        """Moments of samples start to stop (exclusive): whole blocks from the sums, the edges from the series."""
        start, stop = max(0, start), min(stop, len(self.series))
        first, last = -(-start // SMALLEST_KEPT), stop // SMALLEST_KEPT
        if stop <= start:
            return NOTHING
        if last <= first:
            return moments(self.series[start:stop])
        count, total, square = self.blocks[:, first:last].sum(axis=1)
        edges = moments(self.series[start : first * SMALLEST_KEPT]) + moments(self.series[last * SMALLEST_KEPT : stop])
        return Moments(round(count), float(total), float(square)) + edges


def moments(values: np.ndarray) -> Moments:
    """Moments of an array, in double precision."""
    finite = np.asarray(values, dtype=float)
    finite = finite[np.isfinite(finite)]
    return Moments(finite.size, float(finite.sum()), float(finite @ finite))


def block_moments(series: np.ndarray) -> np.ndarray:
    """Moments (3, m) of whole blocks of 32 samples: what is worth keeping beside a series on the disk."""
    whole = len(series) // SMALLEST_KEPT * SMALLEST_KEPT
    values = np.asarray(series[:whole], dtype=float).reshape(-1, SMALLEST_KEPT)
    finite = np.isfinite(values)
    values = np.where(finite, values, 0.0)
    return np.stack([finite.sum(axis=1), values.sum(axis=1), np.einsum("ij,ij->i", values, values)])
