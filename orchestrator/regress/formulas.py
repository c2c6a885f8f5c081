"""Signals that a case computes from others, such as an energy, so that a law for it can be checked."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from fmus.errors import MisfitError
from orchestrator.measurements.toml_values import TomlTable
from orchestrator.regress.comparison import Signal, combine
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
    """The named signals: recorded, or computed where all variables of their formula are there."""
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
