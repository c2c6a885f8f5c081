"""The last value of a signal."""

from dataclasses import dataclass
from typing import ClassVar

from orchestrator.regress.comparison.figures import numbers
from orchestrator.regress.comparison.one_number import judge_number
from orchestrator.regress.comparison.prepare import alone, prepare
from orchestrator.regress.comparison.result import SignalVerdict
from orchestrator.regress.comparison.signal import Signal
from orchestrator.regress.comparison.tolerance import Tolerance, limit_around


@dataclass(frozen=True)
class EndValue:
    """The last value is near `value`, in the signal's unit, or near the reference's last value when none is given."""

    tolerance: Tolerance = Tolerance()
    value: float | None = None
    kind: ClassVar[str] = "end_value"

    def __post_init__(self) -> None:
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
            result, expected = pair.result, float(pair.reference.values[-1])
            limit = pair.band.half_height + pair.band.local * abs(expected)
        else:
            cut = alone(self.kind, signal, self.tolerance)
            if isinstance(cut, SignalVerdict):
                return cut
            result, expected = cut, self.value
            limit = limit_around(self.tolerance, expected, signal.nominal)
        return judge_number(
            self.kind, result, "the last value", float(result.values[-1]), expected, limit, float(result.time[-1])
        )
