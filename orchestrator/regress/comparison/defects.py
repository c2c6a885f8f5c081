"""What is wrong with a signal before any number is compared: each of these would otherwise pass in silence."""

import numpy as np

from orchestrator.regress.comparison.signal import Signal
from orchestrator.regress.comparison.tolerance import Tolerance
from orchestrator.regress.comparison.wording import seconds

# Values before, during and after an event; more of the same stamp is a clock that stands still.
MOST_EQUAL_STAMPS = 3
# A record that ends this share of the compared time early or late has been written with rounded stamps.
END_SHARE = 1e-6


def defect(signal: Signal, who: str) -> str | None:
    """Return why a signal cannot be compared, or None; `who` is "the result" or "the reference"."""
    time, values = signal.time, signal.values
    if time.ndim != 1 or time.shape != values.shape:
        return f"{who} has {_shape(values)} values for {_shape(time)} time stamps; every sample needs one of each"
    if len(time) == 0:
        return f"{who} is empty; check that the run wrote its output"
    if not np.isfinite(time).all():
        k = int(np.flatnonzero(~np.isfinite(time))[0])
        return f"{who} has the time stamp {time[k]} in sample {k + 1}; time must be a number"
    return _time_defect(time, who) or _value_defect(signal, who)


def _time_defect(time: np.ndarray, who: str) -> str | None:
    steps = np.diff(time)
    if len(steps) and steps.min() < 0:
        k = int(np.argmax(steps < 0))
        return f"time of {who} goes back from {seconds(time[k])} to {seconds(time[k + 1])}; a record must run forwards"
    still = MOST_EQUAL_STAMPS
    if len(time) > still and (stuck := time[still:] == time[:-still]).any():
        k = int(np.argmax(stuck))
        return f"the time stamp {seconds(time[k])} of {who} occurs more than {still} times; its clock stands still"
    return None


def _value_defect(signal: Signal, who: str) -> str | None:
    # The sum is finite only if all values are; it is several times cheaper than a test of each.
    with np.errstate(all="ignore"):
        if np.isfinite(signal.values.sum()):
            return None
    bad = np.flatnonzero(~np.isfinite(signal.values))
    if not len(bad):
        return None
    k = int(bad[0])
    share = f"{len(bad)} of {len(signal.values)} samples"
    return f"{who} is {signal.values[k]} at {seconds(signal.time[k])} ({share}); nothing can be said about it"


def coverage_defect(signal: Signal, reference: Signal, tolerance: Tolerance) -> str | None:
    """Return why the two do not cover the same time, or None; both without other defects."""
    start = reference.time[0] if tolerance.from_s is None else tolerance.from_s
    end = reference.time[-1] if tolerance.until_s is None else tolerance.until_s
    slack = max(tolerance.time_shift_s, END_SHARE * (reference.time[-1] - reference.time[0]))
    if end < start or start > reference.time[-1] + slack or end < reference.time[0] - slack:
        return f"nothing is compared between {seconds(start)} and {seconds(end)}; the reference goes from {_span(reference)}"
    if end > reference.time[-1] + slack or start < reference.time[0] - slack:
        return (
            f"the reference goes from {_span(reference)}, shorter than the compared {seconds(start)} to {seconds(end)}"
        )
    if signal.time[-1] < end - slack:
        return f"the result ends at {seconds(signal.time[-1])}, before {seconds(end)}; the run stopped early"
    if signal.time[0] > start + slack:
        return f"the result begins at {seconds(signal.time[0])}, after {seconds(start)}; its begin is missing"
    return _excess(signal, reference, tolerance, slack)


def _excess(signal: Signal, reference: Signal, tolerance: Tolerance, slack: float) -> str | None:
    """Parts of a result that no reference covers; a window that the case states cuts them off."""
    if tolerance.until_s is None and signal.time[-1] > reference.time[-1] + slack:
        return (
            f"the result goes on to {seconds(signal.time[-1])}, the reference ends at {seconds(reference.time[-1])}; "
            "nothing would check the rest: set the stop time or until_s"
        )
    if tolerance.from_s is None and signal.time[0] < reference.time[0] - slack:
        return (
            f"the result begins at {seconds(signal.time[0])}, the reference at {seconds(reference.time[0])}; "
            "nothing would check the begin: set from_s"
        )
    return None


def window_defect(signal: Signal, tolerance: Tolerance) -> str | None:
    """Return why a signal does not cover the window that a tolerance states, or None."""
    slack = max(tolerance.time_shift_s, END_SHARE * (signal.time[-1] - signal.time[0]))
    if tolerance.until_s is not None and signal.time[-1] < tolerance.until_s - slack:
        return (
            f"the result ends at {seconds(signal.time[-1])}, before {seconds(tolerance.until_s)}; the run stopped early"
        )
    if tolerance.from_s is not None and tolerance.from_s > signal.time[-1] + slack:
        return (
            f"the result ends at {seconds(signal.time[-1])}, before {seconds(tolerance.from_s)}; the run stopped early"
        )
    return None


def unit_defect(signal: Signal, reference: Signal) -> str | None:
    """Return why the units do not fit, or None; an unknown unit fits every other."""
    if signal.unit == reference.unit or not signal.unit or not reference.unit:
        return None
    return f"the result is in {signal.unit}, the reference in {reference.unit}; give both in one unit"


def _span(signal: Signal) -> str:
    return f"{seconds(signal.time[0])} to {seconds(signal.time[-1])}"


def _shape(values: np.ndarray) -> str:
    return " x ".join(map(str, values.shape)) or "no"
