"""Whether a signal has come to rest, and where."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from orchestrator.regress.comparison.figures import at_least, numbers
from orchestrator.regress.comparison.one_number import judge_number
from orchestrator.regress.comparison.prepare import alone, prepare
from orchestrator.regress.comparison.result import SignalVerdict
from orchestrator.regress.comparison.signal import Signal
from orchestrator.regress.comparison.statistic import mean_and_spread
from orchestrator.regress.comparison.tolerance import Tolerance, limit_around
from orchestrator.regress.comparison.wording import seconds


@dataclass(frozen=True)
class SteadyState:
    """Over the last `window_s` every sample stays near one value: `value`, or the reference's mean over that window.

    The tolerance is `absolute` + `relative` x |value|.
    """

    window_s: float
    value: float | None = None
    tolerance: Tolerance = Tolerance()
    kind: ClassVar[str] = "steady_state"

    def __post_init__(self) -> None:
        at_least(0.0, window_s=self.window_s)
        numbers(value=self.value)

    @property
    def needs_reference(self) -> bool:
        """Whether `judge` fails without a reference."""
        return self.value is None

    def judge(self, signal: Signal, reference: Signal | None) -> SignalVerdict:
        """Return the verdict; damaged data are a failed verdict with a reason."""
        if self.value is None:
            pair = prepare(self.kind, signal, reference, self.tolerance)
            if isinstance(pair, SignalVerdict):
                return pair
            result, expected = pair.result, mean_and_spread(self._last(pair.reference))[0]
        else:
            cut = alone(self.kind, signal, self.tolerance)
            if isinstance(cut, SignalVerdict):
                return cut
            result, expected = cut, self.value
        if result.time[-1] - result.time[0] < self.window_s:
            reason = f"the result lasts {seconds(result.time[-1] - result.time[0])}, less than the window of {seconds(self.window_s)}"
            return SignalVerdict(result.name, False, reason, self.kind, result.unit)
        last = self._last(result)
        worst = int(np.argmax(np.abs(last.values - expected)))
        limit = limit_around(self.tolerance, expected, result.nominal)
        what = f"the value, at rest in the last {seconds(self.window_s)},"
        return judge_number(
            self.kind, result, what, float(last.values[worst]), expected, limit, float(last.time[worst])
        )

    def _last(self, signal: Signal) -> Signal:
        kept = signal.time >= signal.time[-1] - self.window_s
        return replace(signal, time=signal.time[kept], values=signal.values[kept])
