"""The usual comparison: a result stays within a band around its reference, in value and in time."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from orchestrator.regress.comparison.alignment import align
from orchestrator.regress.comparison.distance import distances
from orchestrator.regress.comparison.envelope import values_at
from orchestrator.regress.comparison.failures import outside_verdict, unseen_verdict
from orchestrator.regress.comparison.jumps import exact_jumps
from orchestrator.regress.comparison.missed import missed
from orchestrator.regress.comparison.prepare import Pair, prepare
from orchestrator.regress.comparison.result import SignalVerdict
from orchestrator.regress.comparison.signal import Signal
from orchestrator.regress.comparison.tolerance import ROUNDING, Tolerance
from orchestrator.regress.comparison.wording import quantity, seconds

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
        return compare(signal, reference, self.tolerance)


def compare(signal: Signal, reference: Signal | None, tolerance: Tolerance) -> SignalVerdict:
    """Judge a result against its reference within a tolerance; see `Tube`.

    Both directions are looked at: the result's samples against the reference's curve and, where the stamps differ, the
    reference's samples against the result's, so that a pulse between two samples of the result is not lost.

    Example:
        >>> time = [0.0, 1.0, 2.0]
        >>> compare(Signal("q", time, [0.0, 1.02, 2.0], "rad"), Signal("q", time, [0.0, 1.0, 2.0]), Tolerance()).reason
        'is off by 0.02 rad at 1 s (1.02 rad, reference 1 rad), 9.9 times the tolerance 0.00202 rad; 1 of 3 samples outside, the first at 1 s; would pass with absolute = 0.018'
    """
    pair = prepare("tube", signal, reference, tolerance)
    if isinstance(pair, SignalVerdict):
        return pair
    return judge_pair(pair, "tube")


def judge_pair(pair: Pair, kind: str, opening_per_s: float = 0.0) -> SignalVerdict:
    """Return the verdict on a pair; the band's half-height grows by `opening_per_s`, the signal's unit a second."""
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
