"""Why a result left its tube, where the worst is, and what would have let it pass."""

from dataclasses import replace

import numpy as np

from orchestrator.regress.comparison.alignment import Alignment, align, amplitude_error
from orchestrator.regress.comparison.distance import window_distances
from orchestrator.regress.comparison.envelope import values_at
from orchestrator.regress.comparison.missed import missed
from orchestrator.regress.comparison.prepare import Pair
from orchestrator.regress.comparison.result import SignalVerdict
from orchestrator.regress.comparison.tolerance import ROUNDING
from orchestrator.regress.comparison.wording import quantity, rounded_up, seconds


def outside_verdict(pair: Pair, verdict: SignalVerdict, found: np.ndarray, too_far: np.ndarray) -> SignalVerdict:
    """Return the verdict on a result with samples outside; `found` are their distances, `too_far` which they are, (n,)."""
    outside = np.flatnonzero(too_far)
    jumps = align(pair)
    left = amplitude_error(pair, jumps) if jumps.shift_s else None
    needed = rounded_up(verdict.would_have_passed or 0.0)
    shift = _needed_shift(pair, jumps, left, outside)
    first = float(pair.result.time[outside[0]])
    unit = pair.reference.unit
    reason = (
        f"is off by {quantity(float(found.max()), unit)} at {seconds(verdict.worst_time or 0.0)} "
        f"({quantity(verdict.worst_value or 0.0, unit)}, reference {quantity(verdict.reference_value or 0.0, unit)}), "
        f"{verdict.exceed:.3g} times the tolerance {pair.band.text}; {len(outside)} of {len(found)} samples outside, "
        f"the first at {seconds(first)}; would pass with absolute = {needed:g}"
    )
    return replace(
        verdict,
        reason=reason + _jumps_text(jumps, left, unit, shift),
        would_have_passed=needed,
        would_have_passed_time_shift_s=shift,
        event_shift_s=jumps.shift_s,
        amplitude_error=verdict.amplitude_error if left is None else left,
        first_time=first,
        points_outside=len(outside),
        share_outside=len(outside) / len(found),
    )


def _needed_shift(pair: Pair, jumps: Alignment, left: float | None, outside: np.ndarray) -> float | None:
    """The time shift with which a result passes that is right but for the moments of its jumps, or None."""
    if left is None or jumps.shift_s is None or left > pair.band.limit:
        return None
    # Moved back by as much, every sample is within the old shift of where it belongs; mostly less will do.
    for shift in (abs(jumps.shift_s), abs(jumps.shift_s) + pair.band.half_width):
        needed = rounded_up(shift)
        wider = replace(pair, band=replace(pair.band, half_width=needed * (1 + ROUNDING)))
        if (window_distances(wider, outside, pair.band.limit) <= pair.band.limit).all() and not len(missed(wider)[0]):
            return needed
    return None


def _jumps_text(jumps: Alignment, left: float | None, unit: str, shift: float | None) -> str:
    if len(jumps.found) != len(jumps.due):
        return f"; it jumps {len(jumps.found)} times, the reference {len(jumps.due)} times"
    if not jumps.shift_s or left is None:
        return ""
    side = "late" if jumps.shift_s > 0 else "early"
    return (
        f"; its jumps come up to {seconds(abs(jumps.shift_s))} {side} (at {seconds(jumps.due[jumps.worst])}), and moved "
        f"onto the reference's they leave an error of {quantity(left, unit)}"
        + ("" if shift is None else f"; or would pass with time_shift_s = {shift:g}")
    )


def unseen_verdict(pair: Pair, verdict: SignalVerdict, unseen: np.ndarray, amounts: np.ndarray) -> SignalVerdict:
    """Return the verdict on a result that steps over the samples `unseen` of its reference, by `amounts`, (m,) each."""
    reference, unit = pair.reference, pair.reference.unit
    worst = int(np.argmax(amounts))
    when, value = float(reference.time[unseen[worst]]), float(reference.values[unseen[worst]])
    near = float(values_at(pair.result.time, pair.result.values, np.array([when]), pair.result.interpolation)[0])
    needed = rounded_up(max(0.0, float(amounts[worst]) - pair.band.relative_part))
    reason = (
        f"the reference is {quantity(value, unit)} at {seconds(when)}, where the result, without a sample there, passes "
        f"{quantity(near, unit)}; {len(unseen)} reference samples are missed: record more often, or at events; "
        f"would pass with absolute = {needed:g}"
    )
    jumps = align(pair)
    left = amplitude_error(pair, jumps) if jumps.shift_s else None
    shift = _needed_shift(pair, jumps, left, np.zeros(0, dtype=int))
    return replace(
        verdict,
        reason=reason + _jumps_text(jumps, left, unit, shift),
        would_have_passed_time_shift_s=shift,
        event_shift_s=jumps.shift_s,
        amplitude_error=verdict.amplitude_error if left is None else left,
        worst_time=when,
        worst_value=near,
        reference_value=value,
        exceed=float(amounts[worst]) / pair.band.half_height if pair.band.half_height else np.inf,
        would_have_passed=needed,
        first_time=float(reference.time[unseen[0]]),
    )
