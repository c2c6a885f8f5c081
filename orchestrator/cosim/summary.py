"""What a signal did, in four numbers, without keeping its values."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orchestrator.results.column import Column
from orchestrator.results.recorder import Recorder


class SummaryRecorder:
    """Passes rows on to another recorder and keeps first, last, smallest and largest value of each column, each (k,)."""

    def __init__(self, onward: Recorder) -> None:
        self._onward = onward
        self.columns: tuple[Column, ...] = ()
        self.count = 0
        self.first = self.last = self.smallest = self.largest = np.zeros(0)

    def begin(self, columns: Sequence[Column], provenance: Mapping[str, Any]) -> None:
        """Say what the rows will be."""
        self.columns = tuple(columns)
        self.first = self.last = np.full(len(columns), np.nan)
        self.smallest, self.largest = np.full(len(columns), np.inf), np.full(len(columns), -np.inf)
        self._onward.begin(columns, provenance)

    def rows(self, times: NDArray[np.float64], values: NDArray[np.float64]) -> None:
        """Take times (n,) in s and values (n, k)."""
        if self.count == 0:
            self.first = np.array(values[0])
        self.last = np.array(values[-1])
        self.smallest = np.minimum(self.smallest, values.min(axis=0))
        self.largest = np.maximum(self.largest, values.max(axis=0))
        self.count += len(times)
        self._onward.rows(times, values)

    def finish(self, failure: str = "") -> None:
        """Pass the end on."""
        self._onward.finish(failure)

    def to_json(self) -> dict[str, dict[str, Any]]:
        """First, last, smallest and largest value of each signal with its unit."""
        parts = zip(self.columns, self.first, self.last, self.smallest, self.largest, strict=True)
        return {
            column.name: {"unit": column.unit, **_numbers(first=first, last=last, min=low, max=high)}
            for column, first, last, low, high in parts
        }


def _numbers(**values: float) -> dict[str, float | None]:
    """JSON has no infinities."""
    return {name: float(value) if np.isfinite(value) else None for name, value in values.items()}
