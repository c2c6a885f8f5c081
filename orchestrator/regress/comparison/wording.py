"""How figures of a verdict read."""

import math


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
