"""How far a result may be from its reference."""

import math
from dataclasses import dataclass

import numpy as np

from orchestrator.regress.comparison.signal import Signal
from orchestrator.regress.comparison.wording import quantity, seconds

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
    exact = tolerance.absolute is None and reference.interpolation == "hold" and _whole(values)
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
    """Return how far one number may be from the expected one: `relative` and `local` count of its own size."""
    size = abs(expected) if nominal is None else abs(nominal)
    absolute = max(FLOOR, NOMINAL_SHARE * size) if tolerance.absolute is None else tolerance.absolute
    return absolute + (tolerance.relative + tolerance.local) * abs(expected)


def _absolute(tolerance: Tolerance, reference: Signal, largest: float) -> float:
    if tolerance.absolute is not None:
        return tolerance.absolute
    size = largest if reference.nominal is None else abs(reference.nominal)
    return max(FLOOR, NOMINAL_SHARE * size)


def _whole(values: np.ndarray) -> bool:
    return bool(np.array_equal(values, np.round(values)))
