"""Checks of signals read from TOML, `[signals.h]` for one and `[[signals.h]]` for several, and signals that a case computes from others."""

from collections.abc import Mapping, Sequence
from dataclasses import MISSING, dataclass, fields, replace
from functools import cache
from typing import Any

import orchestrator.regress.comparison as comparison
from fmus.errors import MisfitError
from orchestrator.measurements.toml_values import TomlTable, number
from orchestrator.measurements.wording import nearest, shown
from orchestrator.regress.comparison import Check, Signal, Tolerance, combine
from orchestrator.regress.comparison.expression import variables_of


@dataclass(frozen=True)
class Formula:
    """A formula over variables of the model, and the unit of what comes out."""

    text: str
    unit: str = ""


def read_formulas(table: TomlTable) -> dict[str, Formula]:
    """Formulas by the signal they make: `energy = "0.5*J*w**2"` or `{ formula = "0.5*J*w**2", unit = "J" }`.

    Raises:
        MisfitError: if an entry is neither, or a formula cannot be read.
    """
    found = {}
    for name, given in table.values.items():
        parts = {"formula": given} if isinstance(given, str) else given
        if not isinstance(parts, dict) or set(parts) - {"formula", "unit"} or not isinstance(parts.get("formula"), str):
            raise table.wrong(name, '"FORMULA" or { formula = "...", unit = "..." }')
        found[name] = Formula(parts["formula"], str(parts.get("unit", "")))
        variables_of(name, found[name].text)
    return found


def variables_for(names: Sequence[str], formulas: Mapping[str, Formula]) -> tuple[str, ...]:
    """The variables that have to be recorded for signals, some of which are formulas."""
    wanted: list[str] = []
    for name in names:
        wanted += variables_of(name, formulas[name].text) if name in formulas else [name]
    return tuple(dict.fromkeys(wanted))


def with_formulas(
    names: Sequence[str], formulas: Mapping[str, Formula], signals: Mapping[str, Signal]
) -> dict[str, Signal]:
    """The named signals: recorded, or computed where all variables of their formula are there.

    Args:
        names: the signals that are wanted.
        formulas: formulas by the names of the signals that they make.
        signals: what was recorded.
    """
    found = {}
    for name in names:
        if name not in formulas:
            if name in signals:
                found[name] = signals[name]
        elif all(each in signals for each in variables_of(name, formulas[name].text)):
            found[name] = combine(name, formulas[name].text, signals, formulas[name].unit)
    return found


def check_names(formulas: Mapping[str, Formula], names: Sequence[str]) -> None:
    """Refuse a formula that the model has a variable for, and one that nothing checks.

    Raises:
        MisfitError: names the formula.
    """
    for name in formulas:
        if name not in names:
            raise MisfitError(f"formula {name}: nothing checks it; add [signals.{name}], or leave the formula out")


DEFAULT = "tube"
# What these demand is no matter of how near a reference is; the tolerance of the case would loosen them.
_OF_THEIR_OWN = ("bounds", "conserved", "statistics", "steady_state")
_NOT_CHECKS = ("Check", "Signal", "SignalVerdict", "Tolerance")
_TOLERANCE = tuple(field.name for field in fields(Tolerance))


@cache
def check_kinds() -> dict[str, type[Any]]:
    """Kinds of checks by their name in case files: `end_value` for the class EndValue."""
    found = {}
    for name in comparison.__all__:
        made = getattr(comparison, name)
        if name not in _NOT_CHECKS and isinstance(made, type) and hasattr(made, "judge"):
            found["".join(f"_{c.lower()}" if c.isupper() else c for c in name).lstrip("_")] = made
    return found


def default_check(tolerance: Tolerance) -> Check:
    """A tube around the reference."""
    return _made(DEFAULT, {}, tolerance, "")


def read_signals(table: TomlTable, tolerance: Tolerance) -> dict[str, tuple[Check, ...]]:
    """Checks by signal; where a check against a reference says nothing of its tolerance, that of the case holds.

    Raises:
        MisfitError: if a kind or key is unknown, or a value is of another type.
    """
    found: dict[str, tuple[Check, ...]] = {}
    for name, given in table.values.items():
        several = given if isinstance(given, list) else [given]
        if not several or not all(isinstance(each, dict) for each in several):
            raise table.wrong(name, "a table [signals.NAME], or several [[signals.NAME]]")
        found[name] = tuple(_check(TomlTable(f"{table.where} {name}", each), tolerance) for each in several)
    return found


def read_tolerance(table: TomlTable, usual: Tolerance | None = None) -> Tolerance:
    """A tolerance; what the table leaves out is as usual."""
    unknown = [key for key in table.values if key not in _TOLERANCE]
    if unknown:
        raise MisfitError(f"{table.where}: unknown key {shown(unknown[0])}; {nearest(unknown[0], _TOLERANCE)}")
    return replace(usual or Tolerance(), **{key: _at_least_zero(table, key) for key in table.values})


def _check(table: TomlTable, tolerance: Tolerance) -> Check:
    kind = table.values.get("check", DEFAULT)
    if not isinstance(kind, str) or kind not in check_kinds():
        raise MisfitError(f"{table.where}: check = {shown(kind)}; {nearest(str(kind), check_kinds())}")
    own = TomlTable(table.where, {k: v for k, v in table.values.items() if k in _TOLERANCE})
    rest = {k: v for k, v in table.values.items() if k not in _TOLERANCE and k != "check"}
    usual: Tolerance = check_kinds()[kind].tolerance if kind in _OF_THEIR_OWN else tolerance
    return _made(kind, rest, read_tolerance(own, usual), table.where)


def _made(kind: str, values: Mapping[str, Any], tolerance: Tolerance, where: str) -> Check:
    made = check_kinds()[kind]
    known = {field.name: field for field in fields(made)}
    for key, value in values.items():
        if key not in known or key == "tolerance":
            keys = [*_TOLERANCE, *(k for k in known if k != "tolerance")]
            raise MisfitError(f"{where}: unknown key {shown(key)} of the check {kind}; {nearest(key, keys)}")
        if isinstance(value, dict) or (isinstance(value, float) and value != value):
            raise MisfitError(f"{where}: {key} = {shown(value)} of the check {kind}; expected a plain value")
    needed = [n for n, f in known.items() if f.default is MISSING and f.default_factory is MISSING and n != "tolerance"]
    missing = [name for name in needed if name not in values]
    if missing:
        raise MisfitError(f"{where}: the check {kind} needs {', '.join(missing)}")
    given = {key: tuple(value) if isinstance(value, list) else value for key, value in values.items()}
    try:
        return made(**given, tolerance=tolerance)
    except (TypeError, ValueError, MisfitError) as error:
        raise MisfitError(f"{where}: the check {kind}: {error}") from error


def _at_least_zero(table: TomlTable, key: str) -> float:
    value = number(table.values[key])
    limits = key in ("from_s", "until_s")
    if value is None or (value < 0.0 and not limits):
        raise table.wrong(key, "a finite number" + ("" if limits else ", 0 or more"))
    return value
