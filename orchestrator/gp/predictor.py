"""Predictions at one point after another, with all prepared that does not depend on the point."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.blas import dtrsv

from fmus.errors import MisfitError
from orchestrator.gp.covariance import Latent, known, shaped
from orchestrator.gp.posterior import Posterior

Array = NDArray[Any]


@dataclass(frozen=True, eq=False)
class _Part:
    """What is prepared of a latent function: the kernel towards the data that see it (s,), their places, what it counts
    there, weights (s, p)."""

    latent: Latent
    kernel: Callable[[Array], Array]
    places: Array
    counts: Array
    weights: Array


class Predictor:
    """Latent functions of a posterior at one point: called with (d,), it gives expected values (functions, components).

    Several times as fast as `Posterior`, since data are sorted and scaled once; for loops in real time.
    """

    def __init__(self, posterior: Posterior, names: Sequence[str]) -> None:
        known(posterior.latents, dict.fromkeys(names))
        self.names = tuple(names)
        self._posterior, self._components = posterior, posterior.weights.shape[1]
        self._parts = {name: _prepared(posterior, name) for name in names}
        self._last: tuple[bytes, dict[str, Array]] = (b"", {})
        self._combined: dict[tuple[tuple[str, float], ...], tuple[Array, float]] = {}

    def __call__(self, x: Array) -> Array:
        """Expected values at x.

        Raises:
            MisfitError: if x is no finite point of the right size.
        """
        kernels, found = self._kernels(x), np.empty((len(self._parts), self._components))
        for k, (name, part) in enumerate(self._parts.items()):
            found[k] = kernels[name] @ part.weights
            if part.latent.mean is not None:
                found[k] += self._expected(name, part, x)
        return found

    def combined(self, coefficients: Mapping[str, float], x: Array) -> tuple[Array, float]:
        """Expected value (p,) and variance of each component of a combination of the functions at x, without noise of
        an observation."""
        kernels = self._kernels(x)
        key = tuple(coefficients.items())
        if key not in self._combined:  # components and deviations of one combination are asked for one after the other
            self._combined[key] = self._combination(coefficients, x, kernels)
        return self._combined[key]

    def _combination(
        self, coefficients: Mapping[str, float], x: Array, kernels: Mapping[str, Array]
    ) -> tuple[Array, float]:
        posterior = self._posterior
        mean, variance, shared = np.zeros(self._components), 0.0, np.zeros(len(posterior.lower))
        for name, factor in coefficients.items():
            part, kernel = self._parts[name], kernels[name]
            mean += factor * (kernel @ part.weights)
            if part.latent.mean is not None:
                mean += factor * self._expected(name, part, x)
            variance += factor * factor * float(part.latent.kernel.diagonal(x[None, :])[0])
            shared[part.places] += factor * part.counts * kernel
        if len(shared):
            explained = dtrsv(posterior.lower, shared, lower=1, overwrite_x=1)
            variance -= float(explained @ explained)
        return mean, max(variance, 0.0)

    def _kernels(self, x: Array) -> dict[str, Array]:
        """Covariances of each function at x with what the data see of it; several things are asked about one point."""
        inputs = self._posterior.rows.inputs.shape[1]
        if x.shape != (inputs,) or not np.isfinite(x).all():
            raise MisfitError(f"a prediction at {x}; expected {inputs} finite inputs")
        key = x.tobytes()
        if key != self._last[0]:
            self._combined = {}
            self._last = (key, {name: part.kernel(x) for name, part in self._parts.items()})
        return self._last[1]

    def _expected(self, name: str, part: _Part, x: Array) -> Array:
        assert part.latent.mean is not None
        return shaped(name, part.latent.mean(x[None, :]), (1, self._components))[0]


def _prepared(posterior: Posterior, name: str) -> _Part:
    a = posterior.rows.coefficients.get(name, np.zeros(0))
    seen = np.flatnonzero(a)
    latent = posterior.latents[name]
    kernel = latent.kernel.towards(posterior.rows.inputs[seen])
    return _Part(latent, kernel, seen, a[seen], a[seen, None] * posterior.weights[seen])
