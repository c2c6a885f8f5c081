"""What corrections say beyond the bench: their covariance given the bench data, computed once and reused by every draw.

Bench data see one subsystem each, so given them the subsystems are still independent of each other. A set of corrections c then
has mean sum_j a_j mu_j(c) and covariance S + noise with S = sum_j a_j a_j' C_j(c, c), and moves the prediction of muscle m at g by
a_m C_m(g, c) (S + noise)^-1 (force - mean): the exact joint posterior (the Schur complement of the bench block).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orchestrator.gp.covariance import factor
from orchestrator.gp.posterior import condition
from orchestrator.gp.triangle import solve_lower
from orchestrator.study.corrections import Corrections
from orchestrator.study.initial import Initial
from orchestrator.study.muscles import MUSCLES, capabilities

Array = NDArray[Any]
_NINETY = 1.6448536269514722  # standard deviations to either side
_Q1, _Q2 = np.meshgrid(np.linspace(0.0, 1.5, 13), np.linspace(0.5, 2.2, 15), indexing="ij")
GRID = np.column_stack([_Q1.ravel(), _Q2.ravel(), np.zeros(_Q1.size), np.zeros(_Q1.size)])


@dataclass(frozen=True, eq=False)
class Conditioned:
    """Corrections given the bench data: residuals (n, 2), covariance S (n, n), predicted force (n, 2).

    `reach` (6, g, n) are the covariances of each muscle on the grid with the corrections, `off` (6, g, 2) the errors of the
    models there before any correction.
    """

    residuals: Array
    covariance: Array
    predicted: Array
    reach: Array
    off: Array

    @property
    def before(self) -> Array:
        """Error of each muscle's model over the grid without corrections, (6,), N."""
        return size_over_grid(self.off)

    def errors(self, deviation: Array, chosen: Array) -> Array:
        """Errors over the grid, (6,) N, of the models after some corrections with these standard deviations of noise, (n,)."""
        matrix = self.covariance[np.ix_(chosen, chosen)]
        matrix[np.diag_indices_from(matrix)] += deviation[chosen] ** 2
        weights = solve_lower(factor(matrix), self.residuals[chosen])
        return size_over_grid(self.off + self.reach[:, :, chosen] @ weights)

    def improvement(self, deviation: Array) -> Array:
        """Share of the error over the grid that all corrections remove, (6,); negative where they harm."""
        return 1.0 - self.errors(deviation, np.arange(len(self.residuals))) / self.before

    def coverage(self, deviation: Array, groups: Array) -> float:
        """Share of force components inside their 90 % intervals, each predicted from the corrections of other groups, (n,).

        With P the inverse covariance of all, a block B left out is predicted with errors P_BB^-1 (P r)_B and covariance P_BB^-1.
        """
        lower = factor(self.covariance + np.diag(deviation**2))
        precision = solve_lower(lower, np.eye(len(lower)))
        solved = precision @ self.residuals
        inside = 0
        for group in np.unique(groups):
            block = np.flatnonzero(groups == group)
            spread = np.linalg.inv(precision[np.ix_(block, block)])
            limit = _NINETY * np.sqrt(np.diagonal(spread))
            inside += int(np.count_nonzero(np.abs(spread @ solved[block]) <= limit[:, None]))
        return inside / self.residuals.size

    def rows(self, chosen: Array) -> "Conditioned":
        """The same with some of the corrections, by number or by a mask."""
        covariance = self.covariance[chosen][:, chosen]
        return replace(
            self,
            residuals=self.residuals[chosen],
            covariance=covariance,
            predicted=self.predicted[chosen],
            reach=self.reach[:, :, chosen],
        )


def size_over_grid(errors: Array) -> Array:
    """Root mean square over the grid of the size of a force, (..., g, 2) -> (...)."""
    return np.sqrt((errors**2).sum(axis=-1).mean(axis=-1))


def given_bench(initial: Initial, corrections: Corrections) -> Conditioned:
    """Condition all subsystems on their bench data and look at the corrections from there.

    The models see as many of the inputs (q1, q2, w1, w2) as the bench data have.
    """
    inputs = initial.inputs
    states, grid = corrections.state[:, :inputs], GRID[:, :inputs]
    count = len(states)
    predicted, covariance = np.zeros((count, 2)), np.zeros((count, count))
    reach, off = [], []
    true = capabilities(GRID, initial.limb)
    for place, (name, a) in enumerate(coefficients(corrections).items()):
        known = condition({name: initial.latents[name]}, [initial.observations[place]])
        predicted += a[:, None] * known.mean(name, states)
        covariance += np.outer(a, a) * known.covariance(name, states, name, states)
        if name in MUSCLES:
            reach.append(a * known.covariance(name, grid, name, states))
            off.append(known.mean(name, grid) - true[:, MUSCLES.index(name)])
    return Conditioned(corrections.force - predicted, covariance, predicted, np.array(reach), np.array(off))


def coefficients(corrections: Corrections) -> Mapping[str, Array]:
    """What each subsystem counts in a correction: minus the statics, minus each activation times its capability."""
    count = len(corrections)
    return {"statics": -np.ones(count)} | {name: -corrections.activation[:, k] for k, name in enumerate(MUSCLES)}
