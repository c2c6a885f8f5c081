"""How probable observations are under hyperparameters, with the exact gradient."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotri

from orchestrator.gp.covariance import Latents, covariance, factor, known
from orchestrator.gp.noise import LearntNoise
from orchestrator.gp.observations import Observation, stacked
from orchestrator.gp.posterior import residuals_and_noise, solve_lower

Array = NDArray[Any]


class Likelihood:
    """The negative logarithm of the marginal likelihood of all observations together, subsystem data and combinations.

    Its argument is `start`-like, (k,): the logarithms of the kernels' values by latent function, then the weights of noise to
    be learnt, in the order of `names`. `logarithmic` says which entries are logarithms.
    """

    def __init__(self, latents: Latents, observations: Sequence[Observation]) -> None:
        self._rows = stacked(observations)
        known(latents, self._rows.coefficients)
        self._latents, self._observations = dict(latents), tuple(observations)
        # A latent function that no observation names has nothing to be learnt from.
        self._seen = [name for name in latents if np.any(self._rows.coefficients.get(name, 0.0))]
        kernels = [(name, self._latents[name].kernel) for name in self._seen]
        noises = [(each.name, each.noise) for each in observations if isinstance(each.noise, LearntNoise)]
        self.names = (
            *(f"{latent}.{name}" for latent, kernel in kernels for name in kernel.names),
            *(f"{observation}.{name}" for observation, noise in noises for name in noise.names),
        )
        logs = [np.log(kernel.values) for _, kernel in kernels]
        self.start = np.concatenate([*logs, *(noise.weights for _, noise in noises), []])
        self.logarithmic = np.arange(len(self.start)) < sum(map(len, logs))

    def at(self, parameters: Array) -> tuple[Latents, tuple[Observation, ...]]:
        """Latent functions and observations with these parameters in them."""
        left, latents, observations = parameters, dict(self._latents), []
        for name in self._seen:
            count = len(latents[name].kernel.values)
            latents[name] = replace(latents[name], kernel=latents[name].kernel.with_values(np.exp(left[:count])))
            left = left[count:]
        for each in self._observations:
            if isinstance(each.noise, LearntNoise):
                count = len(each.noise.weights)
                each = replace(each, noise=each.noise.with_weights(left[:count]))
                left = left[count:]
            observations.append(each)
        return latents, tuple(observations)

    def __call__(self, parameters: Array) -> tuple[float, Array]:
        """Value and gradient, (k,).

        Raises:
            MisfitError: where the covariance cannot be factored, see `covariance.factor`.
        """
        latents, observations = self.at(parameters)
        residuals, noise = residuals_and_noise(latents, self._rows, observations)
        matrix = covariance(latents, self._rows, self._rows)
        matrix[np.diag_indices_from(matrix)] += noise
        lower = factor(matrix)
        weights = solve_lower(lower, residuals)
        n, p = residuals.shape
        logarithm = 2.0 * p * np.log(np.diagonal(lower)).sum() + n * p * np.log(2.0 * np.pi)
        value = 0.5 * (float(np.vdot(residuals, weights)) + logarithm)
        # d value = sum_ij slope_ij d matrix_ij with slope = (p matrix^-1 - weights weights') / 2
        slope = 0.5 * (p * _inverse(lower) - weights @ weights.T)
        return value, np.concatenate(
            [*self._by_kernel(latents, slope), *_by_noise(observations, np.diagonal(slope)), []]
        )

    def _by_kernel(self, latents: Latents, slope: Array) -> list[Array]:
        found = []
        for name in self._seen:
            a = self._rows.coefficients[name]
            i = np.flatnonzero(a)
            kernel = latents[name].kernel
            part = a[i, None] * a[i] * slope[np.ix_(i, i)]
            found.append(kernel.values * kernel.contraction(self._rows.inputs[i], part))
        return found


def _by_noise(observations: Sequence[Observation], slope: Array) -> list[Array]:
    found, begin = [], 0
    for each in observations:
        part = slope[begin : begin + len(each.inputs)]
        begin += len(each.inputs)
        if isinstance(each.noise, LearntNoise):
            found.append(2.0 * (part * each.deviation**2) @ each.noise.features)
    return found


def _inverse(lower: Array) -> Array:
    triangle, _ = dpotri(lower, lower=1)  # zeros stay above the diagonal
    whole = triangle + triangle.T
    whole[np.diag_indices_from(whole)] *= 0.5
    return whole
