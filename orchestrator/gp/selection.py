"""The few of many data that say the most."""

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmus.errors import MisfitError
from orchestrator.gp.covariance import Latents, known
from orchestrator.gp.observations import Observation
from orchestrator.gp.posterior import condition

Array = NDArray[Any]


def informative(
    latents: Latents, base: Sequence[Observation], candidates: Observation, count: int, about: Collection[str] = ()
) -> Array:
    """Numbers of the `count` candidates that say most about latent functions, the first the most, each beyond those before it.

    A candidate says log((v + s^2) / (w + s^2)) / 2 nats, with s its noise, v the variance of its value given the base
    and those chosen, and w the same if the functions in question were known (0 if all are). Measured values do not
    count, so outliers are not preferred; noisy data say little and come late. Memory and time of a partial Cholesky
    factorisation with pivots.

    Args:
        about: functions that count, such as those of weak muscles; all if empty.

    Raises:
        MisfitError: if there are not so many candidates, one has no noise, or a function is not there.
    """
    known(latents, dict.fromkeys(about))
    if not 0 < count <= len(candidates.inputs):
        raise MisfitError(f"{candidates.name}: {count} of {len(candidates.inputs)} data to choose; expected 1 or more")
    noise = candidates.deviation**2
    if not np.all(noise > 0.0):
        raise MisfitError(f"{candidates.name}: noise of 0, which says all; expected standard deviations above 0")
    whole = _Left(_covariance(latents, base, candidates), noise)
    rest = {name: latent for name, latent in latents.items() if about and name not in about}
    others = _Left(_covariance(rest, [_without(each, about) for each in base], _without(candidates, about)), noise)
    chosen: list[int] = []
    for _ in range(count):
        says = np.log((whole.variance + noise) / (others.variance + noise))
        says[chosen] = -np.inf
        best = int(np.argmax(says))
        whole.see(best)
        others.see(best)
        chosen.append(best)
    return np.array(chosen)


class _Left:
    """What is left open of candidates, (n,), while one after the other is seen."""

    def __init__(self, covariance: Array, noise: Array) -> None:
        self.variance = np.diagonal(covariance).copy()
        self._covariance, self._noise = covariance, noise
        self._rows: list[Array] = []

    def see(self, place: int) -> None:
        row = self._covariance[place].copy()
        for each in self._rows:
            row -= each[place] * each
        row /= np.sqrt(self.variance[place] + self._noise[place])
        self._rows.append(row)
        self.variance = np.maximum(self.variance - row * row, 0.0)


def _covariance(latents: Latents, base: Sequence[Observation], candidates: Observation) -> Array:
    """Covariance of the candidates' values without noise, given the base, (n, n)."""
    n, of = len(candidates.inputs), candidates.coefficients
    seen = [each for each in base if each.coefficients]
    if not latents or not of:
        return np.zeros((n, n))
    if not seen:  # nothing is known: a datum of nothing leaves the prior
        nothing = replace(candidates.rows(np.array([0])), coefficients={name: np.zeros(1) for name in of})
        seen = [replace(nothing, noise=np.ones(1))]
    return condition(latents, seen).covariance(of, candidates.inputs, of, candidates.inputs)


def _without(observation: Observation, names: Collection[str]) -> Observation:
    """The observation if these functions were known and taken away."""
    left = {name: a for name, a in observation.coefficients.items() if names and name not in names}
    return replace(observation, coefficients=left)
