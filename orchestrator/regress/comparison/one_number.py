"""Verdicts on one number: is it within a limit of what is expected?"""

import math

from orchestrator.regress.comparison.result import SignalVerdict
from orchestrator.regress.comparison.signal import Signal
from orchestrator.regress.comparison.wording import quantity, rounded_up, seconds


def judge_number(
    check: str, signal: Signal, what: str, value: float, expected: float, limit: float, when: float
) -> SignalVerdict:
    """Return whether |value - expected| <= limit, all in the signal's unit, as a verdict at the time `when`, s."""
    error = abs(value - expected)
    passed = error <= limit * (1 + 1e-7)
    tolerance = quantity(limit, signal.unit)
    found = f"{what} is {quantity(value, signal.unit)} at {seconds(when)}, expected {quantity(expected, signal.unit)}"
    needed = error if passed else rounded_up(error)
    outcome = (
        f"within {tolerance}"
        if passed
        else f"off by {quantity(error, signal.unit)}, tolerance {tolerance}; would pass with a tolerance of {needed:g}"
    )
    return SignalVerdict(
        name=signal.name,
        passed=passed,
        reason=f"{found}: {outcome}",
        check=check,
        unit=signal.unit,
        tolerance=tolerance,
        worst_time=when,
        worst_value=value,
        reference_value=expected,
        exceed=error / limit if limit else (math.inf if error else 0.0),
        would_have_passed=needed,
        amplitude_error=error,
    )
