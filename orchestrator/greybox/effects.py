"""Effects as results name them, and back: from a fitted set to ids, sites and values, and from these to changes of a model."""

import math
import re
from collections.abc import Sequence
from pathlib import Path

from fmus.catalogue import ModelicaModel
from fmus.errors import MisfitError
from fmus.symbolic.balances import Balance
from orchestrator.effects.changes import AddedState, Change, InputChange, OutputChange, Parameter, Term
from orchestrator.effects.text import summed
from orchestrator.effects.write_back import write_back
from orchestrator.greybox.candidates import Candidate, fits
from orchestrator.greybox.expression import renamed
from orchestrator.greybox.kept import driven
from orchestrator.greybox.laws import Law, laws
from orchestrator.greybox.places import Place, unscaled_places
from orchestrator.greybox.search import FittedSet
from orchestrator.greybox.unit_algebra import combined
from orchestrator.verdicts.result import Estimate, NamedEffect

Z90 = 1.6449


def named_effects(found: FittedSet) -> tuple[NamedEffect, ...]:
    """The effects of a fitted set with 90 % intervals; what was held has an interval of no width."""
    return tuple(_named(found, candidate) for candidate in found.candidates)


def _named(found: FittedSet, candidate: Candidate) -> NamedEffect:
    place, estimates = candidate.place, {}
    for parameter in candidate.law.parameters:
        value, std = found.value(candidate, parameter.name)
        least, most = candidate.limits(parameter)
        low, high = max(value - Z90 * std, least), min(value + Z90 * std, most)
        name = candidate.law.public(parameter.name, place.unit)
        estimates[name] = Estimate(value, parameter.unit(place.units), (low, high))
    return NamedEffect(candidate.id, place.site, estimates, candidate.law.variant)


def with_effects(
    base: ModelicaModel, effects: Sequence[NamedEffect], name: str, folder: Path | None = None, more: Sequence[Law] = ()
) -> ModelicaModel:
    """A class `name` that is a model with effects, written as a person would; `more` are laws beside the shipped ones.

    Args:
        base: the model.
        effects: the effects, each with its site and values.
        name: name of the class.
        folder: where the file is written, as `name.mo`; None: in the cache.
        more: laws beside the shipped ones.

    Raises:
        MisfitError: if an effect is unknown, or the model has no such place for it.
        ModelicaError: if the text of the model cannot be changed.
    """
    system, balances = base.balanced()
    places = unscaled_places(system, balances, driven(system, balances))
    errors = [effect for effect in effects if effect.id == "parameter_error"]
    values = {v.name: v.start or 0.0 for v in system.parameters}
    wrong = {each.site: values[each.site] * (1.0 + each.parameters["share"].value) for each in errors}
    changes = [
        change
        for number, effect in enumerate(effects)
        if effect not in errors
        for change in _changes(effect, places, balances, number, more)
    ]
    return write_back(base, name, changes, wrong, folder)


def law_effects(base: ModelicaModel, law: Law) -> list[NamedEffect]:
    """A law of a card with the values that were found with it, behind the effects that were in the model with it.

    It acts at the site where it was found, else at the first that fits.

    Raises:
        MisfitError: if the card has no values, or the model no such place.
    """
    system, balances = base.balanced()
    places = [p for p in unscaled_places(system, balances, driven(system, balances)) if fits(law, p)]
    if not places:
        raise MisfitError(f"{law.id} cannot be added: {base.name} has no {law.place} of unit {' or '.join(law.units)}")
    place = next((p for p in places if p.site == law.site), places[0]).widened(law.also)
    empty = [p.name for p in law.parameters if not math.isfinite(p.value)]
    if empty:
        raise MisfitError(f"law {law.id}: {empty[0]} has no value; expected `value = NUMBER` in its table of the card")
    values = {
        law.public(p.name, place.unit): Estimate(p.value, p.unit(place.units), (min(ends), max(ends)))
        for p in law.parameters
        for ends in [p.ci90 or (p.value, p.value)]
    }
    return [*map(NamedEffect.of, law.beside), NamedEffect(law.id, place.site, values, law.variant)]


def knows(effect: NamedEffect, base: ModelicaModel, more: Sequence[Law] = ()) -> bool:
    """Whether an effect is a law at a place of a model; `more` are laws beside the shipped ones.

    Args:
        effect: the effect, with its site.
        base: the model.
        more: laws beside the shipped ones.
    """
    system, balances = base.balanced()
    return _found(effect, unscaled_places(system, balances, driven(system, balances)), more) is not None


def _found(effect: NamedEffect, places: Sequence[Place], more: Sequence[Law] = ()) -> tuple[Law, Place] | None:
    for place in places:
        for law in (*laws(), *more):
            called = law.is_called(effect.id, effect.variant, effect.parameters, place.unit)
            if place.site == effect.site and called and fits(law, place):
                return law, place.widened(law.also)
    return None


def _changes(
    effect: NamedEffect, places: Sequence[Place], balances: Sequence[Balance], number: int, more: Sequence[Law] = ()
) -> list[Change]:
    found = _found(effect, places, more)
    if found is None:
        raise MisfitError(f"{effect.id} at {effect.site} cannot be added: the model has no such place for it")
    law, place = found
    names, parameters = {}, {}
    for parameter in law.parameters:
        public = law.public(parameter.name, place.unit)
        own = f"{_plain(effect.id)}{number + 1}_{public}"
        names[parameter.name] = own
        estimate = effect.parameters[public]
        parameters[own] = Parameter(estimate.value, estimate.unit, parameter.description)
    title = law.title_at(place.unit)
    expression = law.written or law.expression
    if "storage" in " ".join((expression, *law.written_states.values())):
        names["storage"] = _storage(effect, number, place, parameters)
    names |= {k: v for k, v in place.coordinates.items()} | {"t": "time"}
    names |= {state: f"{_plain(effect.id)}{number + 1}_{state}" for state in law.states}
    expression = renamed(expression, names)
    begins = {k: renamed(text, names) for k, text in law.starts.items()}
    rates = {**law.states, **law.written_states}
    states = [AddedState(names[k], "", 0.0, renamed(rate, names), begins.get(k, "")) for k, rate in rates.items()]
    if place.kind in ("input", "between_inputs", "parameter"):
        return [InputChange(place.coordinates.get("u", place.site), expression, parameters, title, states)]
    if place.kind in ("output", "response"):
        return [OutputChange(place.coordinates["y"], expression, parameters, title, states)]
    by_input = {b.input: b for b in balances}
    terms: list[Change] = []
    for k, (name, factor) in enumerate(place.adds.items()):
        balance = by_input[name]
        factor *= balance.along
        size = "" if abs(factor) == 1.0 else f"{abs(factor):.12g}*"
        text = f"{'-' * (factor < 0)}{size}({expression})" if size or factor < 0 else expression
        # Parameters are declared once; a second balance of the same law speaks of them by name.
        declared = (parameters, title, states) if k == 0 else ({}, title, [])
        if balance.force and not balance.place:
            terms.append(InputChange(balance.force, summed(balance.force, text), *declared))
        else:
            terms.append(Term(balance.state, balance.place, text, *declared, balance.force))
    return terms


def _storage(effect: NamedEffect, number: int, place: Place, parameters: dict[str, Parameter]) -> str:
    """Declare what the equation multiplies der(x) with, and return its name."""
    assert place.storage is not None
    name = f"{_plain(effect.id)}{number + 1}_storage"
    rated = "speed" if place.kind == "motion" else "state"
    unit = combined((place.units["force"], 1), (place.units["time"], 1), (place.units[rated], -1))
    parameters[name] = Parameter(place.storage, unit, "storage of the equation as given")
    return name


def _plain(effect_id: str) -> str:
    """`coulomb_friction` -> `coulomb`: the first word, as names of parameters begin."""
    return re.split("_", effect_id)[0]
