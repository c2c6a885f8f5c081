"""How far an observation may be from the truth: a known spread, or one learnt from what a bench can observe."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fmus.errors import MisfitError

Array = NDArray[Any]


@dataclass(frozen=True, eq=False)
class LearntNoise:
    """Standard deviation exp(features @ weights) of each observation; the weights are hyperparameters.

    `features` is (n, k), of what is known beside the observation: a one, the logarithm of a force, motion within the
    window, a stop that is touched. `weights` is (k,); `names` says what each weight is of.
    """

    features: Array
    weights: Array
    names: tuple[str, ...]

    def __post_init__(self) -> None:
        for name in ("features", "weights"):
            object.__setattr__(self, name, np.array(getattr(self, name)))
        if self.features.ndim != 2 or self.weights.shape != self.features.shape[1:]:
            raise MisfitError(
                f"noise with features of shape {self.features.shape} and weights of shape {self.weights.shape}; "
                f"expected (n, k) and (k,)"
            )
        if len(self.names) != len(self.weights):
            raise MisfitError(f"noise with {len(self.weights)} weights and {len(self.names)} names")
        if not (np.isfinite(self.features).all() and np.isfinite(self.weights).all()):
            raise MisfitError("noise with features or weights that are no numbers; leave out such observations")

    @property
    def deviation(self) -> Array:
        """Standard deviation of each observation, (n,), in the unit of the values."""
        return np.exp(self.features @ self.weights)

    @property
    def variance_slopes(self) -> Array:
        """Derivative of each variance by each weight, (n, k)."""
        return 2.0 * (self.deviation**2)[:, None] * self.features

    def with_weights(self, weights: Array) -> "LearntNoise":
        """The same noise with other weights."""
        return replace(self, weights=weights)

    def rows(self, chosen: Array) -> "LearntNoise":
        """The noise of some of the observations."""
        return replace(self, features=self.features[chosen])


@dataclass(frozen=True, eq=False)
class AddedNoise(LearntNoise):
    """Learnt noise on top of a known deviation, (n,): sqrt(known^2 + exp(features @ weights)^2).

    For data whose measuring error is known and which hold something else besides, that no function of the inputs explains.
    """

    known: Array

    @property
    def deviation(self) -> Array:
        return np.hypot(self.known, super().deviation)

    @property
    def variance_slopes(self) -> Array:
        return 2.0 * (super().deviation ** 2)[:, None] * self.features

    def rows(self, chosen: Array) -> "AddedNoise":
        return replace(self, features=self.features[chosen], known=self.known[chosen])


def added_noise(known: ArrayLike, deviation: float) -> AddedNoise:
    """A known deviation of each observation, (n,), and one of all to be learnt beside it, from this first guess."""
    spread = np.array(known, dtype=float)
    features = np.ones((len(spread), 1))
    return AddedNoise(features, np.log([_positive(deviation)]), ("log deviation",), spread)


def constant_noise(deviation: float, count: int) -> LearntNoise:
    """One standard deviation for all of `count` observations, to be learnt from this first guess."""
    return LearntNoise(np.ones((count, 1)), np.log([_positive(deviation)]), ("log deviation",))


def growing_noise(deviation: float, magnitude: ArrayLike, floor: float) -> LearntNoise:
    """Noise that grows with a magnitude: deviation * ((|magnitude| + floor) / floor)^power, the power to be learnt from 1.

    Args:
        deviation: at magnitude 0.
        magnitude: (n,) for example the force that the current model predicts. Not the measured one, which has the noise in it.
        floor: in the unit of the magnitude; below it noise hardly grows.
    """
    grown = np.log1p(np.abs(np.asarray(magnitude, dtype=float)) / _positive(floor))
    features = np.column_stack([np.ones_like(grown), grown])
    return LearntNoise(features, np.array([np.log(_positive(deviation)), 1.0]), ("log deviation", "power"))


def _positive(number: float) -> float:
    if not 0.0 < number < np.inf:
        raise MisfitError(f"noise of {number:g}; expected a positive number")
    return number
