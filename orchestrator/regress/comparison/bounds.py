"""Checks that need no reference: limits that a signal never passes, and quantities that a law keeps."""

from dataclasses import dataclass
from typing import ClassVar, Literal, get_args

import numpy as np

from fmus.errors import MisfitError
from fmus.units import after_number
from orchestrator.regress.comparison.one_number import judge_number
from orchestrator.regress.comparison.prepare import alone
from orchestrator.regress.comparison.signal import (
    Signal,
    SignalVerdict,
    Tolerance,
    limit_around,
    numbers,
    quantity,
    rounded_up,
    seconds,
)


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


Law = Literal["constant", "never_rises", "never_falls"]


@dataclass(frozen=True)
class Conserved:
    """A signal keeps its first value ("constant"), or never rises above or falls below any value it had before.

    Meant for energy, mass or charge, also as an expression of other signals (see `expression.combine`). The tolerance
    is `absolute` + `relative` x (largest |value|); no reference is needed.
    """

    law: Law = "constant"
    tolerance: Tolerance = Tolerance()
    kind: ClassVar[str] = "conserved"
    needs_reference: ClassVar[bool] = False

    def __post_init__(self) -> None:
        if self.law not in get_args(Law):
            raise MisfitError(f"law = {self.law!r}, expected one of {', '.join(get_args(Law))}")

    def judge(self, signal: Signal, reference: Signal | None) -> SignalVerdict:
        """Return the verdict; damaged data are a failed verdict with a reason."""
        result = alone(self.kind, signal, self.tolerance)
        if isinstance(result, SignalVerdict):
            return result
        before = self._expected(result.values)
        leaves = result.values - before
        worst = int(np.argmax(np.abs(leaves)))
        limit = limit_around(self.tolerance, float(np.abs(result.values).max()), result.nominal)
        what = (
            "the value, to stay as it began,"
            if self.law == "constant"
            else f"the value that {self.law.replace('_', ' ')}"
        )
        return judge_number(
            self.kind, result, what, float(result.values[worst]), float(before[worst]), limit, float(result.time[worst])
        )

    def _expected(self, values: np.ndarray) -> np.ndarray:
        """What the law allows nearest to each value, given all values before it, shape (n,)."""
        if self.law == "constant":
            return np.full(len(values), values[0])
        if self.law == "never_rises":
            return np.minimum(values, np.minimum.accumulate(values))
        return np.maximum(values, np.maximum.accumulate(values))
