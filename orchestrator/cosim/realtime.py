"""Runs at the pace of the clock, and how late their steps were."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

# Sleeping longer than this loses to waiting actively: the system wakes a process up to about 0.1 ms late.
ACTIVE_S = 2e-4


@dataclass(frozen=True)
class Lateness:
    """How late communication points were complete, in s of the clock; `missed` counts those late by a step or more.

    `factor` is simulated time over clock time that was asked for; `points` how many communication points there were.
    """

    factor: float
    points: int
    p50: float
    p99: float
    largest: float
    missed: int

    def to_json(self) -> dict[str, Any]:
        """The report as JSON, times in us."""
        late = {
            name: round(1e6 * value, 3) for name, value in (("p50", self.p50), ("p99", self.p99), ("max", self.largest))
        }
        return {"factor": self.factor, "points": self.points, "lateness_us": late, "missed": self.missed}


class Pacer:
    """Holds a run back so that simulated time is not ahead of the clock.

    `factor` is simulated seconds for each second of the clock. A run that is late is not held back and catches up.
    """

    def __init__(
        self,
        factor: float,
        clock: Callable[[], float] = time.perf_counter,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self.factor = factor
        self._clock, self._sleep = clock, sleep
        self._began, self._first = 0.0, 0.0
        self._late: list[float] = []
        self._missed = 0

    def begin(self, simulated: float) -> None:
        """Start the clock at a simulated time in s."""
        self._began, self._first = self._clock(), simulated

    def reached(self, simulated: float, step: float) -> None:
        """Note that a communication point is complete, `step` s after the last, and wait until it is due."""
        due = self._began + (simulated - self._first) / self.factor
        late = self._clock() - due
        self._late.append(max(late, 0.0))
        self._missed += late >= step / self.factor
        if -late > ACTIVE_S:
            self._sleep(-late - ACTIVE_S)
        while self._clock() < due:
            pass

    def report(self) -> Lateness:
        """How late the points were that have been reached."""
        late = np.array(self._late or [0.0])
        p50, p99 = np.percentile(late, [50, 99])
        return Lateness(self.factor, len(self._late), float(p50), float(p99), float(late.max()), int(self._missed))
