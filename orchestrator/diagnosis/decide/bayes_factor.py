"""Bayes factor between a law and the simpler one that it contains: the odds between the two, whatever a fit has found.

Friction that is larger near rest is dry friction and a rest of some size that acts below some speed. Such a law says
nothing of either, so its likelihood is the mean over what they may be: the rest as large as matters and up to the
simpler law itself, and the speed any that the record has. A rest that could hide only at speeds where the machine
hardly ever is gains no likelihood.
"""

from collections.abc import Collection
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from fmus.errors import MisfitError
from orchestrator.diagnosis.decide.nested import rest_parts, with_simpler
from orchestrator.diagnosis.decide.thresholds import ACTS_IN, LEAST, MATTERS
from orchestrator.diagnosis.fit.evidence import LearningData, Refit, linearised
from orchestrator.diagnosis.linear.coverage import variables_of
from orchestrator.diagnosis.linear.response import Response
from orchestrator.diagnosis.linear.tangent import orthonormal
from orchestrator.library.cards import Candidate
from orchestrator.models.estimation import Z90

SIZES = np.linspace(MATTERS, 1.0, 41)


@dataclass(frozen=True)
class BayesFactor:
    """Likelihood of a law over that of the simpler one, and between which values of `name` its rest would not show."""

    likelihood: float
    name: str
    unit: str
    hidden: tuple[float, float] | None = None


class BayesFactors:
    """The Bayes factor of each law that contains one of a set's, computed when it is asked for."""

    def __init__(self, best: Refit | None, learning: LearningData, scale: float) -> None:
        self.best, self.learning, self.scale = best, learning, scale
        self._found: dict[tuple[Candidate, Candidate], BayesFactor | None] = {}

    def __call__(self, other: Refit, old: Candidate, by: Candidate) -> float | None:
        """Likelihood of a law over that of the simpler one in its place; None if nothing tells."""
        assert self.best is not None
        if (old, by) not in self._found:
            self._found[old, by] = None
            with suppress(MisfitError):  # runs without the rest may fail where those with it did not
                self._found[old, by] = bayes_factor(self.best, other, old, by, self.learning, self.scale)
        found = self._found[old, by]
        return None if found is None else found.likelihood

    def hidden(self, listed: Collection[tuple[str, str]]) -> list[str]:
        """Where the rest of a law that is not `listed` beside the simpler one (ids of both) would not show, in words."""
        return [
            f"{old.card.id} is named, not {by.card.id}: that would have to act with {r.name} from {r.hidden[0]:.3g} to"
            f" {r.hidden[1]:.3g} {r.unit}, where these data hardly are"
            for (old, by), r in self._found.items()
            if r is not None and r.hidden is not None and (old.card.id, by.card.id) not in listed
        ]


def bayes_factor(
    best: Refit, other: Refit, old: Candidate, by: Candidate, learning: LearningData, scale: float
) -> BayesFactor | None:
    """Return the Bayes factor of a law against the simpler one, to first order in the size of its rest.

    Args:
        best: the set with the simpler law `old`.
        other: the set with the law `by` in its place.
        scale: power of what noise is left, in the metric.

    Returns:
        None if the card of the law does not say with what in the model its shape is compared, or an FMU hides that.
    """
    parts, shapes = rest_parts(other, by, old.card)
    needs = {need.limit: need for need in by.card.needs if isinstance(need.limit, str)}
    if len(shapes) != 1 or other.effects.card_parameters[shapes[0]].name not in needs:
        return None
    there = Response(best, [t.smoother for t in learning.trials])
    if not there.is_formula:
        return None
    shape = other.effects.variables[shapes[0]]
    known = {v.name for v in (*best.model.system.states, *best.model.system.algebraics)}
    need = needs[other.effects.card_parameters[shapes[0]].name]
    series = there.series(variables_of(old, need, known))
    recorded = np.abs(np.concatenate([x for trials in series.values() for x in trials] or [np.zeros(0)]))
    low = float(other.effects.bounds()[0][shapes[0]])
    recorded = recorded[recorded >= low]
    if not recorded.size:
        return None
    points = np.quantile(recorded, ACTS_IN)
    values, sizes = with_simpler(best, other, old, by)
    fixed = np.r_[parts, shapes]
    terms = [
        _terms(best, other, np.where(np.arange(other.size) == shapes[0], x, values), sizes, fixed, learning)
        for x in points
    ]
    slope, curvature = np.array(terms).T / scale
    gains = np.outer(slope, SIZES) - 0.5 * np.outer(curvature, SIZES**2)
    likelihood = np.exp(np.minimum(gains, -np.log(LEAST))).mean(axis=1)
    mean = LEAST + float(np.trapezoid(np.r_[likelihood[0], likelihood], np.r_[0.0, ACTS_IN]))
    free = np.flatnonzero(slope + Z90 * np.sqrt(curvature) >= MATTERS * curvature)
    name = shape.name.removeprefix(f"{by.slot}.")
    if not len(free):
        return BayesFactor(mean, name, shape.unit)
    least = low if free[0] == 0 else float(points[free[0]])
    return BayesFactor(mean, name, shape.unit, (least, float(points[up_to_a_gap(free)[-1]])))


def up_to_a_gap(places: np.ndarray) -> np.ndarray:
    """Of rising integers (n,), n > 0, those from the first one on which follow each other.

    >>> up_to_a_gap(np.array([1, 2, 4, 5])).tolist()
    [1, 2]
    """
    return places[: np.flatnonzero(np.diff(places, append=np.inf) > 1)[0] + 1]


def _terms(
    best: Refit, other: Refit, values: np.ndarray, sizes: np.ndarray, fixed: np.ndarray, learning: LearningData
) -> tuple[float, float]:
    """Slope s and curvature c of the gain s x - c x^2/2 in half the misfit where the rest is a share x of the simpler law.

    Args:
        values: (k,) of the set without the rest.
        sizes: (k,) of the rest where it is as large as the simpler law, 0 elsewhere.
        fixed: places of the parameters of the rest; whatever else was fitted is free.
    """
    alike = [v.name for v in best.model.system.states] == [v.name for v in other.model.system.states]
    begun = best if alike else other  # whose own fit may have gone astray
    fit = replace(begun.fit, values=np.r_[values, begun.fit.values[begun.size :]])
    errors, slopes = linearised(replace(other, fit=fit), learning)
    change, others = slopes[:, : other.size] @ sizes, orthonormal(np.delete(slopes, fixed, axis=1), 1e-9)
    beyond = change - others @ (others.T @ change)
    return -float(beyond @ errors), float(beyond @ beyond)
