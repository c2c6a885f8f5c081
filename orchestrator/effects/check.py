"""Make sure that a changed class is the original and its changes, no more and no less."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fmus.errors import ModelicaError
from fmus.symbolic.system import SymbolicSystem
from orchestrator.effects.changes import Change, InputChange, OutputChange
from orchestrator.effects.locate import Balance
from orchestrator.effects.points import FlatPoints, Values, points, value_of

POINTS = 5
TOLERANCE = 1e-8


@dataclass(frozen=True)
class Written:
    """A change with the names that it has in the flat model now.

    `names` are those of its parameters and states. A term has a `balance`; `inner` is what the plant calls a changed
    input or output.
    """

    change: Change
    names: Mapping[str, str]
    balance: Balance | None = None
    inner: str = ""


def check_changes(
    base: SymbolicSystem,
    flat: FlatPoints,
    changed: SymbolicSystem,
    written: Sequence[Written],
    values: Mapping[str, float],
) -> None:
    """Put the changed model into the original's flat equations, where only the added terms may be left.

    Args:
        base: the original.
        flat: its flat equations.
        changed: the class as it was compiled.
        written: what was added.
        values: the changed parameters.

    Raises:
        ModelicaError: naming what differs.
    """
    _same_interface(base, changed)
    starts = {v.name: v.start for v in changed.parameters}
    for name, value in values.items():
        if starts.get(name) != value:
            raise ModelicaError(f"{name} = {value:g} did not arrive in {changed.name}, which has {starts.get(name)}")
    for part in written:
        for name, parameter in part.change.parameters.items():
            full = part.names[name]
            if starts.get(full) != parameter.value:
                raise ModelicaError(
                    f"{full} = {parameter.value:g} did not arrive in {changed.name}, which has {starts.get(full)}"
                )
    found = list(points(changed, POINTS, seed=3))
    if not found:
        raise ModelicaError(f"{changed.name} has no finite derivatives near its start, so its change was not checked")
    for at in found:
        _check_point(flat, at, written)


def _same_interface(base: SymbolicSystem, changed: SymbolicSystem) -> None:
    for words, before, after in (
        ("inputs", [v.name for v in base.inputs], [v.name for v in changed.inputs]),
        ("outputs", list(base.outputs), list(changed.outputs)),
    ):
        if sorted(before) != sorted(after):
            raise ModelicaError(f"{changed.name} has the {words} {', '.join(after)} instead of {', '.join(before)}")


def _check_point(flat: FlatPoints, at: Values, written: Sequence[Written]) -> None:
    original, added = dict(at), dict[tuple[int, int], float]()
    for part in written:
        change = part.change
        if isinstance(change, OutputChange):
            original[change.output] = at[part.inner]
            if f"der({part.inner})" in at:
                original[f"der({change.output})"] = at[f"der({part.inner})"]
    for part in sorted(written, key=lambda part: not isinstance(part.change, InputChange)):
        change = part.change
        # A term speaks of what the plant has, an output's change of that, too, an input's change of the command.
        here = dict(original if not isinstance(change, InputChange) else at)
        here |= {own: at[full] for own, full in part.names.items()}
        value = value_of(change.expression, here)
        for state in change.states:
            _equal(
                at[f"der({part.names[state.name]})"], value_of(state.derivative_expression, here), change, state.name
            )
        if part.balance is not None:
            place = (part.balance.number, part.balance.row)
            added[place] = added.get(place, 0.0) + part.balance.sign * value
        elif isinstance(change, InputChange):
            _equal(at[part.inner], value, change, change.input)
            original[change.input] = value
        elif isinstance(change, OutputChange):
            _equal(at[change.output], value, change, change.output)
    for number, (equation, rest, size) in enumerate(flat.residuals(original)):
        if rest is None:
            if any(number == place for place, _ in added):
                raise ModelicaError(
                    "the changed equation cannot be evaluated, so the change was not checked; not written"
                )
            continue
        expected = np.array([added.get((number, row), 0.0) for row in range(len(rest))])
        if np.any(np.abs(rest - expected) > TOLERANCE * (size + np.abs(expected))):
            file, line, _ = flat.place(equation)
            raise ModelicaError(
                f"{file}:{line}: the changed class does not say the original's equation and the added terms (what is left "
                f"is {rest}, the terms are {expected}); this is a fault of misfit: please report it with the model"
            )


def _equal(found: float, expected: float, change: Change, name: str) -> None:
    if abs(found - expected) > TOLERANCE * max(abs(found), abs(expected)):
        raise ModelicaError(
            f"{change.title}: '{name}' is {found:g} in the changed class, not {expected:g}; not written"
        )
