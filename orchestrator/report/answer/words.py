"""Effects, places and sizes in plain words."""

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from orchestrator.report.numbers import digits, engineering_exponent, prefixed, takes_prefix

Effect = Mapping[str, Any]
# Sizes that are named; the others stand behind "Why do you think so?".
MOST_SIZES = 4
PARAMETER_ERROR = "parameter_error"
# Ids that name a joint; the sensor may be one of anything.
WORDS = {"joint_scale": "scale error", "joint_offset": "zero error"}


def name_of(effect: str) -> str:
    """The words of an effect's id.

    >>> name_of("coulomb_friction"), name_of("coulomb_friction+payload"), name_of("joint_scale")
    ('coulomb friction', 'coulomb friction and payload', 'scale error')
    """
    return joined(WORDS.get(part, part.replace("_", " ").strip()) for part in effect.split("+"))


def place_of(site: str) -> str:
    """Where an effect acts.

    >>> place_of("joint1+joint2"), place_of("muscle1+muscle2+muscle3"), place_of("channel3->muscle4"), place_of("")
    ('at joint1 and joint2', 'at muscle1 to muscle3', 'from channel3 to muscle4', '')
    """
    if not site:
        return ""
    if "->" in site:
        source, _, target = site.partition("->")
        return f"from {source} to {target}"
    if site.startswith("sensor:"):
        return f"in the sensor {site.removeprefix('sensor:')}"
    parts = site.split("+")
    stem = parts[0].rstrip("0123456789")
    if len(parts) > 2 and parts == [f"{stem}{k}" for k in range(1, len(parts) + 1)]:
        return f"at {parts[0]} to {parts[-1]}"
    return f"at {joined(parts)}"


def what(effect: Effect) -> str:
    """An effect with its place, such as `coulomb friction at joint1`."""
    if effect["id"] == PARAMETER_ERROR:
        return f"the value of {effect['site']}"
    return f"{name_of(effect['id'])} {place_of(effect['site'])}".strip()


def sizes(effects: Sequence[Effect]) -> str:
    """The fitted parameters with their 90 % intervals, such as `tauC[1] 37.3 mN·m (37.0 to 37.7)`."""
    found = [
        size(f"{name} of {effect['site']}" if effect["id"] == PARAMETER_ERROR else name, value)
        for effect in effects
        for name, value in _fitted(effect.get("parameters") or {}).items()
    ]
    left = len(found) - MOST_SIZES
    return ", ".join(found[:MOST_SIZES]) + (f" and {left} more" if left > 0 else "")


def _fitted(parameters: Mapping[str, Any]) -> Mapping[str, Any]:
    """Without those that were held at a value, such as the width of a smoothed sign; all if all were."""
    free = {name: value for name, value in parameters.items() if value["ci90"][0] != value["ci90"][1]}
    return free or parameters


def size(name: str, estimate: Mapping[str, Any]) -> str:
    """One parameter: value, unit and 90 % interval, all with the same prefix and to the digits that the interval allows.

    >>> size("tauC[1]", {"value": 0.03731, "unit": "N.m", "ci90": [0.0370, 0.0377]})
    'tauC[1] 37.3 mN·m (37.0 to 37.7)'
    >>> size("gain", {"value": 0.81, "unit": "1", "ci90": [0.80, 0.82]})
    'gain 0.810 (0.800 to 0.820)'
    """
    value, unit, (low, high) = float(estimate["value"]), str(estimate["unit"]), estimate["ci90"]
    exponent = engineering_exponent(value) if takes_prefix(unit) else 0
    scale = 10.0**-exponent
    width = abs(float(high) - float(low)) * scale / 2
    texts = [_to(x * scale, width) for x in (value, float(low), float(high))]
    return f"{name} {texts[0]} {unit_text(prefixed(unit, exponent))}".rstrip() + f" ({texts[1]} to {texts[2]})"


def _to(value: float, half_width: float) -> str:
    if not math.isfinite(half_width) or half_width <= 0 or not math.isfinite(value) or not 1e-4 <= abs(value) < 1e5:
        return digits(value)
    decimals = max(0, math.ceil(math.log10(3.0 / half_width)))
    return f"{value:.{decimals}f}" if decimals <= 6 else digits(value)


def unit_text(unit: str) -> str:
    """A unit as people read it; dimensionless is nothing.

    >>> unit_text("N.m.s/rad"), unit_text("1"), unit_text("kg.m2"), unit_text("rad/s2")
    ('N·m·s/rad', '', 'kg·m²', 'rad/s²')
    """
    raised = re.sub(r"(?<=[A-Za-z])[23]", lambda found: {"2": "²", "3": "³"}[found[0]], unit)
    return "" if unit == "1" else raised.replace(".", "·")


def share(value: float) -> str:
    """A share in whole per cent; never 100 % of what is not all, nor 0 % of what is something.

    >>> share(0.981), share(0.9996), share(0.0004), share(1.0), share(-0.2)
    ('98 %', 'more than 99 %', 'less than 1 %', '100 %', 'none')
    """
    if not math.isfinite(value):
        return "an unknown share"
    if value <= 0:
        return "none"
    if 0.995 < value < 1.0:
        return "more than 99 %"
    return "less than 1 %" if value < 0.005 else f"{100 * min(value, 1.0):.0f} %"


def joined(names: Iterable[str], last: str = "and") -> str:
    """Names in a row, such as `a, b and c`."""
    *first, final = list(names) or [""]
    return f"{', '.join(first)} {last} {final}" if first else final


def capital(text: str) -> str:
    """A sentence begins with a capital letter; the rest stays as it is."""
    return text[:1].upper() + text[1:]
