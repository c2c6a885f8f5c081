"""The usual comparison: a result stays within a band around its reference, in value and in time."""

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from orchestrator.regress.comparison.distance import (
    SHORT_STEP,
    Alignment,
    align,
    amplitude_error,
    bends,
    distances,
    exact_jumps,
    window_distances,
)
from orchestrator.regress.comparison.prepare import Pair, prepare, values_at, window_range
from orchestrator.regress.comparison.signal import (
    ROUNDING,
    Signal,
    SignalVerdict,
    Tolerance,
    quantity,
    rounded_up,
    seconds,
)


def missed(pair: Pair) -> tuple[np.ndarray, np.ndarray]:
    """Return the indices of reference samples that the result, between its own samples, cannot have followed.

    With them comes by how much the result missed each, in the signal's unit, before any tolerance. A result may leave
    the line between two samples by what its curve bends there, and it may have been anywhere between the two; when it
    holds its values, only within a short step. A pulse that begins and ends between two samples is outside that.
    """
    result, reference, limit = pair.result, pair.reference, pair.band.limit
    if pair.same_grid:
        return np.zeros(0, dtype=int), np.zeros(0)
    inside = (reference.time >= result.time[0]) & (reference.time <= result.time[-1])
    found = values_at(result.time, result.values, reference.time, result.interpolation)
    allowed = limit + pair.band.local * np.abs(reference.values)
    far = np.flatnonzero(inside & ~(np.abs(found - reference.values) <= allowed))
    if not len(far):
        return far, np.zeros(0)
    low, high = _reach(result, reference.time[far], pair.band.half_width)
    amount = np.maximum(reference.values[far] - high, low - reference.values[far])
    lost = ~(amount <= allowed[far])
    return far[lost], amount[lost]


def _reach(result: Signal, time: np.ndarray, shift: float) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest value that the result may have had around each time, shape (m,) each."""
    low, high = window_range(
        result.time, result.values, result.values, time - shift, time + shift, result.interpolation
    )
    bent = bends(result.values)
    linear = result.interpolation == "linear"
    longest = np.inf if linear else SHORT_STEP * (result.time[-1] - result.time[0])
    # A time that is a stamp of the result touches the steps on both sides of it.
    for side in ("left", "right"):
        other = np.clip(np.searchsorted(result.time, time, side), 1, len(result.time) - 1)
        one = other - 1
        short = result.time[other] - result.time[one] <= longest
        bend = np.maximum(bent[one], bent[other]) if linear else 0.0
        ends = result.values[one], result.values[other]
        low = np.where(short, np.minimum(low, np.minimum(*ends) - bend), low)
        high = np.where(short, np.maximum(high, np.maximum(*ends) + bend), high)
    return low, high


def outside_verdict(pair: Pair, verdict: SignalVerdict, found: np.ndarray, too_far: np.ndarray) -> SignalVerdict:
    """Return the verdict on a result with samples outside; `found` are their distances, `too_far` which they are, (n,).

    Args:
        pair: result and reference.
        verdict: its figures.
        found: distances (n,) in the signal's unit.
        too_far: which samples (n,) are outside.
    """
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
    """Return the verdict on a result that steps over the samples `unseen` of its reference, by `amounts`, (m,) each.

    Args:
        pair: result and reference.
        verdict: its figures.
        unseen: numbers of the reference's samples, (m,).
        amounts: how far the result is from them, (m,), in the signal's unit.
    """
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


# A band this large a share of the reference's range sees little of what it is meant to watch.
WIDE_BAND = 0.1


@dataclass(frozen=True)
class Tube:
    """A result stays within [min, max] of its reference over t +- time shift, widened by the tolerance in value."""

    tolerance: Tolerance = Tolerance()
    kind: ClassVar[str] = "tube"
    needs_reference: ClassVar[bool] = True

    def judge(self, signal: Signal, reference: Signal | None) -> SignalVerdict:
        """Return the verdict; damaged data are a failed verdict with a reason."""
        return compare_signals(signal, reference, self.tolerance)


def compare_signals(signal: Signal, reference: Signal | None, tolerance: Tolerance) -> SignalVerdict:
    """Judge a result against its reference within a tolerance; see `Tube`.

    Both directions are looked at: the result's samples against the reference's curve and, where the stamps differ, the
    reference's samples against the result's, so that a pulse between two samples of the result is not lost.

    Args:
        signal: the result.
        reference: the reference, None if there is none.
        tolerance: the tolerance.

    Returns:
        The verdict; one that failed says why, also where nothing can be compared.

    Example:
        >>> time = [0.0, 1.0, 2.0]
        >>> compare_signals(Signal("q", time, [0.0, 1.02, 2.0], "rad"), Signal("q", time, [0.0, 1.0, 2.0]), Tolerance()).reason
        'is off by 0.02 rad at 1 s (1.02 rad, reference 1 rad), 9.9 times the tolerance 0.00202 rad; 1 of 3 samples outside, the first at 1 s; would pass with absolute = 0.018'
    """
    pair = prepare("tube", signal, reference, tolerance)
    if isinstance(pair, SignalVerdict):
        return pair
    return judge_pair(pair, "tube")


def judge_pair(pair: Pair, kind: str, opening_per_s: float = 0.0) -> SignalVerdict:
    """Return the verdict on a pair; the band's half-height grows by `opening_per_s`, the signal's unit a second.

    Args:
        pair: result and reference.
        kind: name of the check.
        opening_per_s: growth of the band's half-height.
    """
    half_height = np.asarray(pair.band.half_height)
    if opening_per_s:
        half_height = half_height + opening_per_s * np.clip(pair.result.time - pair.reference.time[0], 0.0, None)
    found, too_far = distances(pair, half_height * (1 + ROUNDING))
    outside = int(np.count_nonzero(too_far))
    worst = _worst(found, half_height)
    verdict = _figures(pair, kind, found, half_height, worst)
    if outside:
        return outside_verdict(pair, verdict, found, too_far)
    unseen, amounts = missed(pair)
    if len(unseen):
        return unseen_verdict(pair, verdict, unseen, amounts)
    error = quantity(float(found[worst]), pair.reference.unit)
    reason = f"largest error {error} at {seconds(pair.result.time[worst])}, tolerance {pair.band.text}"
    return replace(verdict, passed=True, reason=reason)


def _worst(found: np.ndarray, half_height: np.ndarray) -> int:
    if half_height.ndim == 0:
        return int(np.argmax(found))
    with np.errstate(all="ignore"):
        return int(np.argmax(np.nan_to_num(found / half_height, nan=0.0)))


def _figures(pair: Pair, kind: str, found: np.ndarray, half_height: np.ndarray, worst: int) -> SignalVerdict:
    """A verdict with its figures, not yet passed."""
    result, reference = pair.result, pair.reference
    error = float(found[worst])
    height = float(half_height if half_height.ndim == 0 else half_height[worst])
    when = result.time[worst]
    expected = values_at(reference.time, reference.values, np.array([when]), reference.interpolation)[0]
    events = result.interpolation == "hold" or len(exact_jumps(reference))
    return SignalVerdict(
        name=result.name,
        passed=False,
        reason="",
        check=kind,
        unit=reference.unit,
        tolerance=pair.band.text,
        worst_time=float(when),
        worst_value=float(result.values[worst]),
        reference_value=float(expected),
        exceed=error / height if height else (np.inf if error else 0.0),
        would_have_passed=max(0.0, error - (height - pair.band.half_height) - pair.band.relative_part),
        amplitude_error=error,
        event_shift_s=align(pair).shift_s if events else None,
        points_outside=0,
        share_outside=0.0,
        notes=_notes(pair),
    )


def _notes(pair: Pair) -> tuple[str, ...]:
    size = float(np.ptp(pair.reference.values))
    if 0 < size * WIDE_BAND < pair.band.half_height:
        share = pair.band.half_height / size
        return (
            f"the tolerance is {share:.0%} of the reference's range: smaller changes are not seen; give absolute, or a nominal size",
        )
    return ()


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
