"""Signals, tolerances, verdicts and what every check can do; how figures are refused and how they read."""

import math
from dataclasses import asdict, dataclass
from typing import Any, Literal, Protocol

import numpy as np

from fmus.errors import MisfitError


def quantity(value: float, unit: str) -> str:
    """Return a value to four digits with its unit; the units "" and "1" are not written.

    Example:
        >>> quantity(0.041237, "rad"), quantity(3.0, "1"), quantity(float("nan"), "N")
        ('0.04124 rad', '3', 'nan N')
    """
    return f"{value:.4g} {'' if unit == '1' else unit}".rstrip()


def seconds(value: float) -> str:
    """Return a time or a duration, below 0.1 s in milliseconds.

    Example:
        >>> seconds(1.24), seconds(0.004), seconds(0.0)
        ('1.24 s', '4 ms', '0 s')
    """
    if value != 0 and abs(value) < 0.1:
        return f"{value * 1e3:.6g} ms"
    return f"{value:.9g} s"


def rounded_up(value: float) -> float:
    """Return a limit to four digits that is not below the value, so that it can be typed into a case.

    Example:
        >>> rounded_up(0.00123456), rounded_up(0.0), rounded_up(2.0)
        (0.001235, 0.0, 2.0)
    """
    if value <= 0 or not math.isfinite(value):
        return value
    for digits in (4, 5, 17):
        step = 10.0 ** (math.floor(math.log10(value)) - digits + 1)
        rounded = float(f"{math.ceil(value / step * (1 - 1e-12)) * step:.{digits}g}")
        if rounded >= value:
            return rounded
    return value


Interpolation = Literal["linear", "hold"]


@dataclass(frozen=True, eq=False)
class Signal:
    """One variable over time.

    Args:
        name: the variable's name.
        time: shape (n,), s, never falling; the same stamp two or three times is an event (values before and after it).
        values: shape (n,), in `unit`; whole numbers and Booleans are taken as numbers.
        unit: unit text, "" when it is not known, "1" for none.
        interpolation: "linear" between samples, or "hold": the last value stays until the next sample.
        nominal: the size that the variable's declaration gives, in `unit`; None when it gives none.

    Nothing is checked here: a damaged signal must come through, so that it fails with a reason.
    """

    name: str
    time: np.ndarray
    values: np.ndarray
    unit: str = ""
    interpolation: Interpolation = "linear"
    nominal: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "time", np.asarray(self.time, dtype=float))
        object.__setattr__(self, "values", np.asarray(self.values, dtype=float))


# Absolute tolerance as a share of the variable's nominal size, where the case gives none: ten times what a solver with
# the usual tolerance of 1e-6 is asked for.
NOMINAL_SHARE = 1e-5
# Absolute tolerance, in the signal's unit, below which none is derived: rounding around zero is no change.
FLOOR = 1e-9
# Numbers typed in decimal and stored in single precision exceed a limit by up to 6e-8 of it without meaning it.
ROUNDING = 1e-7
# Sums of step sizes differ from products by rounding; stamps this close, as a share of the largest, are the same.
TIME_ROUNDING = 1e-10


@dataclass(frozen=True)
class Tolerance:
    """How far a result may be from its reference, upwards and sideways.

    The half-height of the band is `absolute` + `relative` x (range of the reference within the compared window) +
    `local` x |reference|; its half-width is `time_shift_s`.

    Args:
        absolute: in the signal's unit; None takes NOMINAL_SHARE of the variable's nominal size or, where none is
            declared, of the largest |reference|, but at least FLOOR. Of a "hold" signal with whole values, None
            means exact: they may only switch earlier or later, and `relative` does not count.
        relative: share of the range of the reference.
        time_shift_s: s, how much earlier or later a value may come.
        local: share of the reference's own size at each moment.
        from_s: s, nothing before this time is compared; None begins with the reference.
        until_s: s, nothing after this time is compared (chaotic signals); None goes to the reference's end.
    """

    absolute: float | None = None
    relative: float = 1e-3
    time_shift_s: float = 0.0
    local: float = 0.0
    from_s: float | None = None
    until_s: float | None = None

    def refusal(self) -> str | None:
        """Return what is wrong with the figures, or None."""
        for name, value in (
            ("absolute", self.absolute or 0.0),
            ("relative", self.relative),
            ("local", self.local),
            ("time_shift_s", self.time_shift_s),
        ):
            if not (math.isfinite(value) and value >= 0):
                return f"tolerance {name} = {value}, expected a number from 0 up"
        return None


@dataclass(frozen=True)
class Band:
    """A tolerance in numbers, for one reference.

    `half_height` in the signal's unit, `local` as a share, `half_width` in s with an allowance for rounded stamps.
    `relative_part` is what of the half-height does not come from the absolute tolerance.
    """

    half_height: float
    half_width: float
    local: float
    relative_part: float
    text: str

    @property
    def limit(self) -> float:
        """The half-height with the allowance for decimal numbers."""
        return self.half_height * (1 + ROUNDING)


def band(tolerance: Tolerance, reference: Signal) -> Band:
    """Return the band that a tolerance means around a reference, `reference` already cut to the compared window."""
    values = reference.values
    lowest, highest = float(values.min()), float(values.max())
    exact = (
        tolerance.absolute is None and reference.interpolation == "hold" and np.array_equal(values, np.round(values))
    )
    absolute = 0.0 if exact else _absolute(tolerance, reference, max(abs(lowest), abs(highest)))
    relative_part = 0.0 if exact else tolerance.relative * (highest - lowest)
    stamps = max(abs(reference.time[0]), abs(reference.time[-1]))
    text = quantity(absolute + relative_part, reference.unit)
    if tolerance.local:
        text += f" + {tolerance.local:g} of the value"
    if tolerance.time_shift_s:
        text += f" within {seconds(tolerance.time_shift_s)}"
    return Band(
        half_height=absolute + relative_part,
        half_width=tolerance.time_shift_s + float(stamps) * TIME_ROUNDING,
        local=tolerance.local,
        relative_part=relative_part,
        text=text,
    )


def limit_around(tolerance: Tolerance, expected: float, nominal: float | None) -> float:
    """Return how far one number may be from the expected one: `relative` and `local` count of its own size.

    Args:
        tolerance: the tolerance.
        expected: the number expected.
        nominal: its nominal size, in the same unit; None for its own.
    """
    size = abs(expected) if nominal is None else abs(nominal)
    absolute = max(FLOOR, NOMINAL_SHARE * size) if tolerance.absolute is None else tolerance.absolute
    return absolute + (tolerance.relative + tolerance.local) * abs(expected)


def _absolute(tolerance: Tolerance, reference: Signal, largest: float) -> float:
    if tolerance.absolute is not None:
        return tolerance.absolute
    size = largest if reference.nominal is None else abs(reference.nominal)
    return max(FLOOR, NOMINAL_SHARE * size)


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


class Check(Protocol):
    """One demand on one signal; a frozen dataclass for each kind."""

    @property
    def needs_reference(self) -> bool:
        """Whether `judge` fails without a reference."""
        ...

    def judge(self, signal: Signal, reference: Signal | None) -> SignalVerdict:
        """Return the verdict; damaged or missing data are a failed verdict with a reason, never an exception."""
        ...


def at_least(smallest: float, **figures: float | None) -> None:
    """Refuse figures that are no finite numbers or lie below a smallest one; None is left out.

    Raises:
        MisfitError: for example for window_s = -1.
    """
    for name, value in figures.items():
        if value is not None and not (_number(value) and value >= smallest):
            raise MisfitError(f"{name} = {value!r}, expected a number from {smallest:g} up")


def numbers(**figures: float | None) -> None:
    """Refuse figures that are no finite numbers; None is left out.

    Raises:
        MisfitError: for example for value = "high".
    """
    for name, value in figures.items():
        if value is not None and not _number(value):
            raise MisfitError(f"{name} = {value!r}, expected a finite number")


def _number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
