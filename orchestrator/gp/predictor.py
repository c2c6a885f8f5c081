"""Means at one point after another, with all prepared that does not depend on the point."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmus.errors import MisfitError
from orchestrator.gp.covariance import known, shaped
from orchestrator.gp.posterior import Posterior

Array = NDArray[Any]


class Predictor:
    """The expected values of latent functions at one point: called with (d,), gives (functions, components).

    Several times as fast as `Posterior.mean`, since data are sorted and scaled once; for loops in real time.
    """

    def __init__(self, posterior: Posterior, names: Sequence[str]) -> None:
        known(posterior.latents, dict.fromkeys(names))
        self.names = tuple(names)
        self._inputs, self._components = posterior.rows.inputs.shape[1], posterior.weights.shape[1]
        self._parts = []
        for name in names:
            a = posterior.rows.coefficients.get(name, np.zeros(0))
            seen = np.flatnonzero(a)
            kernel = posterior.latents[name].kernel.towards(posterior.rows.inputs[seen])
            self._parts.append((kernel, a[seen, None] * posterior.weights[seen], posterior.latents[name].mean))

    def __call__(self, x: Array) -> Array:
        """Expected values at x.

        Raises:
            MisfitError: if x is no finite point of the right size.
        """
        if x.shape != (self._inputs,) or not np.isfinite(x).all():
            raise MisfitError(f"a prediction at {x}; expected {self._inputs} finite inputs")
        found = np.empty((len(self._parts), self._components))
        for k, (kernel, weights, mean) in enumerate(self._parts):
            found[k] = kernel(x) @ weights
            if mean is not None:
                found[k] += shaped(self.names[k], mean(x[None, :]), (1, self._components))[0]
        return found
