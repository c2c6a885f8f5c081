"""Hyperparameters that make the observations most probable, found with CasADi and exact gradients."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmus.errors import MisfitError
from orchestrator.gp.covariance import Latents
from orchestrator.gp.likelihood import Likelihood
from orchestrator.gp.limits import Box, Limits, Units, begun, box
from orchestrator.gp.noise import LearntNoise
from orchestrator.gp.observations import Observation
from orchestrator.gp.triangle import one_thread
from orchestrator.models.minimise import PROMISE, Found, minimise

Array = NDArray[Any]
_AT_BOUND = 1e-3
# An evaluation takes time in the cube of the number of data and memory in its square; more data than these are
# represented by a random share.
MOST = 2000
# From so many observations on, a share of them shows the way first: an evaluation costs the cube of their number.
_MANY, _SHARE = 200, 1.0 / 3.0
# Starts that a share of the data leads to points as close as this lead to the same optimum.
_SAME = 0.05


@dataclass(frozen=True, eq=False)
class Fit:
    """Latent functions and observations with the best hyperparameters found, and how they were found.

    `value` is the negative log marginal likelihood, without priors. `values` are those of all starts, `evaluations` how
    often each computed it on all data (0 where a start joined an earlier one). `at_bounds` names parameters at a bound
    that came from the data or the user; `held` those about which the data say nothing.
    """

    latents: Latents
    observations: tuple[Observation, ...]
    parameters: Mapping[str, float]
    value: float
    values: tuple[float, ...]
    evaluations: tuple[int, ...]
    at_bounds: tuple[str, ...]
    held: tuple[str, ...]


def fit(
    latents: Latents,
    observations: Sequence[Observation],
    limits: Mapping[str, Limits] | None = None,
    units: Units | None = None,
    starts: int = 3,
    seed: int = 0,
    promise: float = PROMISE,
) -> Fit:
    """Fit kernels and learnt noise to all observations together, from the values given and from `starts` - 1 others.

    Values that are far from the scale of the data are moved to it first, see `limits.begun`.

    Of more than `MOST` data a random share is fitted, and `value` is that share's.

    BLAS runs in one thread meanwhile: with two, factorisations of this size take up to 100 times as long.

    Args:
        limits: bounds and priors by name of a parameter, such as `strong.length_scales[3]`.
        units: units of the data, for limits that have one.
        promise: nats; a search ends where a step would gain less.
        seed: of the other starts, which lie within a factor of 10 of the first, and of the share of many data that is
            used first.

    Raises:
        MisfitError: if a limit is wrong, or no start leads anywhere.
    """
    if sum(len(each.inputs) for each in observations) > MOST:
        return _of_a_share(latents, observations, limits, units, starts, seed, promise)
    likelihood = Likelihood(latents, observations)
    limit = box(likelihood, observations, limits or {}, units or Units())
    rng = np.random.default_rng(seed)
    first = begun(likelihood, observations)
    others = [rng.uniform(-1.0, 1.0, len(first)) * np.log(10.0) for _ in range(starts - 1)]
    begins = [np.clip(first + move, limit.low, limit.high) for move in (0.0, *others)]
    with one_thread():
        rough = _rough(latents, observations, likelihood, limit, rng, promise)
        runs = _search(Objective(likelihood, limit, promise), rough, begins)
    best = min(runs, key=lambda run: run.value)
    if not np.isfinite(best.value):
        raise MisfitError(
            f"no start of {starts} gave a likelihood; give observations more noise, or narrower limits to the hyperparameters"
        )
    fitted = likelihood.at(best.point)
    width = limit.high - limit.low
    near = (best.point - limit.low < _AT_BOUND) | (limit.high - best.point < _AT_BOUND)
    physical = np.where(likelihood.logarithmic, np.exp(best.point), best.point)
    return Fit(
        latents=fitted[0],
        observations=fitted[1],
        parameters=dict(zip(likelihood.names, map(float, physical), strict=True)),
        value=best.value - limit.prior(best.point)[0],
        values=tuple(run.value for run in runs),
        evaluations=tuple(run.evaluations for run in runs),
        at_bounds=tuple(name for name, at in zip(likelihood.names, near & (width > 0.0), strict=True) if at),
        held=limit.held,
    )


def _of_a_share(
    latents: Latents,
    observations: Sequence[Observation],
    limits: Mapping[str, Limits] | None,
    units: Units | None,
    starts: int,
    seed: int,
    promise: float,
) -> Fit:
    """The fit to `MOST` data drawn at random, with its parameters for all of them."""
    rng, total = np.random.default_rng(seed), sum(len(each.inputs) for each in observations)
    some = [
        each.rows(np.sort(rng.permutation(len(each.inputs))[: max(1, MOST * len(each.inputs) // total)]))
        for each in observations
    ]
    found = fit(latents, some, limits, units, starts, seed, promise)
    whole = [
        replace(each, noise=each.noise.with_weights(part.noise.weights))
        if isinstance(each.noise, LearntNoise) and isinstance(part.noise, LearntNoise)
        else each
        for each, part in zip(observations, found.observations, strict=True)
    ]
    return replace(found, observations=tuple(whole))


class Objective:
    """Likelihood and prior within bounds; NaN where the covariance has no factor."""

    def __init__(self, likelihood: Likelihood, limit: Box, promise: float) -> None:
        self.limit, self.count, self._promise = limit, likelihood.count, promise
        self._likelihood = likelihood

    def __call__(self, parameters: Array) -> tuple[float, Array]:
        try:
            value, slope = self._likelihood(parameters)
        except MisfitError:
            return np.nan, np.full(len(parameters), np.nan)
        prior, prior_slope = self.limit.prior(parameters)
        return value + prior, slope + prior_slope

    def least(self, begin: Array, curvature: Array | None = None) -> Found:
        return minimise(self, begin, self.limit.low, self.limit.high, curvature, self._promise)


def _search(objective: Objective, rough: Objective | None, begins: Sequence[Array]) -> list[Found]:
    """The optimum from each start; of those that meet on a share of the data, the first goes on alone."""
    if rough is None:
        return [objective.least(begin) for begin in begins]
    runs: list[tuple[Array, Found]] = []
    for begin in begins:
        near = rough.least(begin)
        same = [run for point, run in runs if np.max(np.abs(point - near.point)) < _SAME]
        if same:
            run = Found(same[0].point, same[0].value, same[0].curvature, 0)
        elif np.isfinite(near.value):
            run = objective.least(near.point, near.curvature * (objective.count / rough.count))
        else:
            run = objective.least(begin)
        runs.append((near.point, run))
    return [run for _, run in runs]


def _rough(
    latents: Latents,
    observations: Sequence[Observation],
    whole: Likelihood,
    limit: Box,
    rng: np.random.Generator,
    promise: float,
) -> Objective | None:
    """The objective on a share of the data; None where there are few, or where that share leaves a parameter out."""
    if whole.count < _MANY:
        return None
    chosen = (rng.permutation(len(each.inputs))[: max(1, int(_SHARE * len(each.inputs)))] for each in observations)
    part = [each.rows(np.sort(rows)) for each, rows in zip(observations, chosen, strict=True)]
    likelihood = Likelihood(latents, part)
    return Objective(likelihood, limit, promise) if likelihood.names == whole.names else None
