"""A result and its reference, cut to what is compared; and what is wrong with them before any number is compared."""

from dataclasses import dataclass, replace

import numpy as np

from orchestrator.regress.comparison.signal import Band, Interpolation, Signal, SignalVerdict, Tolerance, band, seconds


def range_extremes(
    low: np.ndarray, high: np.ndarray, first: np.ndarray, stop: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return min(low[first:stop]) and max(high[first:stop]) for each range; infinite for an empty one.

    Few short ranges are looked at sample by sample. Otherwise a sparse table (Bender and Farach-Colton, 2000) that
    keeps one level at a time covers each range by two overlapping blocks of 2^k samples, so that it costs
    O(n log(longest range)), whatever the grid.

    Args:
        low, high: shape (n,), without NaN.
        first, stop: shape (m,), indices into them, 0 <= first, stop <= n.

    Returns:
        Two arrays of shape (m,).

    Example:
        >>> import numpy as np
        >>> range_extremes(np.array([3.0, 1.0, 2.0]), np.array([3.0, 1.0, 2.0]), np.array([0, 2]), np.array([2, 2]))
        (array([ 1., inf]), array([  3., -inf]))
    """
    smallest = np.full(first.shape, np.inf)
    largest = np.full(first.shape, -np.inf)
    length = stop - first
    some = np.flatnonzero(length > 0)
    if len(some) and length[some].sum() <= len(low):
        _by_sample(low, high, first[some], length[some], some, smallest, largest)
    elif len(some):
        _by_table(low, high, first, stop, smallest, largest)
    return smallest, largest


def _by_sample(
    low: np.ndarray,
    high: np.ndarray,
    first: np.ndarray,
    length: np.ndarray,
    which: np.ndarray,
    smallest: np.ndarray,
    largest: np.ndarray,
) -> None:
    """Fill in the answers `which` from all samples of their ranges, none of them empty."""
    begins = np.cumsum(length) - length
    samples = np.arange(length.sum()) + np.repeat(first - begins, length)
    smallest[which] = np.minimum.reduceat(low[samples], begins)
    largest[which] = np.maximum.reduceat(high[samples], begins)


def _by_table(
    low: np.ndarray, high: np.ndarray, first: np.ndarray, stop: np.ndarray, smallest: np.ndarray, largest: np.ndarray
) -> None:
    """Fill in the answers of all ranges that are not empty."""
    # frexp gives length = fraction * 2**exponent with 0.5 <= fraction < 1, so that 2**(exponent - 1) <= length.
    level = np.where(stop > first, np.frexp(stop - first)[1] - 1, -1)
    for k in range(int(level.max()) + 1):
        here = np.flatnonzero(level == k)
        if len(here):
            begin, end = first[here], stop[here] - 2**k
            smallest[here] = np.minimum(low[begin], low[end])
            largest[here] = np.maximum(high[begin], high[end])
        low = np.minimum(low[: -(2**k)], low[2**k :])
        high = np.maximum(high[: -(2**k)], high[2**k :])


def values_at(time: np.ndarray, values: np.ndarray, query: np.ndarray, interpolation: Interpolation) -> np.ndarray:
    """Return one value of a curve at each queried time, shape (m,); at an event, one of those it has there.

    Before the first and after the last sample the nearest sample counts.

    Args:
        time: samples (n,) in s.
        values: (n,).
        query: times (m,) in s.
        interpolation: "linear" or "hold".
    """
    if interpolation == "hold":
        return values[np.clip(np.searchsorted(time, query, "right") - 1, 0, None)]
    return np.interp(query, time, values)


def window_range(
    time: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
    begin: np.ndarray,
    end: np.ndarray,
    interpolation: Interpolation,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the smallest value of one curve and the largest of another within each window.

    A curve runs in straight lines from sample to sample ("linear") or keeps each sample until the next ("hold"). Where
    a stamp occurs twice the curve runs up or down a vertical line, and a window that holds the stamp holds both values.
    Windows beyond either end see the nearest sample.

    Args:
        time: shape (n,), s, never falling.
        low, high: shape (n,), the two curves; the same array twice for the range of one curve.
        begin, end: shape (m,), s, begin <= end.
        interpolation: how both curves run between samples.

    Returns:
        Smallest and largest values, shape (m,) each.
    """
    first = np.minimum(np.searchsorted(time, begin, "left"), len(time) - 1)
    stop = np.maximum(np.searchsorted(time, end, "right"), 1)
    smallest, largest = range_extremes(low, high, first, stop)
    if interpolation == "hold":
        # A sample that lies on the window's begin has already replaced the one before it.
        held = np.where(time[first] > begin, np.maximum(first - 1, 0), first)
        return np.minimum(smallest, low[held]), np.maximum(largest, high[held])
    for edge in (begin, end):
        at_edge = np.interp(edge, time, low)
        smallest = np.minimum(smallest, at_edge)
        largest = np.maximum(largest, at_edge if high is low else np.interp(edge, time, high))
    return smallest, largest


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
    """Return why the two do not cover the same time, or None; both without other defects.

    Args:
        signal: the result.
        reference: the reference.
        tolerance: with the window that is compared.
    """
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
    """Return the pair to compare, or a failed verdict that says why nothing can be compared.

    Args:
        check: name of the check.
        signal: the result.
        reference: the reference, None if there is none.
        tolerance: with the window that is compared.
    """
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
    """Return a signal cut to the compared window, or a failed verdict that says why there is nothing to judge.

    Args:
        check: name of the check.
        signal: the result.
        tolerance: with the window that is judged.
    """
    reason = tolerance.refusal() or defect(signal, "the result") or window_defect(signal, tolerance)
    if reason is not None:
        return SignalVerdict(signal.name, False, reason, check, signal.unit)
    result = cut(signal, tolerance)
    if not len(result.time):
        return SignalVerdict(signal.name, False, _NO_SAMPLE, check, signal.unit)
    return result


def pair_defect(signal: Signal, reference: Signal | None, tolerance: Tolerance) -> str | None:
    """Return why a signal and its reference cannot be compared, or None.

    Args:
        signal: the result.
        reference: the reference, None if there is none.
        tolerance: with the window that is compared.
    """
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
    """Return a signal within the tolerance's window; `keep_edges` adds the interpolated values at its ends.

    Args:
        signal: the signal.
        tolerance: with the window.
        keep_edges: whether the ends of the window become samples.
    """
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
