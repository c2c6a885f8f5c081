"""Cards of the user's own, checked against the model that they are meant for, before any time is spent on them."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from difflib import get_close_matches
from typing import Any

import numpy as np

from fmus.errors import MisfitError
from fmus.symbolic.system import SymbolicSystem, Variable
from orchestrator.library.cards import EffectCard


def check_slots(card: EffectCard, model: str, slots: Sequence[str]) -> None:
    """Refuse a card whose slots look like misspelt ones of the model.

    Args:
        card: the user's card.
        model: name of the model.
        slots: names of its free slots.

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


def check_absence(card: EffectCard, slot: str, base: SymbolicSystem, extended: SymbolicSystem) -> None:
    """Check that a class does nothing where its card says that the effect is absent.

    A card for one joint or muscle each leaves the others at the class's default, so that is to be the absent value, too.

    Args:
        base: the model. extended: the model with the class in the slot.

    Raises:
        MisfitError: naming card, class and value.
    """
    own = _inside(slot, extended.parameters)
    absent = {p.name: p.absent for p in card.parameters}
    for name, value in absent.items():
        default = own[name].start
        if card.elements != "together" and np.isfinite(value) and default != value:
            raise MisfitError(
                f"{card.card_file} [parameters.{name}]: class {card.class_name} has the default {name} = {default:g} "
                f'{own[name].unit}, but the effect is absent at {value:g}; with elements = "{card.elements}" other sites keep '
                f"the default, so write {value:g} in the class"
            )
    if not all(map(np.isfinite, absent.values())):
        return
    changed = _changed(slot, base, extended, absent)
    if changed:
        others = [f"{name} = {v.start:g} {v.unit}".rstrip() for name, v in own.items() if name not in absent]
        hint = f"; parameters that are not in the card: {', '.join(others)}" if others else ""
        raise MisfitError(
            f"{card.card_file}: class {card.class_name} still changes {changed} where the card says that the effect is absent "
            f"({', '.join(f'{name} = {value:g}' for name, value in absent.items())}){hint}; let the class do nothing there"
        )


def _changed(slot: str, base: SymbolicSystem, extended: SymbolicSystem, absent: Mapping[str, float]) -> str:
    """A rate or an output that a class changes at these values of its parameters, at some point; empty if it changes none.

    What an effect with states of its own shows depends on them, so then outputs are not compared.
    """
    if base.n_delays != extended.n_delays:
        return ""
    random, names = np.random.default_rng(0), [v.name for v in base.states]
    fixed = {v.name: v.start or 0.0 for v in base.parameters}
    values = [
        absent.get(v.name.removeprefix(f"{slot}.").split("[")[0], v.start or 0.0)
        if v.name.startswith(f"{slot}.")
        else fixed.get(v.name, v.start or 0.0)
        for v in extended.parameters
    ]
    for _ in range(3):
        x = {
            v.name: (v.start or 0.0) + 0.1 * (1 + abs(v.start or 0.0)) * random.uniform(-1, 1) for v in extended.states
        }
        u, t = [(v.start or 0.0) + 0.1 * random.uniform(-1, 1) for v in base.inputs], random.uniform(0, 1)
        d = np.zeros(base.n_delays)
        one = _shown(base, base.rhs(t, [x.get(name, 0.0) for name in names], u, d, list(fixed.values())))
        other = _shown(extended, extended.rhs(t, list(x.values()), u, d, values))
        for name in one if len(x) == len(names) else [f"der({state})" for state in names]:
            here, there = one[name], other.get(name, np.nan)
            if np.isfinite([here, there]).all() and abs(there - here) > 1e-6 * (1e-6 + abs(here)):
                return name
    return ""


def _shown(system: SymbolicSystem, found: Any) -> dict[str, float]:
    """Rates and outputs by name, of what `rhs` gives."""
    rates, shown = (np.array(part).ravel().astype(float) for part in found)
    values = {f"der({v.name})": float(rate) for v, rate in zip(system.states, rates, strict=True)}
    names = [v.name for v in system.algebraics]
    return values | {name: float(shown[names.index(name)]) for name in system.outputs if name in names}


def _inside(slot: str, variables: Iterable[Variable]) -> dict[str, Variable]:
    """Variables of a slot by their names in the effect's class, the elements of an array as one."""
    own = [v for v in variables if v.name.startswith(f"{slot}.")]
    return {v.name.removeprefix(f"{slot}.").split("[")[0]: v for v in own}
