"""When cycles begin, and how late they did."""

import contextlib
import ctypes
import gc
import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

# The end of a wait is spent spinning: waking up takes the kernel about 50 us.
SPIN_NS = 100_000
# Longer waits are interrupted so often.
SIGN_NS = 4_000_000
PRIORITY = 80


class RealTimer:
    """Cycles at absolute times; one that is late by more than a period is skipped and counted.

    Args:
        sign: told the time (ns) again and again while the next cycle is waited for: a sign of life in long periods, too.
            Where it says True, something cannot wait that long: a cycle is due at once, one until it says False again.
    """

    def __init__(self, period_ns: int, sign: Callable[[int], bool] = lambda now_ns: False) -> None:
        self.period_ns, self.missed, self.sign = period_ns, 0, sign
        self._hurried = False
        self._next = 0
        self.start()

    def start(self) -> None:
        """Cycles are due from now on: what came before a session's first cycle has missed none."""
        self._next = time.monotonic_ns() + self.period_ns

    def wait(self) -> tuple[int, int]:
        """Wait for the next cycle; returns when it is due and the time now (ns)."""
        now = time.monotonic_ns()
        behind = max(now - self._next, 0) // self.period_ns
        self.missed += behind
        due = self._next = self._next + behind * self.period_ns
        while (left := due - now - SPIN_NS) > 0:
            hurries, hurried = self.sign(now), self._hurried
            self._hurried = hurries
            if hurries and not hurried:
                return now, now
            time.sleep(min(left, SIGN_NS) * 1e-9)
            now = time.monotonic_ns()
        while (now := time.monotonic_ns()) < due:
            pass
        self._next += self.period_ns
        return due, now


@dataclass
class Lateness:
    """How late cycles began, in us; `add` takes ns."""

    _values: list[int] = field(default_factory=list)

    def add(self, late_ns: int) -> None:
        """Count one cycle."""
        self._values.append(late_ns)

    def to_json(self) -> dict[str, float]:
        """Percentiles in us; zeros without a cycle."""
        values = np.array(self._values or [0]) * 1e-3
        p50, p99, p999 = np.percentile(values, [50, 99, 99.9])
        return {
            "p50": round(p50, 1),
            "p99": round(p99, 1),
            "p999": round(p999, 1),
            "max": round(float(values.max()), 1),
        }


@contextlib.contextmanager
def real_time_priority(priority: int = PRIORITY) -> Iterator[list[str]]:
    """Run with real-time priority, memory locked and no garbage collection; yields what was not permitted, in words."""
    refused: list[str] = []
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except OSError:
        refused.append("real-time priority")
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.mlockall(3) != 0:
        refused.append("locked memory")
    gc.collect()
    gc.freeze()
    gc.disable()
    try:
        yield refused
    finally:
        gc.enable()
        gc.unfreeze()
        libc.munlockall()
        with contextlib.suppress(OSError):
            os.sched_setscheduler(0, *before)
