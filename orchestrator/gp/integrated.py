"""What is known of latent functions when their hyperparameters are not known either: a mixture of posteriors.

At one best set of hyperparameters intervals are too narrow where data are few. Here the sets themselves are drawn from
their posterior: Laplace's approximation at each mode (its curvature by differences of the exact gradient), corrected by
importance weights in two rounds, of which the second draws from what the first one found (Cappe et al., Population
Monte Carlo, 2004).
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray
from scipy.special import logsumexp

from fmus.errors import MisfitError
from orchestrator.gp.covariance import Latent, Latents
from orchestrator.gp.fit import Objective, fit
from orchestrator.gp.likelihood import Likelihood
from orchestrator.gp.limits import Limits, Units, begun, box, weak_priors
from orchestrator.gp.observations import Observation
from orchestrator.gp.posterior import Of, Posterior, condition
from orchestrator.gp.triangle import one_thread
from orchestrator.models.minimise import PROMISE

Array = NDArray[Any]
# Tails of the draws are those of Student's distribution, so that no weight is without bound.
_FREEDOM = 5.0
_CHANGE = 1e-4
# A direction in which the data say less than this about a logarithm is left to the bounds.
_LEAST_PRECISION = 0.05
# Draws in a round by the number of data: with few data more is open, and an evaluation costs next to nothing.
_MANY_DRAWS, _FEW_DATA, _FEW_DRAWS = 200, 120, 60
# Beyond so many data one set of hyperparameters says what all of them say.
OPEN = 200
_POINTS = 100
# Weights below this share of the largest count for nothing.
_NEGLIGIBLE = 1e-4


@dataclass(frozen=True, eq=False)
class Mixture:
    """Posteriors with weights that sum to 1, one for each set of hyperparameters that the data leave open.

    `observations` are the data with the noise of each set.
    """

    posteriors: tuple[Posterior, ...]
    weights: Array
    observations: tuple[tuple[Observation, ...], ...]

    def mean(self, of: Of, inputs: ArrayLike) -> Array:
        """Expected value, (m, p), of a latent function or of a combination of them."""
        return np.tensordot(self.weights, [each.mean(of, inputs) for each in self.posteriors], axes=1)

    def variance(self, of: Of, inputs: ArrayLike) -> Array:
        """Variance of each component about its mean, (m, p), without noise of a new observation: of each set, and
        between them."""
        return self._moments(*self._each(of, inputs))[1]

    def _each(self, of: Of, inputs: ArrayLike) -> tuple[Array, Array]:
        """Mean (k, m, p) and variance (k, m, 1) of each posterior."""
        means = np.array([each.mean(of, inputs) for each in self.posteriors])
        return means, np.array([each.variance(of, inputs) for each in self.posteriors])[:, :, None]

    def _moments(self, means: Array, inside: Array) -> tuple[Array, Array]:
        middle = np.tensordot(self.weights, means, axes=1)
        between = np.tensordot(self.weights, (means - middle) ** 2, axes=1)
        return middle, np.tensordot(self.weights, inside, axes=1) + between

    def representative(self, of: Of, inputs: ArrayLike) -> int:
        """The number of the one posterior that says most nearly what all of them say at some inputs, (m, d).

        For what can hold one set of hyperparameters only, such as an exported block. It is the set with the least mean
        Kullback-Leibler divergence from the normal distributions with the mixture's mean and variance.
        """
        means, inside = self._each(of, inputs)
        middle, variance = self._moments(means, inside)
        own = np.maximum(inside, np.finfo(float).tiny)
        lost = np.log(own) + (variance + (means - middle) ** 2) / own
        return int(np.argmin(lost.mean(axis=(1, 2))))


def integrate(
    latents: Latents,
    observations: Sequence[Observation],
    limits: Mapping[str, Limits] | None = None,
    units: Units | None = None,
    starts: int = 3,
    seed: int = 0,
    draws: int | None = None,
) -> Mixture:
    """Condition on all observations with hyperparameters integrated over their posterior, under weak priors
    (`limits.weak_priors`).

    Args:
        limits, units, starts: as for `fit`.
        draws: sets of hyperparameters in each of two rounds, 200 up to 120 data and 60 beyond if left out; each costs
            one evaluation of the likelihood, those that count a factorisation.

    Raises:
        MisfitError: if a limit is wrong, or no start leads anywhere.
    """
    likelihood = Likelihood(latents, observations)
    limit = weak_priors(likelihood, observations, box(likelihood, observations, limits or {}, units or Units()))
    if draws is None:
        draws = _MANY_DRAWS if likelihood.count <= _FEW_DATA else _FEW_DRAWS
    objective, rng = Objective(likelihood, limit, PROMISE), np.random.default_rng(seed)
    first = begun(likelihood, observations)
    with one_thread():
        modes = _modes(objective, [first, *(first + rng.uniform(-2.3, 2.3, len(first)) for _ in range(starts - 1))])
        if not np.any(limit.high > limit.low):
            return _mixture(likelihood, [modes[0][0]], np.ones(1))
        centres = [(point, _spread(objective, point)) for point, _ in modes]
        share = np.exp(-np.array([value for _, value in modes]) + min(value for _, value in modes))
        points, weights = _weighted(objective, centres, share / share.sum(), draws, rng)
        middle = weights @ points
        off = points - middle
        wide = (off.T * weights) @ off + 1e-6 * np.eye(len(first))
        points, weights = _weighted(objective, [(middle, wide), *centres], np.full(1 + len(modes), 1.0), draws, rng)
        counts = np.flatnonzero(weights > _NEGLIGIBLE * weights.max())
        return _mixture(likelihood, list(points[counts]), weights[counts] / weights[counts].sum())


def fit_for_intervals(name: str, latent: Latent, data: Observation, seed: int = 0) -> tuple[Latent, Observation]:
    """One function and the noise of its data with one set of hyperparameters, chosen so that intervals hold.

    Up to `OPEN` data it is that of `Mixture.representative` over the range of the inputs; more data leave nothing open,
    and it is the most probable one.

    Args:
        name: name of the latent function.
        latent: the function, with first values of its hyperparameters.
        data: what was observed of it.
        seed: of the draws.

    Raises:
        MisfitError: as `fit`.
    """
    if len(data.inputs) > OPEN:
        best = fit({name: latent}, [data], seed=seed)
        return best.latents[name], best.observations[0]
    whole = integrate({name: latent}, [data], seed=seed)
    low, high = data.inputs.min(axis=0), data.inputs.max(axis=0)
    points = np.random.default_rng(seed).uniform(low, high, (_POINTS, data.inputs.shape[1]))
    chosen = whole.representative(name, points)
    return whole.posteriors[chosen].latents[name], whole.observations[chosen][0]


def _mixture(likelihood: Likelihood, points: Sequence[Array], weights: Array) -> Mixture:
    """Posteriors at these parameters; those that have none for rounding are left out."""
    found: list[tuple[float, Posterior, tuple[Observation, ...]]] = []
    for weight, (latents, seen) in zip(weights, map(likelihood.at, points), strict=True):
        with suppress(MisfitError):
            found.append((weight, condition(latents, seen), seen))
    if not found:
        raise MisfitError("the data follow from each other up to rounding; give observations more noise")
    kept = np.array([weight for weight, _, _ in found])
    return Mixture(tuple(each for _, each, _ in found), kept / kept.sum(), tuple(seen for _, _, seen in found))


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
        slopes = {side: objective(point + side * _CHANGE * (np.arange(k) == i))[1] for side in (-1, 0, 1)}
        # Next to a mode the covariance may have no factor, as with little noise and long scales.
        sides = [side for side, slope in slopes.items() if np.isfinite(slope).all()]
        apart = max(sides, default=0) - min(sides, default=0)
        rows.append((slopes[max(sides)] - slopes[min(sides)]) / (apart * _CHANGE) if apart else np.zeros(k))
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
        scipy.stats.multivariate_t(mean[free], cov[np.ix_(free, free)], df=_FREEDOM, allow_singular=True, seed=rng)
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
