"""How far a result may be from its reference."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Tolerance:
    """How far a result may be from its reference, upwards and sideways.

    The half-height of the band is `absolute` + `relative` x (range of the reference); the half-width is `time_shift_s`.

    Args:
        absolute: in the signal's unit; None takes it from the nominal size of the variable.
        relative: share of the range of the reference within the compared window.
        time_shift_s: s, how much earlier or later a value may come.
        from_s: s, nothing before this time is compared; None begins with the reference.
        until_s: s, nothing after this time is compared (chaotic signals); None goes to the reference's end.
    """

    absolute: float | None = None
    relative: float = 1e-3
    time_shift_s: float = 0.0
    from_s: float | None = None
    until_s: float | None = None
