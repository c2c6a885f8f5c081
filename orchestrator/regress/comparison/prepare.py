"""A signal and its reference made ready for numbers: checked for damage, cut to the compared window."""

from dataclasses import dataclass, replace

import numpy as np

from orchestrator.regress.comparison.defects import coverage_defect, defect, unit_defect, window_defect
from orchestrator.regress.comparison.envelope import values_at
from orchestrator.regress.comparison.result import SignalVerdict
from orchestrator.regress.comparison.signal import Signal
from orchestrator.regress.comparison.tolerance import Band, Tolerance, band

_NO_SAMPLE = "the result has no sample in the compared window; record more often"


@dataclass(frozen=True, eq=False)
class Pair:
    """A result and its reference over the compared window, without defects, and the band around the reference.

    `reference` ends where the window ends; `around` holds what the time shift reaches beyond it, too.
    `excuses_sampling` lets a sample next to a jump between two reference samples lie anywhere between them, and one
    between two reference samples where the reference's curve may bend to.
    """

    result: Signal
    reference: Signal
    around: Signal
    band: Band
    excuses_sampling: bool = True

    @property
    def same_grid(self) -> bool:
        """Whether both have the same stamps, so that samples can be compared one by one."""
        one, other = self.result.time, self.around.time
        return one.shape == other.shape and np.array_equal(one, other)


def prepare(check: str, signal: Signal, reference: Signal | None, tolerance: Tolerance) -> Pair | SignalVerdict:
    """Return the pair to compare, or a failed verdict that says why nothing can be compared."""
    reason = pair_defect(signal, reference, tolerance)
    if reason is not None or reference is None:
        return SignalVerdict(signal.name, False, reason or "", check, signal.unit)
    result = cut(signal, tolerance)
    if not len(result.time):
        return SignalVerdict(signal.name, False, _NO_SAMPLE, check, signal.unit)
    known = replace(
        reference,
        unit=reference.unit or signal.unit,
        nominal=reference.nominal if reference.nominal is not None else signal.nominal,
    )
    expected = cut(known, tolerance, keep_edges=True)
    return Pair(result, expected, _around(known, tolerance), band(tolerance, expected))


def _around(reference: Signal, tolerance: Tolerance) -> Signal:
    """The reference over the window and as far beyond it as the time shift reaches."""
    start, end, shift = tolerance.from_s, tolerance.until_s, tolerance.time_shift_s
    wider = replace(
        tolerance,
        from_s=None if start is None else max(start - shift, float(reference.time[0])),
        until_s=None if end is None else min(end + shift, float(reference.time[-1])),
    )
    return cut(reference, wider, keep_edges=True)


def alone(check: str, signal: Signal, tolerance: Tolerance) -> Signal | SignalVerdict:
    """Return a signal cut to the compared window, or a failed verdict that says why there is nothing to judge."""
    reason = tolerance.refusal() or defect(signal, "the result") or window_defect(signal, tolerance)
    if reason is not None:
        return SignalVerdict(signal.name, False, reason, check, signal.unit)
    result = cut(signal, tolerance)
    if not len(result.time):
        return SignalVerdict(signal.name, False, _NO_SAMPLE, check, signal.unit)
    return result


def pair_defect(signal: Signal, reference: Signal | None, tolerance: Tolerance) -> str | None:
    """Return why a signal and its reference cannot be compared, or None."""
    if reference is None:
        return "there is no reference; make one with --update or name one in the case"
    return (
        tolerance.refusal()
        or defect(signal, "the result")
        or defect(reference, "the reference")
        or unit_defect(signal, reference)
        or coverage_defect(signal, reference, tolerance)
    )


def cut(signal: Signal, tolerance: Tolerance, keep_edges: bool = False) -> Signal:
    """Return a signal within the tolerance's window; `keep_edges` adds the interpolated values at its ends."""
    if tolerance.from_s is None and tolerance.until_s is None:
        return signal
    start = signal.time[0] if tolerance.from_s is None else tolerance.from_s
    end = signal.time[-1] if tolerance.until_s is None else tolerance.until_s
    kept = (signal.time >= start) & (signal.time <= end)
    time, values = signal.time[kept], signal.values[kept]
    if keep_edges:
        first, last = values_at(signal.time, signal.values, np.array([start, end]), signal.interpolation)
        if not len(time) or time[0] > start:
            time, values = np.append(start, time), np.append(first, values)
        if time[-1] < end:
            time, values = np.append(time, end), np.append(values, last)
    return replace(signal, time=time, values=values)
