"""How probable observations are under hyperparameters, with the exact gradient."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.blas import dsyrk

from orchestrator.gp.covariance import Latents, factor_in_place, known
from orchestrator.gp.kernels.base import Pairs
from orchestrator.gp.noise import LearntNoise
from orchestrator.gp.observations import Observation, stacked
from orchestrator.gp.posterior import residuals_and_noise
from orchestrator.gp.room import LIKELIHOOD, require_room
from orchestrator.gp.triangle import inverse_from_factor, solve_lower

Array = NDArray[Any]
Contract = Callable[[Array], Array]


class Likelihood:
    """The negative logarithm of the marginal likelihood of all observations together, subsystem data and combinations.

    Its argument is `start`-like, (k,): the logarithms of the kernels' values by latent function, then the weights of
    noise to be learnt, in the order of `names`. `logarithmic` says which entries are logarithms.
    """

    def __init__(self, latents: Latents, observations: Sequence[Observation]) -> None:
        self._rows = stacked(observations)
        known(latents, self._rows.coefficients)
        self._latents, self._observations = dict(latents), tuple(observations)
        self.count = len(self._rows.inputs)
        require_room(self.count, LIKELIHOOD)
        self._kept: list[Contract] = []
        # A latent function that no observation names has nothing to be learnt from.
        self._seen = [name for name in latents if np.any(self._rows.coefficients.get(name, 0.0))]
        first: dict[bytes, _Part] = {}
        self._parts = [_Part.of(self._rows.inputs, self._rows.coefficients[name], first) for name in self._seen]
        self._first = tuple(first.values())  # one for each set of places
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
        n, p = residuals.shape
        matrix, slopes = self._covariance(latents)
        # What the last evaluation took is kept until here: memory that goes back to the system is handed out again page
        # by page, which takes as long as the arithmetic.
        self._kept = slopes
        matrix[np.diag_indices(n)] += noise
        factor_in_place(matrix)
        weights = solve_lower(matrix, residuals)
        logarithm = 2.0 * p * np.log(np.diagonal(matrix)).sum() + n * p * np.log(2.0 * np.pi)
        value = 0.5 * (float(np.vdot(residuals, weights)) + logarithm)
        # d value = sum_ij slope_ij d matrix_ij / 2 with slope = p matrix^-1 - weights weights', of which the lower
        # triangle is made.
        slope = dsyrk(-1.0, weights, beta=p, c=inverse_from_factor(matrix), lower=1, overwrite_c=1)
        slope[np.diag_indices(n)] *= 0.5
        entries = slope.ravel(order="K")
        weights_of = {id(part.places): entries[part.places] for part in self._first}
        by_kernel = [part.slope(weights_of[id(part.places)], of) for part, of in zip(self._parts, slopes, strict=True)]
        by_value = [latents[name].kernel.values * each for name, each in zip(self._seen, by_kernel, strict=True)]
        return value, np.concatenate([*by_value, *_by_noise(observations, np.diagonal(slope)), []])

    def _covariance(self, latents: Latents) -> tuple[Array, list[Contract]]:
        """Lower triangle in column order, (n, n), and for each latent function what makes slopes of its kernel's values."""
        matrix = np.zeros((self.count, self.count), order="F")
        entries, slopes = matrix.ravel(order="K"), []
        sums: dict[int, Array] = {}
        for name, part in zip(self._seen, self._parts, strict=True):
            found, contract = latents[name].kernel.on_pairs(part.pairs)
            if part.factors is not None:
                found *= part.factors
            # Where a function stands in the matrix takes as long as the function: those at the same places go there together.
            if id(part.places) in sums:
                sums[id(part.places)] += found
            else:
                sums[id(part.places)] = found
            slopes.append(contract)
        for part in self._first:
            entries[part.places] += sums[id(part.places)]
        return matrix, slopes


@dataclass(frozen=True, eq=False)
class _Part:
    """The pairs of observations that a latent function connects.

    `places` are those of the pairs in the covariance, column after column, `factors` the products of their
    coefficients, None if all are 1.
    """

    pairs: Pairs
    places: Array
    factors: Array | None

    @staticmethod
    def of(points: Array, coefficients: Array, known: dict[bytes, "_Part"]) -> "_Part":
        chosen = np.flatnonzero(coefficients)
        first = known.get(chosen.tobytes())
        pairs = Pairs(points[chosen]) if first is None else first.pairs
        row, column = chosen[pairs.row], chosen[pairs.column]
        places = column * len(points) + row if first is None else first.places
        factors = coefficients[row] * coefficients[column]
        part = _Part(pairs, places, None if np.all(factors == 1.0) else factors)
        return known.setdefault(chosen.tobytes(), part) if first is None else part

    def slope(self, weights: Array, contract: Contract) -> Array:
        """Slopes of the kernel's values, of slopes of the covariance at the places."""
        return contract(weights if self.factors is None else weights * self.factors)


def _by_noise(observations: Sequence[Observation], slope: Array) -> list[Array]:
    found, begin = [], 0
    for each in observations:
        part = slope[begin : begin + len(each.inputs)]
        begin += len(each.inputs)
        if isinstance(each.noise, LearntNoise):
            found.append(part @ each.noise.variance_slopes)
    return found
