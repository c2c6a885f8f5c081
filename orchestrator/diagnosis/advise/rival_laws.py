"""The next experiment where laws at the balance equations explain a record alike."""

from dataclasses import replace

import numpy as np

from fmus.errors import ComponentError
from orchestrator.diagnosis.advise.next_experiment import Explanation, plan
from orchestrator.diagnosis.advise.thresholds import FARTHEST, HOPELESS
from orchestrator.diagnosis.fit.evidence import LearningData, smoothed
from orchestrator.greybox.diagnose import Outcome, fixed_system
from orchestrator.greybox.forces_apart import where_forces_differ
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
    if (chosen is None or chosen.probability < HOPELESS) and (where := _where_forces_differ(outcome)):
        labels = [member.label for member in members[:2]]
        return replace(found, next_experiment={"effects": labels, "do": f"record a trial that goes to {where}"})
    if chosen is None:
        return found
    return replace(found, next_experiment=chosen.to_json(), experiment_csv=chosen.csv())


def _where_forces_differ(outcome: Outcome) -> str:
    """Where the chosen set's force differs from that of its first rival; empty if they differ in more than one effect each."""
    one, other = outcome.decision.chosen, outcome.decision.rivals[0]
    own = [(a, c) for a, b in ((one, other), (other, one)) for c in a.candidates if c.family not in b.key]
    if [fitted for fitted, _ in own] != [one, other]:
        return ""
    return where_forces_differ(outcome, *own)


def _explanation(outcome: Outcome, chosen: FittedSet) -> Explanation:
    fit, setting = chosen.fit, outcome.setting
    system = fixed_system(outcome, chosen)
    model = SymbolicModel(outcome.case.source.name, system, outcome.case.signals, fit.box.theta, setting.held)
    label = " + ".join(candidate.label for candidate in chosen.candidates)
    size = np.maximum(np.abs(fit.theta), chosen.deviations)
    reach = FARTHEST * np.where(size > 0, size, 1.0)
    low, high = np.maximum(fit.priors.low, fit.theta - reach), np.minimum(fit.priors.high, fit.theta + reach)
    return Explanation(label, model, fit.theta, low, high, fit.runs[0].mean[0])
