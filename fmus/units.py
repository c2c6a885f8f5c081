"""Modelica unit strings in SI base units: exponents for model descriptions, factors for measurements."""

import math
import re
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING, Any

from fmus.errors import MisfitError

if TYPE_CHECKING:
    from pint import UnitRegistry

_PINT_BASE_NAMES = {
    "kilogram": "kg",
    "meter": "m",
    "second": "s",
    "ampere": "A",
    "kelvin": "K",
    "mole": "mol",
    "candela": "cd",
    "radian": "rad",
}
BASE_UNITS = tuple(_PINT_BASE_NAMES.values())

# Pint also knows textile, typographic and American units: read by it, "Nm" is a yarn count of 1000 m/kg.
_ACCEPTED_NAMES = """
    meter gram second ampere kelvin mole candela radian steradian hertz newton pascal joule watt
    coulomb volt farad ohm siemens weber tesla henry lumen lux becquerel gray sievert katal minute
    hour day liter metric_ton bar electron_volt degree turn revolutions_per_minute
    revolutions_per_second percent degree_Celsius degree_Fahrenheit
"""
_ACCEPTED = frozenset(_ACCEPTED_NAMES.split())
_ALIASES = {"Ohm": "ohm", "rev": "turn", "%": "percent"}

_FACTOR = re.compile(r"(?P<symbol>[A-Za-zµμΩ°%]+)\^?(?P<power>[+-]?\d+)?")
_NAME = re.compile(r"[A-Za-zµμΩ°_]+")


@dataclass(frozen=True)
class SiUnit:
    """A unit in SI base units: `value in SI = factor * value + offset`.

    `exponents` holds the non-zero exponents of kg, m, s, A, K, mol, cd and rad, in that order.
    """

    exponents: dict[str, int] = field(default_factory=dict)
    factor: float = 1.0
    offset: float = 0.0

    @property
    def dimension(self) -> dict[str, int]:
        """Exponents without rad: what has to agree for two units to be convertible."""
        return {base: power for base, power in self.exponents.items() if base != "rad"}


# What most models and records use: their commands need not load pint, which takes 0.4 s.
_COMMON = {
    **{base: SiUnit({base: 1}) for base in BASE_UNITS},
    "Hz": SiUnit({"s": -1}),
    "N": SiUnit({"kg": 1, "m": 1, "s": -2}),
    "Pa": SiUnit({"kg": 1, "m": -1, "s": -2}),
    "J": SiUnit({"kg": 1, "m": 2, "s": -2}),
    "W": SiUnit({"kg": 1, "m": 2, "s": -3}),
    "V": SiUnit({"kg": 1, "m": 2, "s": -3, "A": -1}),
    "Ohm": SiUnit({"kg": 1, "m": 2, "s": -3, "A": -2}),
    "mm": SiUnit({"m": 1}, 0.001),
    "deg": SiUnit({"rad": 1}, math.pi / 180),
    "degC": SiUnit({"K": 1}, 1.0, 273.15),
}


def si_exponents(unit: str) -> SiUnit:
    """Express a Modelica unit string in SI base units.

    Args:
        unit: products with `.`, one `/`, integer exponents behind the symbol and parentheses, as in
            the Modelica specification (chapter 19); `*` and `^` are accepted too. `""` and `"1"` are
            dimensionless.

    Returns:
        Exponents, factor and offset. An offset (degC) exists only for a unit that stands alone;
        inside a product it is a temperature difference.

    Raises:
        MisfitError: if the string does not follow the grammar or a symbol is not a known unit.

    Example:
        >>> si_exponents("N.m.s/rad").exponents
        {'kg': 1, 'm': 2, 's': -1, 'rad': -1}
        >>> si_exponents("N/mm2")
        SiUnit(exponents={'kg': 1, 'm': -1, 's': -2}, factor=1000000.0, offset=0.0)
        >>> si_exponents("degC").offset
        273.15
        >>> si_exponents("furlong")
        Traceback (most recent call last):
            ...
        fmus.errors.MisfitError: unit 'furlong': 'furlong' is not a known unit; use SI symbols such as N.m or rad/s
    """
    return _si_unit(unit)


def conversion(from_unit: str, to_unit: str) -> float:
    """Give the factor that turns a value in `from_unit` into a value in `to_unit`.

    rad counts as dimensionless here, so that N.m/rad and N.m are convertible.

    Raises:
        MisfitError: if the dimensions differ, or the zero points do (degC and K): no factor exists.

    Example:
        >>> conversion("mm", "m")
        0.001
        >>> conversion("N", "m")
        Traceback (most recent call last):
            ...
        fmus.errors.MisfitError: cannot convert 'N' (kg.m.s-2) to 'm' (m): the dimensions differ
    """
    factor, offset = scaling(from_unit, si_exponents(from_unit), to_unit, si_exponents(to_unit))
    if offset != 0.0:
        raise MisfitError(f"cannot convert {from_unit!r} to {to_unit!r} by a factor: their zero points differ; use K")
    return factor


def scaling(from_unit: str, source: SiUnit, to_unit: str, target: SiUnit) -> tuple[float, float]:
    """Give factor and offset with `value in to_unit = factor * value in from_unit + offset`.

    The names of the units are for the message; what they mean is in `source` and `target`.

    Raises:
        MisfitError: if the dimensions differ.

    Example:
        >>> scaling("degC", si_exponents("degC"), "K", si_exponents("K"))
        (1.0, 273.15)
    """
    if source.dimension != target.dimension:
        raise MisfitError(
            f"cannot convert {from_unit!r} ({_text(source)}) to {to_unit!r} ({_text(target)}): the dimensions differ"
        )
    return source.factor / target.factor, (source.offset - target.offset) / target.factor


@cache
def _si_unit(unit: str) -> SiUnit:
    text = unit.replace("·", ".").replace("*", ".").replace(" ", "")
    factors = _expression(text, unit) if text else []
    if len(factors) == 1 and factors[0][1] == 1:
        return _symbol(factors[0][0], unit)
    exponents, factor = dict.fromkeys(BASE_UNITS, 0), 1.0
    for symbol, power in factors:
        part = _symbol(symbol, unit)
        factor *= part.factor**power
        for base, exponent in part.exponents.items():
            exponents[base] += exponent * power
    return SiUnit({base: power for base, power in exponents.items() if power}, factor)


def _expression(text: str, unit: str) -> list[tuple[str, int]]:
    """List the (symbol, power) pairs of `numerator[/denominator]`, each a product or in parentheses."""
    numerator, slash, denominator = _split_at_slash(text)
    if not slash:
        return _product(numerator, unit)
    if "." in denominator and not denominator.startswith("("):
        raise MisfitError(f"unit {unit!r}: put parentheses around the denominator {denominator!r}")
    return _product(numerator, unit) + [(symbol, -power) for symbol, power in _product(denominator, unit)]


def _split_at_slash(text: str) -> tuple[str, str, str]:
    depth = 0
    for position, character in enumerate(text):
        depth += (character == "(") - (character == ")")
        if character == "/" and depth == 0:
            return text[:position], "/", text[position + 1 :]
    return text, "", ""


def _product(text: str, unit: str) -> list[tuple[str, int]]:
    if text.startswith("(") and text.endswith(")"):
        return _expression(text[1:-1], unit)
    if text == "1":
        return []
    return [_factor(part, unit) for part in text.split(".")]


def _factor(text: str, unit: str) -> tuple[str, int]:
    match = _FACTOR.fullmatch(text)
    if match is None:
        raise MisfitError(
            f"unit {unit!r}: cannot read {text!r}; write products as N.m, quotients as rad/s, powers as m2"
        )
    power = match["power"] or "1"
    if len(power.lstrip("+-")) > 1:
        raise MisfitError(f"unit {unit!r}: the power {power[:9]} is beyond 9; check the unit")
    return match["symbol"], int(power)


@cache
def _registry() -> "UnitRegistry[Any]":
    # Building the registry takes 0.1 s, which commands without units should not pay.
    from pint import UnitRegistry

    return UnitRegistry(autoconvert_offset_to_baseunit=True)


def _symbol(symbol: str, unit: str) -> SiUnit:
    return _COMMON.get(symbol) or _by_pint(symbol, unit)


@cache
def _by_pint(symbol: str, unit: str) -> SiUnit:
    name = _ALIASES.get(symbol, symbol)
    # pint evaluates what is no plain name, so only names reach it.
    readings = _registry().parse_unit_name(name) if _NAME.fullmatch(name) else ()
    if not any(base in _ACCEPTED for _, base, _ in readings):
        raise MisfitError(f"unit {unit!r}: {symbol!r} is not a known unit; use SI symbols such as N.m or rad/s")
    zero, one = (_registry().Quantity(value, name).to_base_units() for value in (0.0, 1.0))
    powers = {_PINT_BASE_NAMES[base]: round(power.real) for base, power in one.unit_items()}
    exponents = {base: powers[base] for base in BASE_UNITS if base in powers}
    return SiUnit(exponents, float(one.magnitude - zero.magnitude), float(zero.magnitude))


def _text(unit: SiUnit) -> str:
    parts = [base if power == 1 else f"{base}{power}" for base, power in unit.exponents.items()]
    return ".".join(parts) or "1"


def after_number(unit: str | None) -> str:
    """A unit as it stands after a number: behind a space, and nothing where there is none.

    >>> after_number("N.m"), after_number("1"), after_number(None)
    (' N.m', '', '')
    """
    return "" if unit in (None, "", "1") else f" {unit}"
