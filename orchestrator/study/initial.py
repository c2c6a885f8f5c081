"""The models before any correction: a Gaussian process for the statics and one for each muscle, from bench data."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orchestrator.gp.covariance import Latent
from orchestrator.gp.fit import fit
from orchestrator.gp.kernels import SquaredExponential
from orchestrator.gp.noise import constant_noise
from orchestrator.gp.observations import Observation, observe
from orchestrator.gp.posterior import condition
from orchestrator.study.researcher import Bench

Array = NDArray[Any]


@dataclass(frozen=True, eq=False)
class Initial:
    """Latent functions with their hyperparameters and the bench data as observations of them, in the same order."""

    latents: Mapping[str, Latent]
    observations: tuple[Observation, ...]


def initial_models(bench: Mapping[str, Bench]) -> Initial:
    """Fit each subsystem on its own data by marginal likelihood, fx and fy with one kernel and one noise.

    A muscle's data are the force at full activation less what the model of the statics says for the measured state.
    Length scales are bounded by what the data can show, so that a speed that hardly varies is not declared irrelevant.
    """
    latents: dict[str, Latent] = {}
    observations: list[Observation] = []
    for name, data in bench.items():
        force = data.force
        if observations:
            resting = condition({"statics": latents["statics"]}, observations[:1])
            force = force - resting.mean("statics", data.state)
        ranges = np.ptp(data.state, axis=0)
        start = SquaredExponential(float(np.mean(force**2)), tuple(map(float, ranges)))
        noise = constant_noise(0.05 * float(np.sqrt(np.mean(force**2))), len(force))
        found = fit({name: Latent(start)}, [observe(name, data.state, name, force, noise)])
        latents[name] = found.latents[name]
        deviation = found.observations[0].deviation
        observations.append(observe(name, data.state, name, force, deviation))
    return Initial(latents, tuple(observations))
