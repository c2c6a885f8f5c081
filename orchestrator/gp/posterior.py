"""What is known of latent functions after linear combinations of them were observed: exact Gaussian conditioning."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fmus.errors import MisfitError
from orchestrator.gp.covariance import Latents, covariance, factor, known, mean, shaped, variances
from orchestrator.gp.observations import Observation, Rows, coefficients_of, stacked
from orchestrator.gp.room import CONDITION, require_room
from orchestrator.gp.triangle import solve_half, solve_lower

Array = NDArray[Any]
Of = str | Mapping[str, ArrayLike]


@dataclass(frozen=True, eq=False)
class Posterior:
    """The joint posterior of all latent functions, as the factor of the observations' covariance.

    `lower` is (n, n) with lower lower' = K + noise, `weights` is (n, p), the inverse of that times the residuals of the
    prior mean.
    """

    latents: Latents
    rows: Rows
    lower: Array
    weights: Array

    def mean(self, of: Of, inputs: ArrayLike) -> Array:
        """Expected value, (m, p), of a latent function or of a combination of them, at inputs (m, d)."""
        query = self._query(of, inputs)
        cross = covariance(self.latents, query, self.rows)
        return mean(self.latents, query, self.weights.shape[1]) + cross @ self.weights

    def variance(self, of: Of, inputs: ArrayLike) -> Array:
        """Variance of each component about its mean, (m,), without noise of a new observation."""
        query = self._query(of, inputs)
        explained = self._explained(query)
        # Rounding can leave a variance of -1e-17 where an observation without noise says all.
        return np.maximum(variances(self.latents, query) - (explained * explained).sum(axis=0), 0.0)

    def predict(self, of: Of, inputs: ArrayLike) -> tuple[Array, Array]:
        """`mean`, (m, p), and `variance`, (m,), in two thirds of the time of both."""
        query = self._query(of, inputs)
        cross = covariance(self.latents, query, self.rows)
        expected = mean(self.latents, query, self.weights.shape[1]) + cross @ self.weights
        explained = solve_half(self.lower, cross.T)
        left = variances(self.latents, query) - np.einsum("nm,nm->m", explained, explained)
        return expected, np.maximum(left, 0.0)

    def covariance(self, of: Of, inputs: ArrayLike, other_of: Of, other_inputs: ArrayLike) -> Array:
        """Covariance of a component of one combination with the same component of another, (m, k).

        Args:
            of: a latent function, or coefficients of a combination.
            inputs: points (m, d).
            other_of: the other one.
            other_inputs: its points (k, d).
        """
        one, other = self._query(of, inputs), self._query(other_of, other_inputs)
        explained = self._explained(one).T @ self._explained(other)
        return covariance(self.latents, one, other) - explained

    def gradient(self, of: Of, inputs: ArrayLike) -> Array:
        """Derivative of the mean by the inputs, (m, p, d), for coefficients that do not depend on the inputs.

        Raises:
            MisfitError: if a latent function has a prior mean without its gradient.
        """
        query = self._query(of, inputs)
        count, d = query.inputs.shape
        total = np.zeros((count, self.weights.shape[1], d))
        for name, a in query.coefficients.items():
            latent, b = self.latents[name], self.rows.coefficients.get(name)
            if b is not None:
                slopes = latent.kernel.input_gradient(query.inputs, self.rows.inputs)
                total += a[:, None, None] * np.einsum("mnd,np->mpd", slopes, b[:, None] * self.weights, optimize=True)
            if latent.mean is not None:
                if latent.mean_gradient is None:
                    raise MisfitError(f"the prior mean of {name} has no gradient; give its mean_gradient")
                total += a[:, None, None] * shaped(name, latent.mean_gradient(query.inputs), total.shape)
        return total

    def variance_gradient(self, of: Of, inputs: ArrayLike) -> Array:
        """Derivative of the variance by the inputs, (m, d), for coefficients that do not depend on the inputs."""
        query = self._query(of, inputs)
        weights = solve_lower(self.lower, covariance(self.latents, self.rows, query))
        total = np.zeros(query.inputs.shape)
        for name, a in query.coefficients.items():
            kernel = self.latents[name].kernel
            for k, point in enumerate(query.inputs[:, None, :]):
                # k(x, x) changes with both of its arguments, which count the same.
                total[k] += 2.0 * a[k] ** 2 * kernel.input_gradient(point, point)[0, 0]
                if name in self.rows.coefficients:
                    slope = kernel.input_gradient(point, self.rows.inputs)[0]
                    total[k] -= 2.0 * a[k] * (self.rows.coefficients[name] * weights[:, k]) @ slope
        return total

    def _query(self, of: Of, inputs: ArrayLike) -> Rows:
        x = np.array(inputs, dtype=float, ndmin=2)
        if x.ndim != 2 or x.shape[1] != self.rows.inputs.shape[1]:
            raise MisfitError(f"a query at points of shape {x.shape}; expected (m, {self.rows.inputs.shape[1]})")
        if not np.isfinite(x).all():
            raise MisfitError("a query at a point that is no number; expected finite inputs")
        parts = coefficients_of(of, len(x), "query")
        known(self.latents, parts)
        return Rows(x, parts)

    def _explained(self, query: Rows) -> Array:
        return solve_half(self.lower, covariance(self.latents, self.rows, query))


def condition(latents: Latents, observations: Sequence[Observation]) -> Posterior:
    """The exact joint posterior of all latent functions after all observations.

    Raises:
        MisfitError: if an observation names an unknown latent function, follows from the others up to rounding, or
            there are more than fit into memory.
    """
    rows = stacked(observations)
    known(latents, rows.coefficients)
    require_room(len(rows.inputs), CONDITION)
    residuals, noise = residuals_and_noise(latents, rows, observations)
    matrix = covariance(latents, rows, rows)
    matrix[np.diag_indices_from(matrix)] += noise
    lower = factor(matrix)
    return Posterior(latents, rows, lower, solve_lower(lower, residuals))


def residuals_and_noise(latents: Latents, rows: Rows, observations: Sequence[Observation]) -> tuple[Array, Array]:
    """Values less the prior mean, (n, p), and the variance of the noise, (n,).

    Args:
        latents: the latent functions.
        rows: all rows.
        observations: what was observed at them, in the same order.
    """
    values = np.concatenate([each.values for each in observations])
    deviation = np.concatenate([each.deviation for each in observations])
    return values - mean(latents, rows, values.shape[1]), deviation * deviation
