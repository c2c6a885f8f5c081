"""The next experiment where laws at the balance equations explain a record alike."""

import re
from collections.abc import Mapping
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np

from fmus.errors import ComponentError
from orchestrator.diagnosis.advise.next_experiment import Explanation, plan
from orchestrator.diagnosis.advise.thresholds import ALIKE_FORCES, BEYOND, FARTHEST, HOPELESS, NEARLY, POINTS
from orchestrator.diagnosis.fit.evidence import LearningData, smoothed
from orchestrator.greybox.candidates import Candidate
from orchestrator.greybox.diagnose import Outcome, fixed_system
from orchestrator.greybox.expression import evaluate_numbers
from orchestrator.greybox.places import coordinate
from orchestrator.greybox.search import FittedSet
from orchestrator.models.symbolic import SymbolicModel
from orchestrator.verdicts.result import Diagnosis


def with_separating_experiment(found: Diagnosis, outcome: Outcome) -> Diagnosis:
    """Add the experiment that best separates the chosen set from its rivals, judged by free runs.

    What the named set leaves along the learning trials counts as white noise: a difference that is smaller would drown in it.

    Args:
        found: a diagnosis of a model whose equations are known.
        outcome: the search that it rests on.

    Returns:
        The diagnosis as it was if there are no rivals, or no experiment can be simulated.
    """
    decision, case = outcome.decision, outcome.case
    left = found.steps[-1].comparison.learning
    if not decision.rivals or left is None:
        return found
    noise = np.array([case.data.noise_std[name] for name in case.signals])
    floor = np.array([max(left.rmse[name], found.noise_floor[name]) for name in case.signals])
    members = [_explanation(outcome, each) for each in (decision.chosen, *decision.rivals)]
    try:
        chosen = plan(members, LearningData(smoothed(case.data.learning, noise), floor))
    except (ArithmeticError, LookupError, ValueError, ComponentError):  # advice that fails takes no answer with it
        chosen = None
    if (chosen is None or chosen.probability < HOPELESS) and (where := _where_forces_differ(outcome, *_apart(outcome))):
        labels = [member.label for member in members[:2]]
        return replace(found, next_experiment={"effects": labels, "do": f"record a trial that goes to {where}"})
    if chosen is None:
        return found
    return replace(found, next_experiment=chosen.to_json(), experiment_csv=chosen.csv())


def _apart(outcome: Outcome) -> list[tuple[FittedSet, list[Candidate]]]:
    """The chosen set and its first rival, each with the effects that the other lacks."""
    one, other = outcome.decision.chosen, outcome.decision.rivals[0]
    return [(a, [c for c in a.candidates if c.family not in b.key]) for a, b in ((one, other), (other, one))]


def _where_forces_differ(
    outcome: Outcome, one: tuple[FittedSet, list[Candidate]], other: tuple[FittedSet, list[Candidate]]
) -> str:
    """The nearest place where two forces at one balance differ, such as `w = -20 rad/s: there it is 0.2 against -0.2 N.m`.

    Empty if the sets differ in more than a force without a memory each, or nowhere by much.
    """
    if [len(effects) for _, effects in (one, other)] != [1, 1]:
        return ""
    (a,), (b,) = one[1], other[1]
    if a.place.site != b.place.site or not a.place.adds or a.law.states or b.law.states or a.law.asks_for & {"net"}:
        return ""
    texts = sorted({*_used(a), *_used(b)} - {"time"})
    if not texts:
        return ""
    units = {v.name: v.unit for v in (*outcome.case.base.states, *outcome.case.inputs)}
    reached = [_reached(outcome, text, moves=a.place.kind == "motion") for text in texts]
    points = list(product(*(grid for grid, _ in reached)))
    columns = dict(zip(texts, np.array(points).T, strict=True))
    forces = [_force(found, effects[0], columns) for found, effects in (one, other)]
    gap = np.abs(forces[0] - forces[1])
    far = sum(
        np.abs(columns[text] - usual) / (np.ptp(grid) or 1.0)
        for text, (grid, usual) in zip(texts, reached, strict=True)
    )
    k = int(np.argmin(np.where(gap >= NEARLY * gap.max(), far, np.inf)))
    if gap[k] < ALIKE_FORCES * max(float(np.abs(force).max()) for force in forces):
        return ""
    at = " and ".join(
        f"{text} = {value:.3g} {units.get(text, '')}".rstrip() for text, value in zip(texts, points[k], strict=True)
    )
    return f"{at}: there it is {forces[0][k]:.3g} against {forces[1][k]:.3g} {a.place.unit}"


def _used(candidate: Candidate) -> list[str]:
    """Variables of the model that a law's force depends on."""
    names = candidate.place.coordinates
    return [text for key, text in names.items() if re.search(rf"\b{key}\b", candidate.law.expression)]


def _reached(outcome: Outcome, text: str, *, moves: bool) -> tuple[np.ndarray, float]:
    """Values (POINTS,) over what was recorded of a variable and somewhat beyond, and the median of the record."""
    fit = outcome.nominal.fit
    known = {v.name: np.concatenate([run.mean[:, i] for run in fit.runs]) for i, v in enumerate(fit.box.system.states)}
    given = np.concatenate([trial.inputs for trial in fit.trials])
    known |= {v.name: given[:, i] for i, v in enumerate(fit.box.system.inputs)}
    values = coordinate(text, known)
    low, high = float(values.min()), float(values.max())
    if moves and low * high > 0:  # what went one way only can go the other
        low, high = min(low, -high), max(high, -low)
    reach = BEYOND * (high - low)
    return np.linspace(low - reach, high + reach, POINTS), float(np.median(values))


def _force(found: FittedSet, candidate: Candidate, columns: Mapping[str, np.ndarray]) -> np.ndarray:
    """The force (n,) of a fitted law at points of its variables."""
    names: dict[str, Any] = {key: columns[text] for key, text in candidate.place.coordinates.items() if text in columns}
    names |= {p.name: found.value(candidate, p.name)[0] for p in candidate.law.parameters}
    count = len(next(iter(columns.values())))
    return np.broadcast_to(np.asarray(evaluate_numbers(candidate.law.expression, names), dtype=float), count)


def _explanation(outcome: Outcome, chosen: FittedSet) -> Explanation:
    fit, setting = chosen.fit, outcome.setting
    system = fixed_system(outcome, chosen)
    model = SymbolicModel(outcome.case.source.name, system, outcome.case.signals, fit.box.theta, setting.held)
    label = " + ".join(candidate.label for candidate in chosen.candidates)
    size = np.maximum(np.abs(fit.theta), chosen.deviations)
    reach = FARTHEST * np.where(size > 0, size, 1.0)
    low, high = np.maximum(fit.priors.low, fit.theta - reach), np.minimum(fit.priors.high, fit.theta + reach)
    return Explanation(label, model, fit.theta, low, high, fit.runs[0].mean[0])
