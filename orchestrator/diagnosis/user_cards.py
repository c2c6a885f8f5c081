"""Cards of the user's own, checked against the model that they are meant for, before any time is spent on them."""

from collections.abc import Callable, Iterable, Sequence
from difflib import get_close_matches

import numpy as np

from fmus.errors import MisfitError
from fmus.symbolic.system import SymbolicSystem, Variable
from orchestrator.diagnosis.cards import EffectCard


def check_slots(card: EffectCard, model: str, slots: Sequence[str]) -> None:
    """Refuse a card whose slots look like misspelt ones of the model.

    Raises:
        MisfitError: naming the nearest slot. A card whose slots are simply not in the model passes.
    """
    for slot in card.slots:
        near = get_close_matches(slot, slots, n=1, cutoff=0.8)
        if near and slot not in slots:
            raise MisfitError(f"{card.card_file}: slots: {model} has no slot '{slot}'; did you mean '{near[0]}'?")


def check_class(card: EffectCard, slot: str, compiled: Callable[[], SymbolicSystem]) -> None:
    """Check a card against its class, compiled in a slot.

    Args:
        compiled: gives the model with the effect in it.

    Raises:
        MisfitError: if the class does not fit the slot, lacks a parameter of the card or its bounds, if the first guess
            or the grid lies outside them, or if a need names no variable of it, or a phase no two states.
    """
    try:
        found = compiled()
    except MisfitError as error:
        raise MisfitError(f"{card.card_file}: class {card.class_name} does not fit slot {slot}: {error}") from error
    own = _inside(slot, found.parameters)
    shown = _inside(slot, (*found.states, *found.algebraics))
    for number, need in enumerate(card.needs, start=1):
        if need.variable not in shown:
            raise MisfitError(
                f"{card.card_file} [[needs]] {number}: class {card.class_name} has no variable '{need.variable}'; it has"
                f" {', '.join(shown)}"
            )
    for parameter in card.parameters:
        where = f"{card.card_file} [parameters.{parameter.name}]"
        variable = own.get(parameter.name)
        if variable is None:
            raise MisfitError(
                f"{where}: class {card.class_name} has no parameter '{parameter.name}'; it has {', '.join(own) or 'none'}"
            )
        low, high = variable.minimum, variable.maximum
        if low is None or high is None or not low < high:
            raise MisfitError(
                f"{where}: give the parameter both bounds in {card.class_name}, such as {parameter.name}(min=0, max=5)"
            )
        for key, values in (("start", (parameter.start,)), ("grid", parameter.grid)):
            outside = [value for value in values if not low <= value <= high]
            if outside:
                raise MisfitError(
                    f"{where}: {key} = {outside[0]:g} {variable.unit} is outside the class's bounds [{low:g}, {high:g}]"
                )
        needed = {f"{slot}.{parameter.phase}[{k}]" for k in (1, 2)}
        if parameter.phase and not needed <= {v.name for v in found.states}:
            raise MisfitError(
                f"{where}: phase: class {card.class_name} has no states '{parameter.phase}[1]' and '{parameter.phase}[2]'; its"
                f" states are {', '.join(_inside(slot, found.states)) or 'none'}"
            )
        if not np.isfinite(parameter.absent) and (
            parameter.absent != np.inf or len(card.parameters) == 1 or parameter.grid
        ):
            raise MisfitError(
                f"{where}: absent = {parameter.absent}, expected the value at which the effect vanishes (inf for one of several"
                " parameters without a grid)"
            )
    if all(np.isinf(parameter.meaningful) for parameter in card.parameters):
        raise MisfitError(
            f"{card.card_file}: meaningful is infinite for all parameters, so the effect could never matter"
        )


def _inside(slot: str, variables: Iterable[Variable]) -> dict[str, Variable]:
    """Variables of a slot by their names in the effect's class, the elements of an array as one."""
    own = [v for v in variables if v.name.startswith(f"{slot}.")]
    return {v.name.removeprefix(f"{slot}.").split("[")[0]: v for v in own}
