"""Which column is which variable of a model: by name, else by the unit if only one of each has it."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import SequenceMatcher
from typing import TYPE_CHECKING

from fmus.errors import MisfitError
from fmus.units import si_exponents
from orchestrator.measurements.dirty.header_units import split_header
from orchestrator.measurements.matching import match_columns, spelling

if TYPE_CHECKING:
    from fmus.symbolic.system import Variable

# Names alike enough to be proposed.
ALIKE = 0.75
# Words that people use for one quantity.
_SAME = (
    {"theta", "angle", "phi", "q", "winkel", "pos_angle"},
    {"omega", "speed", "w", "velocity", "vel", "dq", "qd"},
    {"torque", "tau", "moment", "m"},
    {"force", "f", "kraft"},
    {"voltage", "u", "v", "volt", "spannung"},
    {"current", "i", "strom"},
    {"temperature", "temp", "t", "temperatur"},
    {"position", "pos", "x", "displacement", "weg"},
    {"level", "h", "height"},
    {"pressure", "p", "druck"},
    {"heat", "power", "q_flow", "heating"},
    {"command", "cmd", "reference", "setpoint", "ref"},
)
# Words that say nothing of what is measured.
_FILLERS = {"data", "value", "val", "meas", "measured", "actual", "act", "ist", "raw", "signal"}


@dataclass(frozen=True)
class Assigned:
    """A column as a variable, and why."""

    column: str
    variable: str
    why: str


def assign(
    columns: Sequence[str], units: Mapping[str, str], variables: Sequence["Variable"], given: Mapping[str, str]
) -> tuple[Assigned, ...]:
    """Propose which column is which variable; a unit of another dimension rules a pair out.

    Args:
        columns: the columns without time.
        units: their units, where known.
        variables: the inputs and outputs of the model.
        given: column -> variable as the user says; "" keeps a column out.
    """
    known = {variable.name: variable for variable in variables}
    found = [_as_said(column, known[variable], units.get(column)) for column, variable in given.items() if variable]
    plain = {column: split_header(column)[0] for column in columns}
    for match in (_by_name, _by_likeness, _by_unit):
        left = [c for c in columns if c not in given and c not in {each.column for each in found}]
        open_variables = [v for v in known.values() if v.name not in {each.variable for each in found}]
        if match is not _by_name:
            # Forces that a learned correction puts in: no record holds them unless it says so.
            open_variables = [v for v in open_variables if not v.name.startswith("correction_")]
        found.extend(match({c: plain[c] for c in left}, units, open_variables))
    return tuple(found)


def _as_said(column: str, variable: "Variable", unit: str | None) -> Assigned:
    if not _fits(unit, variable.unit):
        raise MisfitError(
            f"column {column!r} is in {unit}, which is no {variable.unit}, the unit of {variable.name}; choose another variable, or correct the unit"
        )
    return Assigned(column, variable.name, "as you say")


def _by_name(columns: Mapping[str, str], units: Mapping[str, str], variables: Sequence["Variable"]) -> list[Assigned]:
    found: list[Assigned] = []
    names = [v.name for v in variables]
    for spelled in (
        {c: c for c in columns},
        {p: c for c, p in columns.items()},
        {p.lower(): c for c, p in columns.items()},
    ):
        lowered = names if not all(name == name.lower() for name in spelled) else [*names, *(n.lower() for n in names)]
        matching = match_columns(tuple(spelled), {}, lowered)
        for name, column in matching.column_of.items():
            variable = next((v for v in variables if v.name == name or v.name.lower() == name), None)
            taken = variable is None or any(variable.name == f.variable or spelled[column] == f.column for f in found)
            if variable is not None and not taken and _fits(units.get(spelled[column]), variable.unit):
                found.append(Assigned(spelled[column], variable.name, "by name"))
    return found


def _by_likeness(
    columns: Mapping[str, str], units: Mapping[str, str], variables: Sequence["Variable"]
) -> list[Assigned]:
    pairs = sorted(
        (
            (likeness(plain, v.name), column, v.name)
            for column, plain in columns.items()
            for v in variables
            if _fits(units.get(column), v.unit)
        ),
        reverse=True,
    )
    found: list[Assigned] = []
    for score, column, variable in pairs:
        free = all(column != f.column and variable != f.variable for f in found)
        rival = [s for s, c, v in pairs if (c == column) != (v == variable) and s > score - 0.05]
        if score >= ALIKE and free and not rival:
            found.append(Assigned(column, variable, "its name is alike"))
    return found


def _by_unit(columns: Mapping[str, str], units: Mapping[str, str], variables: Sequence["Variable"]) -> list[Assigned]:
    found = []
    for variable in variables:
        if _base(variable.unit) in (None, ()):
            continue
        same = [c for c in columns if _base(units.get(c)) == _base(variable.unit)]
        others = [v for v in variables if _base(v.unit) == _base(variable.unit)]
        if len(same) == 1 and len(others) == 1:
            found.append(Assigned(same[0], variable.name, f"the only one in {units[same[0]]}"))
    return found


def likeness(column: str, variable: str) -> float:
    """How alike two names are, from 0 to 1; words for one quantity count as the same.

    >>> likeness("Motor Angle", "motor.theta"), likeness("q1", "q2") < 0.75
    (1.0, True)
    """
    one, two = _words(column), _words(variable)
    if one == two or one and two and (one[-1:] == two or two[-1:] == one) and not one[-1].isdigit():
        return 1.0 if one == two else 0.9
    # Two names that differ in a number are two things, however alike the rest is.
    if [w for w in one if w.isdigit()] != [w for w in two if w.isdigit()]:
        return 0.0
    return SequenceMatcher(None, " ".join(one), " ".join(two)).ratio()


def _words(name: str) -> list[str]:
    parted = re.sub(r"([a-z])([A-Z])", r"\1_\2", spelling(name))
    words = re.findall(r"[A-Za-z]+|\d+", parted.lower())
    words = [word for word in words if word not in _FILLERS] or words
    return [next((min(same) for same in _SAME if word in same), word) for word in words]


def _fits(unit: str | None, wanted: str) -> bool:
    """Whether a unit can be converted; one that is not known fits all."""
    if not unit or not wanted:
        return True
    try:
        return si_exponents(unit).dimension == si_exponents(wanted).dimension
    except MisfitError:
        return False


def _base(unit: str | None) -> tuple[tuple[str, int], ...] | None:
    if not unit:
        return None
    try:
        return tuple(sorted(si_exponents(unit).exponents.items()))
    except MisfitError:
        return None
