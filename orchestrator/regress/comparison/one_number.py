"""Checks of one number of a signal: a statistic, its last value, where it comes to rest."""

import math
from dataclasses import dataclass, replace
from typing import ClassVar, Literal, get_args

import numpy as np

from fmus.errors import MisfitError
from orchestrator.regress.comparison.prepare import Pair, alone, cut, prepare
from orchestrator.regress.comparison.signal import (
    Signal,
    SignalVerdict,
    Tolerance,
    at_least,
    limit_around,
    numbers,
    quantity,
    rounded_up,
    seconds,
)


def judge_number(
    check: str, signal: Signal, what: str, value: float, expected: float, limit: float, when: float
) -> SignalVerdict:
    """Return whether |value - expected| <= limit, all in the signal's unit, as a verdict at the time `when`, s.

    Args:
        check: name of the check.
        signal: the signal, for its name and unit.
        what: what the number is, in words.
        value: the number found.
        expected: the number expected.
        limit: how far they may be apart.
        when: time of the value, in s.
    """
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


def mean_and_spread(signal: Signal) -> tuple[float, float]:
    """Return the mean over time of a signal and its standard deviation about it, both in its unit.

    The curve between samples counts, straight or held, so that the sampling does not matter: exact integrals, for a
    straight piece from a to b of (a + b) / 2 and of (a^2 + a b + b^2) / 3. Of a single moment the plain figures.

    Example:
        >>> mean, spread = mean_and_spread(Signal("x", [0.0, 1.0, 3.0], [0.0, 3.0, 3.0], interpolation="hold"))
        >>> mean, round(spread**2, 9)
        (2.0, 2.0)
    """
    duration = signal.time[-1] - signal.time[0]
    low, high = float(signal.values.min()), float(signal.values.max())
    # Shares of the range around its middle keep the digits of a small range far from zero, and squares in bounds.
    middle, half = low / 2 + high / 2, (high / 2 - low / 2) or 1.0
    values = (signal.values - middle) / half
    if duration <= 0:
        return float(values.mean() * half + middle), float(values.std() * half)
    steps = np.diff(signal.time) / duration
    left, right = values[:-1], values[:-1] if signal.interpolation == "hold" else values[1:]
    mean = float(steps @ (left + right)) / 2
    square = float(steps @ (left * left + left * right + right * right)) / 3
    return mean * half + middle, float(np.sqrt(max(0.0, square - mean * mean))) * half


Quantity = Literal["mean", "spread", "lowest", "highest"]
USUAL: tuple[Quantity, ...] = ("mean", "spread")


@dataclass(frozen=True)
class Statistics:
    """In each window the mean over time, the standard deviation, the lowest and highest value are near the reference's.

    The tolerance is the tube's: `absolute` + `relative` x (range of the reference); a time shift does not count.

    Args:
        window_s: s, length of each window; 0 for one window over everything. A rest shorter than half a window belongs
            to the window before it.
        quantities: which of "mean", "spread", "lowest" and "highest".
    """

    window_s: float = 0.0
    quantities: tuple[Quantity, ...] = USUAL
    tolerance: Tolerance = Tolerance(relative=0.05)
    kind: ClassVar[str] = "statistics"
    needs_reference: ClassVar[bool] = True

    def __post_init__(self) -> None:
        at_least(0.0, window_s=self.window_s)
        wrong = [name for name in self.quantities if name not in get_args(Quantity)]
        if wrong or not self.quantities:
            raise MisfitError(f"quantities = {list(self.quantities)}, expected some of {', '.join(get_args(Quantity))}")

    def judge(self, signal: Signal, reference: Signal | None) -> SignalVerdict:
        """Return the verdict on the worst window and quantity; damaged data are a failed verdict with a reason."""
        pair = prepare(self.kind, signal, reference, self.tolerance)
        if isinstance(pair, SignalVerdict):
            return pair
        verdicts = [
            self._judge_window(pair, begin, end, quantity)
            for begin, end in self._windows(pair.reference)
            for quantity in self.quantities
        ]
        worst = max(verdicts, key=lambda each: each.amplitude_error or 0.0)
        failed = [each for each in verdicts if not each.passed]
        return replace(worst, points_outside=len(failed), share_outside=len(failed) / len(verdicts))

    def _windows(self, reference: Signal) -> list[tuple[float, float]]:
        begin, end = float(reference.time[0]), float(reference.time[-1])
        count = 1 if not self.window_s else max(1, round((end - begin) / self.window_s))
        edges = [*(begin + self.window_s * k for k in range(count)), end]
        return list(zip(edges[:-1], edges[1:], strict=True))

    def _judge_window(self, pair: Pair, begin: float, end: float, quantity: Quantity) -> SignalVerdict:
        window = Tolerance(from_s=begin, until_s=end)
        found = _figure(cut(pair.result, window, keep_edges=True), quantity)
        expected = _figure(cut(pair.reference, window, keep_edges=True), quantity)
        what = f"the {quantity} from {seconds(begin)} to {seconds(end)}"
        return judge_number(self.kind, pair.result, what, found, expected, pair.band.half_height, end)


def _figure(signal: Signal, quantity: Quantity) -> float:
    if quantity == "lowest":
        return float(np.min(signal.values))
    if quantity == "highest":
        return float(np.max(signal.values))
    return mean_and_spread(signal)[0 if quantity == "mean" else 1]


@dataclass(frozen=True)
class EndValue:
    """The last value is near `value`, in the signal's unit, or near the reference's last value when none is given."""

    tolerance: Tolerance = Tolerance()
    value: float | None = None
    kind: ClassVar[str] = "end_value"

    def __post_init__(self) -> None:
        numbers(value=self.value)

    @property
    def needs_reference(self) -> bool:
        """Whether `judge` fails without a reference."""
        return self.value is None

    def judge(self, signal: Signal, reference: Signal | None) -> SignalVerdict:
        """Return the verdict; damaged data are a failed verdict with a reason."""
        if self.value is None:
            pair = prepare(self.kind, signal, reference, self.tolerance)
            if isinstance(pair, SignalVerdict):
                return pair
            result, expected = pair.result, float(pair.reference.values[-1])
            limit = pair.band.half_height + pair.band.local * abs(expected)
        else:
            cut = alone(self.kind, signal, self.tolerance)
            if isinstance(cut, SignalVerdict):
                return cut
            result, expected = cut, self.value
            limit = limit_around(self.tolerance, expected, signal.nominal)
        return judge_number(
            self.kind, result, "the last value", float(result.values[-1]), expected, limit, float(result.time[-1])
        )


@dataclass(frozen=True)
class SteadyState:
    """Over the last `window_s` every sample stays near one value: `value`, or the reference's mean over that window.

    The tolerance is `absolute` + `relative` x |value|.
    """

    window_s: float
    value: float | None = None
    tolerance: Tolerance = Tolerance()
    kind: ClassVar[str] = "steady_state"

    def __post_init__(self) -> None:
        at_least(0.0, window_s=self.window_s)
        numbers(value=self.value)

    @property
    def needs_reference(self) -> bool:
        """Whether `judge` fails without a reference."""
        return self.value is None

    def judge(self, signal: Signal, reference: Signal | None) -> SignalVerdict:
        """Return the verdict; damaged data are a failed verdict with a reason."""
        if self.value is None:
            pair = prepare(self.kind, signal, reference, self.tolerance)
            if isinstance(pair, SignalVerdict):
                return pair
            result, expected = pair.result, mean_and_spread(self._last(pair.reference))[0]
        else:
            cut = alone(self.kind, signal, self.tolerance)
            if isinstance(cut, SignalVerdict):
                return cut
            result, expected = cut, self.value
        if result.time[-1] - result.time[0] < self.window_s:
            reason = f"the result lasts {seconds(result.time[-1] - result.time[0])}, less than the window of {seconds(self.window_s)}"
            return SignalVerdict(result.name, False, reason, self.kind, result.unit)
        last = self._last(result)
        worst = int(np.argmax(np.abs(last.values - expected)))
        limit = limit_around(self.tolerance, expected, result.nominal)
        what = f"the value, at rest in the last {seconds(self.window_s)},"
        return judge_number(
            self.kind, result, what, float(last.values[worst]), expected, limit, float(last.time[worst])
        )

    def _last(self, signal: Signal) -> Signal:
        kept = signal.time >= signal.time[-1] - self.window_s
        return replace(signal, time=signal.time[kept], values=signal.values[kept])
