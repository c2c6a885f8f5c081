"""How numbers look to a reader: three digits, an SI prefix where the unit takes one, intervals beside values."""

import math
import re
from collections.abc import Mapping

import numpy as np

from orchestrator.verdicts.result import Estimate

_PREFIXES = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
# kg, deg, % and powers such as m2 are left alone: their prefixes do not exist or would read wrongly.
_TAKES_PREFIX = frozenset({"m", "s", "rad", "N", "V", "A", "W", "Hz", "Pa", "J", "K"})


def quantity(value: float, unit: str) -> str:
    """Return a value with its unit, to three digits.

    Example:
        >>> quantity(0.0412, "rad"), quantity(0.0412, "1"), quantity(12345.0, "kg")
        ('41.2 mrad', '0.0412', '12300 kg')
    """
    exponent = engineering_exponent(value) if takes_prefix(unit) else 0
    return f"{digits(value / 10.0**exponent)} {prefixed(unit, exponent)}".rstrip()


def takes_prefix(unit: str) -> bool:
    """Tell whether the first symbol of a unit may carry an SI prefix."""
    return re.split(r"[./*]", unit, maxsplit=1)[0] in _TAKES_PREFIX


def prefixed(unit: str, exponent: int) -> str:
    """Return a unit with the prefix of 10^exponent; the unit "1" is not written."""
    return "" if unit == "1" else _PREFIXES[exponent] + unit


def engineering_exponent(value: float) -> int:
    """Return the exponent among -12, -9 ... 9 that brings a value, rounded to three digits, into [1, 1000).

    Example:
        >>> engineering_exponent(0.0412), engineering_exponent(0.99999), engineering_exponent(0.0)
        (-3, 0, 0)
    """
    if value == 0 or not math.isfinite(value):
        return 0
    decade = int(f"{abs(value):.2e}".partition("e")[2])
    return max(-12, min(9, 3 * (decade // 3)))


def digits(value: float) -> str:
    """Return a plain number to three digits, with a power of ten only outside [1e-4, 1e5).

    Example:
        >>> digits(2.0), digits(0.000123), digits(123456.0), digits(-0.0), digits(float("inf"))
        ('2.00', '0.000123', '1.23e+05', '0', '∞')
    """
    if not math.isfinite(value):
        return "unknown" if math.isnan(value) else ("∞" if value > 0 else "-∞")
    if value == 0:
        return "0"
    if not 1e-4 <= abs(value) < 99950:
        return f"{value:.2e}"
    decade = int(f"{abs(value):.2e}".partition("e")[2])
    return f"{round(value, 2 - decade):.{max(0, 2 - decade)}f}"


def ratio(value: float) -> str:
    """Return a multiple of the noise floor.

    Example:
        >>> ratio(1.034), ratio(40.95)
        ('1.03 times', '41.0 times')
    """
    return f"{digits(value)} times"


def unbroken(text: str) -> str:
    r"""Return a sentence for a page that wraps lines: between a number and its unit no line ends.

    Example:
        >>> unbroken("joint1 is 3 mm apart, 4.1 % of it")
        'joint1 is 3\xa0mm apart, 4.1\xa0% of it'
    """
    return re.sub(r"(?<![\w.])(\d[\d.]*(?:e[+-]?\d+)?) (?=[^\W\d_]|%|°)", "\\1\u00a0", text)


def spaced(text: str) -> str:
    """Return a sentence whose percentages stand apart from their sign, as everywhere.

    Example:
        >>> spaced("2% of what exceeds the noise")
        '2 % of what exceeds the noise'
    """
    return re.sub(r"(?<=\d)%", " %", text)


def percent(share: float) -> str:
    """Return a share as a percentage with one decimal below 10 % and none above.

    Example:
        >>> percent(0.973), percent(0.0312)
        ('97 %', '3.1 %')
    """
    if not math.isfinite(share):
        return "unknown"
    return f"{100 * share:.{0 if abs(share) >= 0.0995 else 1}f} %"


def estimate(name: str, found: Estimate) -> str:
    """Return a parameter with its 90 % interval, to the digits that the interval leaves meaningful.

    Example:
        >>> estimate("tauC[1]", Estimate(0.03731, "N.m", (0.03611, 0.03853)))
        'tauC[1] = 0.0373 N.m [0.0361, 0.0385]'
    """
    value, interval = estimate_parts(found)
    return f"{name} = {value} {prefixed(found.unit, 0)}".rstrip() + f" {interval}"


def estimate_parts(found: Estimate) -> tuple[str, str]:
    """Return the value and the bracketed interval of a parameter, without its unit."""
    low, high = found.ci90
    half_width = abs(high - low) / 2
    value, low_text, high_text = (_to_width(x, half_width) for x in (found.value, low, high))
    return value, f"[{low_text}, {high_text}]"


def ticks(low: float, high: float, most: int = 6) -> list[float]:
    """Return round values for an axis between two limits, at most as many.

    Example:
        >>> ticks(-0.043, 0.04), ticks(0.0, 10.0)
        ([-0.04, -0.02, 0.0, 0.02, 0.04], [0.0, 2.0, 4.0, 6.0, 8.0, 10.0])
    """
    if not 0 < high - low < math.inf:
        return [low]
    power = math.floor(math.log10((high - low) / most))
    for factor in (1, 2, 2.5, 5, 10, 20):
        step = factor * 10.0**power
        first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
        if last - first < most:
            break
    return [round(k * step, 1 - power) for k in range(first, last + 1)]


def _to_width(value: float, half_width: float) -> str:
    if not math.isfinite(value) or not math.isfinite(half_width) or half_width == 0:
        return digits(value)
    decimals = 1 - math.floor(math.log10(half_width))
    if decimals > 7 or abs(value) >= 1e6:
        return f"{value:.3g}"
    return f"{value:.{max(0, decimals)}f}"


def over_floor(rmse: Mapping[str, float], floor: Mapping[str, float]) -> float:
    """Return the root mean square over signals of rmse / floor; infinite for a floor of zero, NaN without signals."""
    if not rmse:
        return math.nan
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = np.array([rmse[name] for name in rmse]) / np.array([floor.get(name, math.nan) for name in rmse])
    return float(np.sqrt(np.mean(np.square(ratios))))
