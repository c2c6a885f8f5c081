"""Wrong columns: units, signs, zeros, exchanged ones, told by what a model predicts with and without a change."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

from fmus.errors import MisfitError
from fmus.units import si_exponents
from orchestrator.datacheck import limits
from orchestrator.datacheck.findings import NO_CHANGE, Change, Finding, Kind
from orchestrator.datacheck.prediction import Predictor

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
_FORCE = {G: "kilograms of weight declared as newtons", 1 / G: "newtons declared as kilograms of weight", **_THOUSAND}
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


Left = Callable[[Change], float]
# Changes that are looked at more closely after a first look.
SHORTLIST = 4
# More changes than this get a first look only with free pushes, which take long.
MOST_PUSHED, BEST_PUSHED = 40, 8
KINDS: Mapping[str, Kind] = {"shift": "offset", "swap": "swap", "clock": "time_unit", "delay": "delay"}


@dataclass(frozen=True)
class Tried:
    """A change with the share of the record that is left with it."""

    change: Change
    left: float


def possible_changes(moving: Sequence[str], units: Mapping[str, str], outputs: Sequence[str]) -> list[Change]:
    """Everything that a person may have got wrong with the columns, one thing at a time.

    Args:
        moving: names of the variables that move in the record.
        units: their units by name.
        outputs: which of them are outputs.
    """
    found = [Change("clock", ("time",), factor, meaning) for factor, meaning in CLOCK.items()]
    for names in _groups(moving, units):
        found += [Change("scale", names, factor, meaning) for factor, meaning in factors(units[names[0]]).items()]
        found.append(Change("scale", names, -1.0, "counted the other way"))
    for name in moving:
        if name in outputs and is_angle(units[name]):
            found += [Change("shift", (name,), zero, meaning) for zero, meaning in QUARTERS.items()]
        if is_temperature(units[name]):
            found += [Change("shift", (name,), zero, meaning) for zero, meaning in KELVIN.items()]
    for pair in combinations(moving, 2):
        if (pair[0] in outputs) == (pair[1] in outputs) and same_dimension([units[name] for name in pair]):
            found.append(Change("swap", pair, 0.0, "exchanged"))
    return found


def _groups(moving: Sequence[str], units: Mapping[str, str]) -> Iterable[tuple[str, ...]]:
    """Each column alone, and all columns of a unit together: whoever exports degrees exports all angles so."""
    yield from ((name,) for name in moving)
    for unit in dict.fromkeys(units[name] for name in moving):
        together = tuple(name for name in moving if units[name] == unit)
        if len(together) > 1:
            yield together


def wrong_columns(predictor: Predictor, units: Mapping[str, str]) -> tuple[Finding, ...]:
    """The change that makes a model that predicted next to nothing predict nearly everything, if there is one.

    If no change does so with the model as it is, the model gets free pushes: its friction may be what it lacks.
    """
    before = predictor.left()
    if before < limits.NOTHING_WRONG:
        return ()
    changes = possible_changes(predictor.moving, units, predictor.data.output_names)
    if predictor.is_stepped:  # a run through a thousand times the time takes a thousand times as long
        changes = [change for change in changes if change.way != "clock" or change.value < 1]
    if predictor.data.units_certain:
        changes = [change for change in changes if change.way not in ("clock", "scale") or change.value == -1.0]
    first = sorted((Tried(c, predictor.left(c, few=True)) for c in changes), key=lambda tried: tried.left)
    closely = [Tried(each.change, predictor.left(each.change)) for each in first[:SHORTLIST]]
    found = judged(before, closely, predictor.left, limits.PLAIN)
    if not found and before > limits.OUT_OF_SCALE:
        scaled = [each for each in closely if each.change.way == "scale"]
        found = judged(before, scaled, predictor.left, limits.SCALE)
    if found or before < limits.WELL_PREDICTED or not predictor.can_be_pushed:
        return found
    pushed = predictor.left_when_pushed
    with_pushes = pushed(NO_CHANGE)
    if with_pushes < limits.WELL_PREDICTED:
        return ()
    if len(changes) > MOST_PUSHED:
        changes = sorted(changes, key=lambda change: pushed(change, few=True))[:BEST_PUSHED]
    return judged(with_pushes, [Tried(c, pushed(c)) for c in changes], pushed, limits.PUSHED)


def judged(before: float, tried: Sequence[Tried], left: Left, limit: limits.Limit) -> tuple[Finding, ...]:
    """The best change as a finding, if it leaves little, much less than before, and by its own amount the least.

    Args:
        before: share of the motion that the model does not predict, as recorded.
        tried: the changes, each with the share that it leaves.
        left: gives the share that a further change leaves.
        limit: what counts as little, and as much less.
    """
    ranked = sorted(tried, key=lambda each: (each.left, len(each.change.columns)))
    good = [each for each in ranked if each.left < limit.left and before > limit.drop * each.left]
    good = [each for each in good if each.left <= limits.AS_GOOD * good[0].left]
    good = [each for each in good if is_sharp(each, left, limit)]
    if not good:
        return ()
    best = _likeliest(good)
    others = [each.change for each in good if each.change is not best.change]
    return (_finding(best, before, others),)


def _likeliest(good: Sequence[Tried]) -> Tried:
    """Of equally good changes, the one with the most telling factor: 57.3 is nothing but degrees; a sign is an output's."""
    return min(good, key=lambda each: (len(each.change.columns) > 1, each.change.way == "clock", each.left))


def is_sharp(tried: Tried, left: Left, limit: limits.Limit) -> bool:
    """Whether the amount of a change, if it were free, would be the well-known one; a gain of physics is anything.

    Args:
        tried: the change, with the share that it leaves.
        left: gives the share that another change leaves.
        limit: how near the amount must be.
    """
    change = tried.change
    if change.way == "clock":  # a time in which nothing moves predicts whatever is slow, and half of it as well
        halves = [change.with_value(change.value * factor) for factor in (0.5, 2.0)]
        return all(left(each) > limits.AS_GOOD * tried.left for each in halves)
    if change.way not in ("scale", "shift") or change.value == -1.0:
        return True
    worse = 1.0
    if change.way == "shift":
        moved = [change.with_value(change.value + d * limits.CLOSE_ANGLE) for d in (-1, 1)]
    else:
        size = max(abs(change.value), 1 / abs(change.value))
        reach, worse = (limit.close, 1.0) if size < limits.NEAR_ONE else (limit.loose, limit.worse)
        moved = [change.with_value(change.value * (1 + d * reach)) for d in (-1, 1)]
    return all(left(each) >= worse * tried.left for each in moved)


def _finding(best: Tried, before: float, others: Sequence[Change]) -> Finding:
    change = best.change
    kind: Kind = KINDS.get(change.way, "sign" if change.value == -1.0 else "unit")
    column = ", ".join(change.columns)
    evidence = (
        f"over short stretches the model leaves {before:.3g} times what the record shows, and {best.left:.2g} times if"
        f" {column} {is_are(change.columns)} {change.meaning}"
    )
    if others:
        as_good = [f"{', '.join(other.columns)} {other.meaning}" for other in others[:3]]
        evidence += f"; as good: {' or '.join(as_good)}"
    return Finding(kind, column, "", evidence, proposal(change), strong=True, change=change)


def is_are(columns: Sequence[str]) -> str:
    """The verb for one or several columns."""
    return "is" if len(columns) == 1 else "are"


def proposal(change: Change) -> str:
    """What to do with a column, in words."""
    column = " and ".join(change.columns)
    if change.way == "scale":
        return f"multiply {column} by {change.value:.6g}"
    if change.way == "shift":
        return f"add {change.value:.6g} to {column}"
    if change.way == "swap":
        return f"exchange {column}"
    if change.way == "clock":
        return f"multiply the time by {change.value:.6g}"
    return f"read {column} {abs(change.value):.4g} s {'later' if change.value > 0 else 'earlier'}"
