"""What a diagnosis leaves open: doubts about the named parameters, their intervals, and the excitation of every effect."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from orchestrator.diagnosis.advise.identifiability import doubts_of, parameter_names
from orchestrator.diagnosis.advise.profile import Profiled, profiles
from orchestrator.diagnosis.fit.evidence import LearningData, Refit
from orchestrator.diagnosis.linear.calibration import Stage
from orchestrator.diagnosis.linear.collinearity import collinear_effects
from orchestrator.diagnosis.linear.coverage import coverage
from orchestrator.diagnosis.linear.response import Response
from orchestrator.library.cards import Candidate
from orchestrator.verdicts.open_questions import Coverage, Doubt
from orchestrator.verdicts.result import Diagnosis, NamedEffect


def with_open_questions(
    found: Diagnosis,
    named: Refit | None,
    stages: Sequence[Stage],
    learning: LearningData,
    candidates: Sequence[Candidate],
) -> Diagnosis:
    """Add doubts, collinear effects, excitation and better intervals to a diagnosis; what concerns the named effects becomes a warning.

    Args:
        named: the fitted set that is named, None if none is.
        stages: the tests of the search, that of the model without effects first.
        candidates: every effect that could be attached.
    """
    excitation = coverage(stages[0].tangent.response, candidates, {})
    if named is None:
        return replace(found, excitation=tuple(excitation))
    there = Response(named, [t.smoother for t in learning.trials])
    values = {v.name: float(x) for v, x in zip(named.effects.variables, named.values, strict=True)}
    short = [c for c in coverage(there, named.effects.candidates, values) if not c.is_enough]
    others = {name for group in found.confusable for name in group} - set(named.ids)
    short += [c for c in excitation if c.effect in others and not c.is_enough]
    better, names = profiles(named, learning), parameter_names(named)
    curved = [_curved(names[p.position], named, p) for p in better]
    told = {d.parameters for d in curved}
    doubts = [
        d for d in doubts_of(named, learning) if d.kind not in ("at bound", "not pinned") or d.parameters not in told
    ]
    doubts += [*curved, *(_shortage(c) for c in short)]
    effects = _with_intervals(found.effects, named, better)
    return replace(
        found,
        effects=effects,
        steps=(*found.steps[:-1], replace(found.steps[-1], effects=effects)),
        identifiability=tuple(doubts),
        kin=tuple(collinear_effects(named, stages)),
        excitation=tuple(excitation),
        warnings=(*found.warnings, *(d.message for d in doubts)),
    )


def _shortage(short: Coverage) -> Doubt:
    return Doubt("excitation", (short.effect,), short.message)


def _curved(name: str, named: Refit, p: Profiled) -> Doubt:
    value, unit = float(named.values[p.position]), named.effects.variables[p.position].unit
    unit = "" if unit == "1" else f" {unit}"
    low, high = (
        f"{end:.3g}{unit}{', its bound,' if is_open else ''}"
        for end, is_open in ((p.low, p.open_low), (p.high, p.open_high))
    )
    message = f"{name} = {value:.3g}{unit} may lie between {low} and {high} by the profile of its likelihood"
    return Doubt("curved", (name,), message.rstrip(","))


def _with_intervals(
    effects: Sequence[NamedEffect], named: Refit, better: Sequence[Profiled]
) -> tuple[NamedEffect, ...]:
    """The effects with the intervals of profiled parameters in place of those from curvature."""
    owners = np.array(named.effects.owners())
    result = list(effects)
    for p in better:
        owner = int(owners[p.position])
        slot = named.effects.candidates[owner].slot
        own = named.effects.variables[p.position].name.removeprefix(f"{slot}.")
        old = result[owner].parameters[own]
        parameters = {**result[owner].parameters, own: replace(old, ci90=(p.low, p.high))}
        result[owner] = replace(result[owner], parameters=parameters)
    return tuple(result)
