"""What one check of one signal found."""

import math
from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class SignalVerdict:
    """What one check of one signal found; figures that do not apply are None.

    Args:
        name: the variable.
        passed: whether the check held.
        reason: one line for people, with numbers and units, for passed checks, too.
        check: kind of the check: "tube", "funnel", "pointwise", "events", "end_value", "bounds", "conserved", ...
        unit: unit of all values.
        tolerance: the tolerance used, in words ("0.001 rad, 2 ms").
        worst_time: s, where the result is farthest outside (or nearest to the limit when it passed).
        worst_value: the result there.
        reference_value: the reference there.
        exceed: worst error / tolerance, above 1 for a failure; infinite when no error at all is allowed.
        would_have_passed: smallest absolute tolerance, in `unit` (events: s), with which the check passes.
        would_have_passed_time_shift_s: smallest time shift, s, with which it passes, where there is one.
        event_shift_s: s, the largest shift of an event, positive when the result is late.
        amplitude_error: in `unit`, the largest error left once the events are moved onto each other.
        first_time: s, first sample outside.
        points_outside: how many samples of the result are outside.
        share_outside: their share of all compared samples.
        notes: what a reader should know besides, for example that the tolerance covers the whole range.
    """

    name: str
    passed: bool
    reason: str
    check: str = "tube"
    unit: str = ""
    tolerance: str = ""
    worst_time: float | None = None
    worst_value: float | None = None
    reference_value: float | None = None
    exceed: float | None = None
    would_have_passed: float | None = None
    would_have_passed_time_shift_s: float | None = None
    event_shift_s: float | None = None
    amplitude_error: float | None = None
    first_time: float | None = None
    points_outside: int | None = None
    share_outside: float | None = None
    notes: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Return a mapping fit for JSON: numbers that JSON cannot hold become words ("nan", "inf")."""
        return {key: _plain(value) for key, value in asdict(self).items()}


def _plain(value: Any) -> Any:
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return list(value) if isinstance(value, tuple) else value
