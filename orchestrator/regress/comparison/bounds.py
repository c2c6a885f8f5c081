"""Limits that a signal never passes."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from fmus.errors import MisfitError
from fmus.units import after_number
from orchestrator.regress.comparison.figures import numbers
from orchestrator.regress.comparison.prepare import alone
from orchestrator.regress.comparison.result import SignalVerdict
from orchestrator.regress.comparison.signal import Signal
from orchestrator.regress.comparison.tolerance import Tolerance
from orchestrator.regress.comparison.wording import quantity, rounded_up, seconds


@dataclass(frozen=True)
class Bounds:
    """Every sample lies in [lower, upper], in the signal's unit; `absolute` more is let through, 0 where none is given.

    No reference is needed; `relative`, `local` and `time_shift_s` do not count.
    """

    lower: float | None = None
    upper: float | None = None
    tolerance: Tolerance = Tolerance()
    kind: ClassVar[str] = "bounds"
    needs_reference: ClassVar[bool] = False

    def __post_init__(self) -> None:
        numbers(lower=self.lower, upper=self.upper)
        low, high = self._limits
        if not (low <= high and (np.isfinite(low) or np.isfinite(high))):
            raise MisfitError(
                f"bounds [{low:g}, {high:g}] hold every value or none; give lower, upper or both, in order"
            )

    @property
    def _limits(self) -> tuple[float, float]:
        low = -np.inf if self.lower is None else self.lower
        return low, np.inf if self.upper is None else self.upper

    def judge(self, signal: Signal, reference: Signal | None) -> SignalVerdict:
        """Return the verdict; damaged data are a failed verdict with a reason."""
        result = alone(self.kind, signal, self.tolerance)
        if isinstance(result, SignalVerdict):
            return result
        low, high = self._limits
        beyond = np.maximum(result.values - high, low - result.values)
        worst = int(np.argmax(beyond))
        allowed = self.tolerance.absolute or 0.0
        outside = np.flatnonzero(~(beyond <= allowed))
        error, value = max(0.0, float(beyond[worst])), float(result.values[worst])
        needed = rounded_up(error) if len(outside) else error
        where = f"{quantity(value, result.unit)} at {seconds(result.time[worst])}"
        limits = f"[{low:g}, {high:g}]{after_number(result.unit)}"
        passed = not len(outside)
        reason = (
            f"stays within {limits}, nearest to a limit with {where}"
            if passed
            else f"is {where}, outside {limits} by {quantity(error, result.unit)}; {len(outside)} of {len(beyond)} samples "
            f"outside, the first at {seconds(result.time[outside[0]])}; would pass with absolute = {needed:g}"
        )
        return SignalVerdict(
            name=result.name,
            passed=passed,
            reason=reason,
            check=self.kind,
            unit=result.unit,
            tolerance=limits,
            worst_time=float(result.time[worst]),
            worst_value=value,
            exceed=error / allowed if allowed else (np.inf if error else 0.0),
            would_have_passed=needed,
            amplitude_error=error,
            first_time=None if passed else float(result.time[outside[0]]),
            points_outside=len(outside),
            share_outside=len(outside) / len(beyond),
        )
