"""A proposed law as results show it: formula, sentence, constants, what it was seen over, and what held-out trials say."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from orchestrator.greybox.diagnose import Outcome
from orchestrator.greybox.effects import named_effects
from orchestrator.greybox.expression import renamed
from orchestrator.greybox.laws import Law
from orchestrator.greybox.places import coordinate
from orchestrator.greybox.prepare import seen_by
from orchestrator.greybox.witness import Witness, witnesses
from orchestrator.laws.find import FoundLaw
from orchestrator.laws.terms import Term
from orchestrator.laws.vocabulary import Factor
from orchestrator.verdicts.result import Estimate, NamedEffect


def sentence_of(terms: Sequence[Term], law: Law, values: Mapping[str, Estimate], variables: Mapping[str, str]) -> str:
    """Such as `dry friction that fades with a time constant of 3 s, and viscous friction`.

    Args:
        terms: the terms of the law.
        law: the law.
        values: its values by name.
        variables: the model's variable for each coordinate of the law.
    """
    parts: list[str] = []
    for number, term in enumerate(terms, start=1):
        end = str(number) if len(terms) > 1 else ""
        words = " ".join(_filled(f, term, end, values, variables) for f in term.factors)
        if term.brakes and values[f"k{end}"].value < 0:
            # What usually brakes, holds back or flows away does the opposite.
            parts.append(f"less {words}" if parts else f"{words} (with the opposite sign)")
        else:
            parts.append(f"and {words}" if parts else words)
    return ", ".join(dict.fromkeys(parts))


def _filled(factor: Factor, term: Term, end: str, values: Mapping[str, Estimate], variables: Mapping[str, str]) -> str:
    def value(match: re.Match[str]) -> str:
        if match[1] == "of":
            return variables.get(term.of, term.of)
        found = values.get(match[1] + end) or values[match[1]]  # without a number if several terms share it
        return f"{found.value:.3g} {found.unit if found.unit != '1' else ''}".strip()

    return re.sub(r"\{(\w+)\}", value, factor.words)


@dataclass(frozen=True)
class LawProposal:
    """A formula of a missing force at a site of a model, in `unit`.

    `formula` is in the model's variables and the names of `parameters`; a positive value adds to the balance of the site.
    `coordinates` are the variables in it, `seen` their ranges in the record: beyond them the law is extrapolated. Errors of
    held-out trials are root mean squares of free runs by signal, before with the model as given. `explained_share` is of the
    missing force's power. `alike` are formulas that explain the record as well, `separated_by` says what would tell them apart.
    `beside` are effects of the library that are in the model with it.
    """

    law: Law
    formula: str
    sentence: str
    site: str
    unit: str
    coordinates: Mapping[str, str]
    seen: Mapping[str, tuple[float, float]]
    parameters: Mapping[str, Estimate]
    beside: tuple[NamedEffect, ...]
    explained_share: float
    held_out_before: Mapping[str, float]
    held_out_after: Mapping[str, float]
    held_out_units: Mapping[str, str]
    curve: Witness | None = None
    alike: tuple[str, ...] = ()
    separated_by: str = ""
    card: str = ""
    modelica: str = ""
    picture: str = ""

    @property
    def id(self) -> str:
        """Name of the law and of its files."""
        return self.law.id

    @property
    def effects(self) -> list[NamedEffect]:
        """What a model with the law has in it, the law last."""
        return [*self.beside, NamedEffect(self.id, self.site, self.parameters)]

    def to_json(self) -> dict[str, Any]:
        """Plain values; files are relative to where the command ran, as they were given."""
        return {
            "id": self.id,
            "formula": self.formula,
            "sentence": self.sentence,
            "site": self.site,
            "unit": self.unit,
            "coordinates": list(self.coordinates),
            "coordinate_units": list(self.coordinates.values()),
            "seen": {name: list(ends) for name, ends in self.seen.items()},
            "parameters": {name: asdict(value) for name, value in self.parameters.items()},
            "beside": [asdict(effect) for effect in self.beside],
            "explained_share": self.explained_share,
            "held_out_before": dict(self.held_out_before),
            "held_out_after": dict(self.held_out_after),
            "held_out_units": dict(self.held_out_units),
            "alike": list(self.alike),
            "separated_by": self.separated_by,
            "curve": None if self.curve is None else asdict(self.curve),
            "card": self.card,
            "modelica": self.modelica,
            "picture": self.picture,
        }


def proposal_of(
    outcome: Outcome, found: FoundLaw, before: Mapping[str, float], after: Mapping[str, float], share: float
) -> LawProposal:
    """A found law with its values, for the reader; `before` and `after` are held-out errors, `share` what it explains.

    Args:
        outcome: the search for effects of the library.
        found: the law, fitted.
        before: held-out error of each signal with the model as given, in its unit.
        after: the same with the law.
        share: share of the missing force's power that the law explains.
    """
    candidate, place = found.candidate, found.candidate.place
    *beside, effect = named_effects(found.fitted)  # the law is the last of its set
    own, values = _apart(candidate.law, effect.parameters, place.coordinates.values())
    used = [name for name in place.coordinates if name in _words(own)]
    variables = {name: ("time" if name == "t" else place.coordinates[name]) for name in used}
    seen = _seen(outcome, found)
    law = replace(
        own,
        id=short_id(own.id),
        title=sentence_of(found.terms, candidate.law, effect.parameters, variables),
        units=(place.unit,),
        also={name: place.coordinates[name] for name in used if name.startswith("of_")},
        site=place.site,
        seen={name: seen[name] for name in used},
        beside=tuple(asdict(each) for each in beside),
        parameters=tuple(
            replace(p, value=values[p.name].value, ci90=values[p.name].ci90, grid=() if p.gain else (1.0,))
            for p in own.parameters
        ),
    )
    unit = {"q": "position", "v": "speed", "x": "state", "t": "time"}
    return LawProposal(
        law=law,
        formula=renamed(law.written or law.expression, variables),
        sentence=law.title,
        site=place.site,
        unit=place.unit,
        coordinates={variables[name]: place.units[unit.get(name, name)] for name in used},
        seen={variables[name]: seen[name] for name in used},
        parameters=values,
        beside=tuple(beside),
        explained_share=share,
        held_out_before=before,
        held_out_after=after,
        held_out_units={
            v.name: v.unit for v in (*outcome.case.base.states, *outcome.case.base.algebraics) if v.name in after
        },
        curve=_curve(outcome, found),
    )


def short_id(name: str) -> str:
    """A law's name as a file's: small letters, digits and underscores, at most 60 of them."""
    return re.sub(r"[^a-z0-9_]", "_", name.lower())[:60].strip("_")


def _apart(law: Law, values: Mapping[str, Estimate], variables: Iterable[str]) -> tuple[Law, dict[str, Estimate]]:
    """A law and its values with other names for parameters and states that the model has for its variables."""
    taken = set(re.findall(r"[A-Za-z_]\w*", " ".join(variables)))
    names = {name: f"{name}Law" for name in (*law.states, *(p.name for p in law.parameters)) if name in taken}
    return replace(
        law,
        expression=renamed(law.expression, names),
        written=renamed(law.written, names),
        states={names.get(state, state): renamed(rate, names) for state, rate in law.states.items()},
        parameters=tuple(replace(p, name=names.get(p.name, p.name)) for p in law.parameters),
    ), {names.get(name, name): value for name, value in values.items()}


def _words(law: Law) -> set[str]:
    return set(re.findall(r"[A-Za-z_]\w*", " ".join([law.expression, law.written, *law.states.values()])))


def _seen(outcome: Outcome, found: FoundLaw) -> dict[str, tuple[float, float]]:
    """The range of each coordinate over the learning trials."""
    fit = outcome.nominal.fit
    values = seen_by(fit.box, fit.runs, fit.trials, outcome.case.balances, outcome.case.signals).values
    ranges = {}
    for name, text in found.candidate.place.coordinates.items():
        series = np.asarray(coordinate(text, values))
        ranges[name] = (float(series.min()), float(series.max()))
    return ranges


def _curve(outcome: Outcome, found: FoundLaw) -> Witness | None:
    """The missing force over the coordinate that explains it best, with the law through it."""
    adds = found.candidate.place.adds
    shown = [b for b in outcome.case.balances if b.input in adds]
    pictures = witnesses(outcome.case, outcome.nominal, found.fitted)
    sites = {b.position or b.state for b in shown}
    return next((p for p in pictures if p.balance in sites), None)
