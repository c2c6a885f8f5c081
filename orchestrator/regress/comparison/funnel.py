"""A tube that opens with time, for what drifts: integrated signals, clocks, positions from speeds."""

import math
from dataclasses import dataclass
from typing import ClassVar

from orchestrator.regress.comparison.prepare import prepare
from orchestrator.regress.comparison.result import SignalVerdict
from orchestrator.regress.comparison.signal import Signal
from orchestrator.regress.comparison.tolerance import Tolerance
from orchestrator.regress.comparison.tube import judge_pair


@dataclass(frozen=True)
class Funnel:
    """A tube whose half-height grows by `opening_per_s`, in the signal's unit a second, from the window's begin on."""

    tolerance: Tolerance = Tolerance()
    opening_per_s: float = 0.0
    kind: ClassVar[str] = "funnel"
    needs_reference: ClassVar[bool] = True

    def judge(self, signal: Signal, reference: Signal | None) -> SignalVerdict:
        """Return the verdict; damaged data are a failed verdict with a reason."""
        if not (math.isfinite(self.opening_per_s) and self.opening_per_s >= 0):
            reason = f"the funnel opens by {self.opening_per_s} {signal.unit}/s, expected a number from 0 up"
            return SignalVerdict(signal.name, False, reason, self.kind, signal.unit)
        pair = prepare(self.kind, signal, reference, self.tolerance)
        return pair if isinstance(pair, SignalVerdict) else judge_pair(pair, self.kind, self.opening_per_s)
