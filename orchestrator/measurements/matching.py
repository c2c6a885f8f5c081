"""Which column is which model variable: by the table [variables], by name, or by spelling."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from orchestrator.measurements.wording import shown


@dataclass(frozen=True)
class Matching:
    """`column_of` maps a model variable to its column; `notes` name mappings that led nowhere."""

    column_of: Mapping[str, str]
    notes: tuple[str, ...]


def match_columns(columns: Sequence[str], variables: Mapping[str, str], names: Sequence[str]) -> Matching:
    """Match columns with model variables, each at most once.

    An entry of [variables] goes before an equal name, an equal name before an equal spelling, and that before the only
    variable of a coupled system, `component.variable`, whose name inside its component is equal.

    Args:
        columns: the columns of the data, without time.
        variables: the table [variables], column -> model variable.
        names: the inputs and outputs of the model.

    Example:
        >>> dict(match_columns(["alpha_1", "angle"], {"angle": "q"}, ["alpha[1]", "q"]).column_of)
        {'q': 'angle', 'alpha[1]': 'alpha_1'}
    """
    column_of: dict[str, str] = {}
    notes: list[str] = []
    for column, variable in variables.items():
        target = _same(variable, names) or _inside_a_component(variable, names)
        if target is not None and column in columns:
            column_of.setdefault(target, column)
        elif variable != "time":
            notes.append(
                f"column {shown(column)} is mapped to {shown(variable)}, which is no input or output of the model"
            )
    free = [column for column in columns if column not in variables]
    column_of |= {name: name for name in names if name in free and name not in column_of}
    for name in names:
        found = _same(name, [column for column in free if column not in column_of.values()])
        if found is not None:
            column_of.setdefault(name, found)
    for column in [column for column in free if column not in column_of.values()]:
        inside = _inside_a_component(column, names)
        if inside is not None and inside not in column_of:
            column_of[inside] = column
            notes.append(f"column {shown(column)} is taken as {shown(inside)}, the only variable of that name")
    return Matching(column_of, tuple(notes))


def spelling(name: str) -> str:
    """Spell a name as a csv header does, without brackets and dots.

    Example:
        >>> spelling("alpha[1]"), spelling("arm.q[1, 2]")
        ('alpha_1', 'arm_q_1_2')
    """
    return re.sub(r"\W+", "_", name).strip("_")


def _same(name: str, candidates: Sequence[str]) -> str | None:
    if name in candidates:
        return name
    alike = [c for c in candidates if spelling(c) == spelling(name)]
    return alike[0] if alike else None


def _inside_a_component(text: str, names: Sequence[str]) -> str | None:
    """The only variable `component.variable` of a coupled system that is spelt so inside its component."""
    alike = [name for name in names if "." in name and spelling(name.partition(".")[2]) == spelling(text)]
    return alike[0] if len(alike) == 1 else None
