"""Factors between units that people mix up, by what is measured."""

import math
from collections.abc import Sequence

from fmus.errors import MisfitError
from fmus.units import si_exponents

DEGREE, TURN = math.pi / 180, 2 * math.pi
G = 9.80665

# What a column is multiplied by, and what it is if that is right. Keys are SI dimensions with rad.
_ANGLE = {
    DEGREE: "degrees declared as radians",
    1 / DEGREE: "radians declared as degrees",
    TURN: "turns declared as radians",
    1e-3: "mrad declared as rad",
}
_ANGULAR_SPEED = {
    DEGREE: "deg/s declared as rad/s",
    1 / DEGREE: "rad/s declared as deg/s",
    TURN / 60: "rpm declared as rad/s",
    TURN: "turns per second declared as rad/s",
}
_LENGTH = {1e-3: "mm declared as m", 1e3: "m declared as mm", 1e-2: "cm declared as m", 1e2: "m declared as cm"}
_THOUSAND = {1e-3: "thousandths (milli) declared as whole", 1e3: "thousands (kilo) declared as whole"}
_FORCE = {
    G: "kilograms of weight declared as newtons",
    1 / G: "newtons declared as kilograms of weight",
    **_THOUSAND,
}
_FLOW = {
    1 / 60: "per minute declared as per second",
    60.0: "per second declared as per minute",
    1 / 3600: "per hour declared as per second",
    3600.0: "per second declared as per hour",
    **_THOUSAND,
    1e-3 / 60: "litres per minute declared as cubic metres per second",
}
_PRESSURE = {1e5: "bar declared as Pa", 1e-5: "Pa declared as bar", 6894.757: "psi declared as Pa", **_THOUSAND}
_SHARE = {1e-2: "percent declared as shares of 1", 1e2: "shares of 1 declared as percent"}
_ANY = {
    DEGREE: "degrees declared as radians",
    1 / DEGREE: "radians declared as degrees",
    **_THOUSAND,
    G: "kilograms of weight declared as newtons",
    1 / G: "newtons declared as kilograms of weight",
    1 / 60: "per minute declared as per second",
    60.0: "per second declared as per minute",
}
CLOCK = {
    1e-3: "ms declared as s",
    1e3: "s declared as ms",
    60.0: "minutes declared as s",
    1 / 60: "s declared as minutes",
    3600.0: "hours declared as s",
    1 / 3600: "s declared as hours",
}
KELVIN = {273.15: "degrees Celsius declared as K", -273.15: "K declared as degrees Celsius"}
QUARTERS = {
    math.pi: "zero half a turn off",
    math.pi / 2: "zero a quarter turn off",
    -math.pi / 2: "zero a quarter turn off",
}

_BY_DIMENSION: dict[tuple[tuple[str, int], ...], dict[float, str]] = {
    (("rad", 1),): _ANGLE,
    (("rad", 1), ("s", -1)): _ANGULAR_SPEED,
    (("m", 1),): _LENGTH,
    (("kg", 1), ("m", 1), ("s", -2)): _FORCE,
    (("kg", 1), ("m", 2), ("s", -2)): _FORCE,
    (("m", 3), ("s", -1)): _FLOW,
    (("kg", 1), ("s", -1)): _FLOW,
    (("kg", 1), ("m", -1), ("s", -2)): _PRESSURE,
    (): _SHARE,
}


def factors(unit: str) -> dict[float, str]:
    """Factors that a column in this unit may be wrong by, with what it would be; common ones for no or a strange unit."""
    if not unit:
        return _ANY
    try:
        exponents = si_exponents(unit).exponents
    except MisfitError:
        return _ANY
    return _BY_DIMENSION.get(tuple(sorted(exponents.items())), _THOUSAND)


def same_dimension(units: Sequence[str]) -> bool:
    """Whether columns in these units can be exchanged without a conflict of dimensions."""
    try:
        found = [si_exponents(unit).dimension if unit else None for unit in units]
    except MisfitError:
        return len(set(units)) == 1
    return all(each == found[0] for each in found)


def is_angle(unit: str) -> bool:
    """Whether a unit is one of angle."""
    try:
        return bool(unit) and si_exponents(unit).exponents == {"rad": 1}
    except MisfitError:
        return False


def is_temperature(unit: str) -> bool:
    """Whether a unit is one of absolute temperature."""
    try:
        return bool(unit) and si_exponents(unit).exponents == {"K": 1}
    except MisfitError:
        return False
