"""How far corrections may be off, learnt from what a bench can see of them: force, motion, stops."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotri
from scipy.optimize import minimize

from fmus.errors import MisfitError
from orchestrator.gp.covariance import factor
from orchestrator.gp.fit import Fit, fit
from orchestrator.gp.limits import Limits
from orchestrator.gp.noise import LearntNoise
from orchestrator.gp.observations import observe
from orchestrator.gp.triangle import solve_lower
from orchestrator.study.conditioned import Conditioned, coefficients
from orchestrator.study.corrections import SENSOR_N, Corrections
from orchestrator.study.initial import Initial, expected

Array = NDArray[Any]
_FORCE_N, _WAY_RAD = 5.0, 0.02
_FEATURES = ("log deviation", "force", "motion", "stop")
KINDS = {"constant": 1, "force": 2, "observed": 4}
# A muscle of less force on the bench, rms of a component: what others leave unexplained would count as its own.
_WEAK_N = 10.0
_WIDEST = 8.0  # of a weight
_STARTS = ((0.0, 0.0, 0.0, 3.0), (2.0, 0.5, 0.0, 1.0))


@dataclass(frozen=True, eq=False)
class Learnt:
    """Noise that makes all corrections most probable: standard deviation of each, (n,) N, beside that of the force sensor.

    `weights` by name say how its logarithm grows; `value` is the negative logarithm of the probability.
    """

    deviation: Array
    weights: dict[str, float]
    value: float


def learn(kind: str, given: Conditioned, corrections: Corrections) -> Learnt:
    """Learn the weights of a kind of noise by joint marginal likelihood with the models' hyperparameters held.

    Kinds: `constant` is one deviation for all; `force` lets it grow with the predicted force; `observed` also with the way that
    a joint went within the window, and by a factor where a joint touched an end.
    """
    if kind not in KINDS:
        raise MisfitError(f"noise of kind {kind!r}; expected one of {', '.join(KINDS)}")
    count = KINDS[kind]
    features = _features(given, corrections)[:, :count]
    bounds = [(-_WIDEST, _WIDEST)] * count
    runs = [
        minimize(_value, np.array(start[:count]), (features, given), jac=True, method="L-BFGS-B", bounds=bounds)
        for start in _STARTS
    ]
    best = min(runs, key=lambda run: run.fun)
    return Learnt(
        deviation=np.sqrt(_variance(best.x, features)),
        weights={name: float(weight) for name, weight in zip(_FEATURES[:count], best.x, strict=True)},
        value=float(best.fun),
    )


def refit(initial: Initial, corrections: Corrections, given: Conditioned) -> Fit:
    """Fit hyperparameters, and noise that grows with force and motion, to bench data and corrections together.

    Those of muscles that are weak on the bench stay as the bench gave them.
    """
    features = _features(given, corrections)[:, :3]
    noise = LearntNoise(features, np.array([np.log(2.0 * SENSOR_N), 0.1, 0.1]), _FEATURES[:3])
    states = corrections.state[:, : initial.inputs]
    seen = observe("corrections", states, coefficients(corrections), corrections.force, noise)
    limits, units = expected(initial.latents, initial.inputs)
    # Never below the noise of the sensor.
    limits["corrections.log deviation"] = Limits(float(np.log(SENSOR_N)), 5.0)
    limits |= {f"corrections.{name}": Limits(0.0, 3.0) for name in _FEATURES[1:3]}
    for name, bench in zip(initial.latents, initial.observations, strict=True):
        if np.sqrt(np.mean(bench.values**2)) < _WEAK_N:
            kernel = initial.latents[name].kernel
            limits |= {f"{name}.{part}": Limits(at, at) for part, at in zip(kernel.names, kernel.values, strict=True)}
    return fit(initial.latents, [*initial.observations, seen], limits, units, starts=1)


def _variance(weights: Array, features: Array) -> Array:
    """What the sensor has at least, which is known, and what is learnt."""
    return SENSOR_N**2 + np.exp(2.0 * features @ weights)


def _features(given: Conditioned, corrections: Corrections) -> Array:
    force = np.linalg.norm(given.predicted, axis=1)
    return np.column_stack(
        [
            np.ones(len(force)),
            np.log1p(force / _FORCE_N),
            np.log1p(corrections.moved / _WAY_RAD),
            corrections.at_stop,
        ]
    )


def _value(weights: Array, features: Array, given: Conditioned) -> tuple[float, Array]:
    """Negative log likelihood of the corrections given the bench data, and its gradient by the weights."""
    variance = _variance(weights, features)
    matrix = given.covariance.copy()
    matrix[np.diag_indices_from(matrix)] += variance
    lower = factor(matrix)
    solved = solve_lower(lower, given.residuals)
    n, p = solved.shape
    logarithm = p * (2.0 * np.log(np.diagonal(lower)).sum() + n * np.log(2.0 * np.pi))
    value = 0.5 * (float(np.vdot(given.residuals, solved)) + logarithm)
    inverse = np.diagonal(dpotri(lower, lower=1)[0])
    # d value / d variance is half of this, d variance / d weights twice the learnt part times the features.
    return value, ((p * inverse - (solved**2).sum(axis=1)) * (variance - SENSOR_N**2)) @ features
