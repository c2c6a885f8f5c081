"""What the views show of a comparison: plain data, without any page."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from orchestrator.studio.views.pyramid import Pyramid
from orchestrator.studio.views.selection import Range
from orchestrator.studio.views.sums import Sums


@dataclass(frozen=True, eq=False)
class Signal:
    """One signal of one trial, in its unit; `residual` is measured minus modelled."""

    measured: Pyramid
    modelled: Pyramid
    residual: Pyramid
    sums: Sums


@dataclass(frozen=True, eq=False)
class ViewTrial:
    """One trial: `time` (n,) in s, increasing; signals and inputs by name, each over the same samples."""

    name: str
    subset: str
    time: np.ndarray
    signals: Mapping[str, Signal]
    inputs: Mapping[str, np.ndarray]

    def samples(self, time: Range | None) -> tuple[int, int]:
        """First sample in a range of time, and the one after its last."""
        if time is None:
            return 0, len(self.time)
        first, last = np.searchsorted(self.time, time.low), np.searchsorted(self.time, time.high, side="right")
        return int(first), int(last)


@dataclass(frozen=True, eq=False)
class ViewData:
    """Trials of a comparison, with units and noise floor of each signal.

    `against` and `frequency` are the rows "state" and "frequency" of the comparison's `where`: errors of the learning
    trials, each with the band that chance alone would give.
    """

    signals: tuple[str, ...]
    units: Mapping[str, str]
    noise_floor: Mapping[str, float]
    trials: tuple[ViewTrial, ...]
    against: Sequence[Mapping[str, Any]]
    frequency: Sequence[Mapping[str, Any]]

    @property
    def time(self) -> Range:
        """From the earliest to the latest sample of all trials, in s."""
        return Range(min(float(t.time[0]) for t in self.trials), max(float(t.time[-1]) for t in self.trials))

    def shown(self, trials: tuple[int, ...] | None) -> tuple[int, ...]:
        """Places of the trials to show; None means all."""
        return tuple(range(len(self.trials))) if trials is None else trials
