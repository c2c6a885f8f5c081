"""Sample by sample: no time shift, whatever the tolerance says."""

from dataclasses import dataclass, replace
from typing import ClassVar

from orchestrator.regress.comparison.prepare import prepare
from orchestrator.regress.comparison.result import SignalVerdict
from orchestrator.regress.comparison.signal import Signal
from orchestrator.regress.comparison.tolerance import Tolerance
from orchestrator.regress.comparison.tube import judge_pair


@dataclass(frozen=True)
class Pointwise:
    """A result is near its reference at each of its own stamps; `relative` counts the local value, as in `isclose`.

    The tolerance at each moment is `absolute` + `relative` x |reference|; a time shift in it is refused, as it would
    not count. At a stamp that the reference has twice, any value between the two is near; a jump between two stamps
    excuses nothing.
    """

    tolerance: Tolerance = Tolerance()
    kind: ClassVar[str] = "pointwise"
    needs_reference: ClassVar[bool] = True

    def judge(self, signal: Signal, reference: Signal | None) -> SignalVerdict:
        """Return the verdict; damaged data are a failed verdict with a reason."""
        given = self.tolerance
        if given.time_shift_s:
            reason = "a pointwise check has no time shift; use a tube, or leave time_shift_s out"
            return SignalVerdict(signal.name, False, reason, self.kind, signal.unit)
        tolerance = replace(given, relative=0.0, local=given.local + given.relative)
        pair = prepare(self.kind, signal, reference, tolerance)
        if isinstance(pair, SignalVerdict):
            return pair
        return judge_pair(replace(pair, excuses_sampling=False), self.kind)
