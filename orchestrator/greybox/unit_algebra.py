"""Products and quotients of unit strings, written as engineers write them."""

import re
from collections import Counter

_FACTOR = re.compile(r"([A-Za-zµΩ°%]+)\^?(-?\d+)?")


def powers(unit: str) -> Counter[str]:
    """Symbols of a unit with their powers.

    >>> dict(powers("N.m/(rad/s)"))
    {'N': 1, 'm': 1, 'rad': -1, 's': 1}
    """
    found: Counter[str] = Counter()
    signs, sign, after_slash = [1], 1, False
    for token in re.findall(r"[A-Za-zµΩ°%]+\^?-?\d*|[./*()]", unit):
        if token == "/":
            after_slash = True
        elif token in ".*":
            continue
        elif token == "(":
            signs.append(sign)
            sign, after_slash = sign * (-1 if after_slash else 1), False
        elif token == ")":
            sign = signs.pop()
        else:
            match = _FACTOR.fullmatch(token)
            assert match is not None
            found[match[1]] += sign * (-1 if after_slash else 1) * int(match[2] or 1)
            after_slash = False
    return Counter({symbol: power for symbol, power in found.items() if power})


def combined(*parts: tuple[str, int]) -> str:
    """The unit of a product of units to given powers.

    >>> combined(("N", 1), ("m/s", -1)), combined(("N.m", 1), ("rad/s", -2)), combined(("W", 1), ("W", -1))
    ('N.s/m', 'N.m.s2/rad2', '1')
    """
    total: Counter[str] = Counter()
    for unit, power in parts:
        for symbol, own in powers(unit).items():
            total[symbol] += power * own
    above = [f"{s}{p if p != 1 else ''}" for s, p in total.items() if p > 0]
    below = [f"{s}{-p if p != -1 else ''}" for s, p in total.items() if p < 0]
    if not below:
        return ".".join(above) or "1"
    under = below[0] if len(below) == 1 else f"({'.'.join(below)})"
    return f"{'.'.join(above) or '1'}/{under}"
