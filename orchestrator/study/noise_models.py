"""How far corrections may be off, learnt from what a bench can see of them: force, motion, stops."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmus.errors import MisfitError
from orchestrator.gp.fit import Fit, fit
from orchestrator.gp.limits import Limits
from orchestrator.gp.noise import AddedNoise, LearntNoise
from orchestrator.gp.noise_fit import FittedNoise, fit_noise
from orchestrator.gp.observations import observe
from orchestrator.study.conditioned import Conditioned, coefficients
from orchestrator.study.corrections import SENSOR_N, Corrections
from orchestrator.study.initial import Initial, expected

Array = NDArray[Any]
_FORCE_N, _WAY_RAD = 5.0, 0.02
_FEATURES = ("log deviation", "force", "motion", "stop")
KINDS = {"constant": 1, "force": 2, "observed": 4}
# A muscle of less force on the bench, rms of a component: what others leave unexplained would count as its own.
_WEAK_N = 10.0
_STARTS = ((0.0, 0.0, 0.0, 3.0), (2.0, 0.5, 0.0, 1.0))


def learn(kind: str, given: Conditioned, corrections: Corrections) -> FittedNoise:
    """Learn the noise of all corrections by joint marginal likelihood with the models' hyperparameters held.

    Kinds: `constant` is one deviation for all; `force` lets it grow with the predicted force; `observed` also with the way that
    a joint went within the window, and by a factor where a joint touched an end.
    """
    if kind not in KINDS:
        raise MisfitError(f"noise of kind {kind!r}; expected one of {', '.join(KINDS)}")
    count = KINDS[kind]
    known = np.full(len(given.residuals), SENSOR_N)
    noise = AddedNoise(_features(given, corrections)[:, :count], np.zeros(count), _FEATURES[:count], known)
    return fit_noise(given.residuals, given.covariance, noise, [start[:count] for start in _STARTS])


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
