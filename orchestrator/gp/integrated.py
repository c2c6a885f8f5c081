"""What is known of latent functions when their hyperparameters are not known either: a mixture of posteriors.

At one best set of hyperparameters intervals are too narrow where data are few. Here the sets themselves are drawn from
their posterior: Laplace's approximation at each mode (its curvature by differences of the exact gradient), corrected by
importance weights in two rounds, of which the second draws from what the first one found (Cappe et al., Population
Monte Carlo, 2004).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import logsumexp
from scipy.stats import multivariate_t

from fmus.errors import MisfitError
from orchestrator.gp.covariance import Latents
from orchestrator.gp.fit import Objective
from orchestrator.gp.likelihood import Likelihood
from orchestrator.gp.limits import Limits, Units, begun, box, weak_priors
from orchestrator.gp.observations import Observation
from orchestrator.gp.posterior import Of, Posterior, condition
from orchestrator.gp.threads import one_thread
from orchestrator.models.minimise import PROMISE

Array = NDArray[Any]
# Tails of the draws are those of Student's distribution, so that no weight is without bound.
_FREEDOM = 5.0
_CHANGE = 1e-4
# A direction in which the data say less than this about a logarithm is left to the bounds.
_LEAST_PRECISION = 0.05
# Weights below this share of the largest count for nothing.
_NEGLIGIBLE = 1e-4


@dataclass(frozen=True, eq=False)
class Mixture:
    """Posteriors with weights that sum to 1, one for each set of hyperparameters that the data leave open."""

    posteriors: tuple[Posterior, ...]
    weights: Array

    def mean(self, of: Of, inputs: ArrayLike) -> Array:
        """Expected value, (m, p), of a latent function or of a combination of them."""
        return np.tensordot(self.weights, [each.mean(of, inputs) for each in self.posteriors], axes=1)

    def variance(self, of: Of, inputs: ArrayLike) -> Array:
        """Variance of each component about its mean, (m, p), without noise of a new observation: of each set, and
        between them."""
        means = np.array([each.mean(of, inputs) for each in self.posteriors])
        inside = np.array([each.variance(of, inputs) for each in self.posteriors])
        middle = np.tensordot(self.weights, means, axes=1)
        between = np.tensordot(self.weights, (means - middle) ** 2, axes=1)
        return np.tensordot(self.weights, inside, axes=1)[:, None] + between

    @property
    def effective(self) -> float:
        """By how many equal weights the mixture could be made; with a few it is rough."""
        return float(1.0 / np.sum(self.weights**2))


def integrate(
    latents: Latents,
    observations: Sequence[Observation],
    limits: Mapping[str, Limits] | None = None,
    units: Units | None = None,
    starts: int = 3,
    seed: int = 0,
    draws: int = 60,
) -> Mixture:
    """Condition on all observations with hyperparameters integrated over their posterior, under weak priors
    (`limits.weak_priors`).

    Args:
        limits, units, starts: as for `fit`.
        draws: sets of hyperparameters in each of two rounds; each costs one evaluation of the likelihood, those that
            count a factorisation.

    Raises:
        MisfitError: if a limit is wrong, or no start leads anywhere.
    """
    likelihood = Likelihood(latents, observations)
    limit = weak_priors(likelihood, observations, box(likelihood, observations, limits or {}, units or Units()))
    objective, rng = Objective(likelihood, limit, PROMISE), np.random.default_rng(seed)
    first = begun(likelihood, observations)
    with one_thread():
        modes = _modes(objective, [first, *(first + rng.uniform(-2.3, 2.3, len(first)) for _ in range(starts - 1))])
        if not np.any(limit.high > limit.low):
            return Mixture((condition(*likelihood.at(modes[0][0])),), np.ones(1))
        centres = [(point, _spread(objective, point)) for point, _ in modes]
        share = np.exp(-np.array([value for _, value in modes]) + min(value for _, value in modes))
        points, weights = _weighted(objective, centres, share / share.sum(), draws, rng)
        middle = weights @ points
        off = points - middle
        wide = (off.T * weights) @ off + 1e-6 * np.eye(len(first))
        points, weights = _weighted(objective, [(middle, wide), *centres], np.full(1 + len(modes), 1.0), draws, rng)
        counts = np.flatnonzero(weights > _NEGLIGIBLE * weights.max())
        posteriors = tuple(condition(*likelihood.at(points[k])) for k in counts)
    return Mixture(posteriors, weights[counts] / weights[counts].sum())


def _modes(objective: Objective, begins: Sequence[Array]) -> list[tuple[Array, float]]:
    """Points of least value, each once."""
    found: list[tuple[Array, float]] = []
    for begin in begins:
        run = objective.least(np.clip(begin, objective.limit.low, objective.limit.high))
        if np.isfinite(run.value) and all(np.max(np.abs(run.point - point)) > 0.1 for point, _ in found):
            found.append((run.point, run.value))
    if not found:
        raise MisfitError(
            "no start gave a likelihood; give observations more noise, or narrower limits to the hyperparameters"
        )
    return found


def _spread(objective: Objective, point: Array) -> Array:
    """Covariance of the parameters about a mode, by the curvature there."""
    k = len(point)
    rows = []
    for i in range(k):
        step = _CHANGE * (np.arange(k) == i)
        rows.append((objective(point + step)[1] - objective(point - step)[1]) / (2.0 * _CHANGE))
    curvature = np.array(rows)
    values, vectors = np.linalg.eigh(0.5 * (curvature + curvature.T))
    return (vectors / np.maximum(np.where(np.isfinite(values), values, 0.0), _LEAST_PRECISION)) @ vectors.T


def _weighted(
    objective: Objective, centres: Sequence[tuple[Array, Array]], shares: Array, draws: int, rng: np.random.Generator
) -> tuple[Array, Array]:
    """Draws within the bounds about centres, (draws, k), and their weights: posterior by density of the draws."""
    shares = shares / shares.sum()
    free = objective.limit.high > objective.limit.low
    laws = [
        multivariate_t(mean[free], cov[np.ix_(free, free)], df=_FREEDOM, allow_singular=True, seed=rng)
        for mean, cov in centres
    ]
    which = rng.choice(len(laws), size=draws, p=shares)
    points = np.tile(objective.limit.low, (draws, 1))
    points[:, free] = np.array([np.atleast_1d(laws[j].rvs()) for j in which]).reshape(draws, -1)
    density = logsumexp(
        [np.log(share) + np.atleast_1d(law.logpdf(points[:, free])) for share, law in zip(shares, laws, strict=True)],
        axis=0,
    )
    inside = np.all((points >= objective.limit.low) & (points <= objective.limit.high), axis=1)
    values = np.array([-objective(point)[0] if ok else -np.inf for point, ok in zip(points, inside, strict=True)])
    logs = np.where(np.isfinite(values), values - density, -np.inf)
    if not np.isfinite(logs).any():
        points[0], logs[0] = centres[0][0], 0.0
    return points, np.exp(logs - logsumexp(logs))
