"""Selected samples of a trial as intervals, and how many of them a mask or a picture column holds."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from orchestrator.studio.views.sums import NOTHING, Moments, Sums, moments

# Up to so many intervals are added up one by one from sums of blocks.
FEW = 64


@dataclass(frozen=True, eq=False)
class Chosen:
    """Intervals of samples, increasing and apart: `starts` (k,) to `stops` (k,), the latter exclusive."""

    starts: np.ndarray
    stops: np.ndarray

    @classmethod
    def between(cls, start: int, stop: int) -> "Chosen":
        """One interval, or none if it is empty."""
        return cls(np.array([start]), np.array([stop])) if start < stop else NONE

    @classmethod
    def where(cls, mask: np.ndarray, stride: int = 1, length: int | None = None) -> "Chosen":
        """Where a mask over every `stride`-th of `length` samples is true; each entry stands for those up to the next."""
        steps = np.flatnonzero(np.diff(mask.astype(np.int8), prepend=0, append=0)) * stride
        return cls(steps[::2], np.minimum(steps[1::2], len(mask) * stride if length is None else length))

    @property
    def count(self) -> int:
        """Number of samples."""
        return int(np.sum(self.stops - self.starts))

    def touches(self, bounds: np.ndarray) -> np.ndarray:
        """Whether each block from `bounds[k]` to `bounds[k + 1]` (exclusive) holds a selected sample."""
        begun = np.searchsorted(self.starts, bounds[1:], side="left")
        ended = np.searchsorted(self.stops, bounds[:-1], side="right")
        return begun > ended

    def within(self, start: int, stop: int) -> "Chosen":
        """The part of it from one sample to another (exclusive)."""
        starts, stops = np.clip(self.starts, start, stop), np.clip(self.stops, start, stop)
        kept = starts < stops
        return Chosen(starts[kept], stops[kept])

    def mask(self, length: int) -> np.ndarray:
        """True at selected ones of `length` samples."""
        steps = np.zeros(length + 1, dtype=np.int8)
        steps[self.starts] += 1
        steps[self.stops] -= 1
        return np.cumsum(steps[:-1], dtype=np.int8).astype(bool)

    def moments(self, sums: Sums) -> Moments:
        """Moments of a series over the selected samples."""
        if len(self.starts) <= FEW:
            return sum((sums.between(start, stop) for start, stop in self), NOTHING)
        return moments(sums.series[self.mask(len(sums.series))])

    def __iter__(self) -> Iterator[tuple[int, int]]:
        return iter(zip(self.starts.tolist(), self.stops.tolist(), strict=True))


NONE = Chosen(np.zeros(0, dtype=int), np.zeros(0, dtype=int))
