"""The models before any correction: a Gaussian process for the statics and one for each muscle, from bench data."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orchestrator.gp.covariance import Latent
from orchestrator.gp.fit import fit
from orchestrator.gp.kernels import SquaredExponential
from orchestrator.gp.limits import Limits, Units
from orchestrator.gp.noise import constant_noise
from orchestrator.gp.observations import Observation, observe
from orchestrator.gp.posterior import condition
from orchestrator.study.muscles import PAPER, Limb
from orchestrator.study.researcher import Bench

Array = NDArray[Any]
UNITS = ("rad", "rad", "rad/s", "rad/s")
# What is expected of a length scale before any datum, within a factor of two: an arm's joints go about two rad. Bench data hardly
# move, so for speeds this expectation is all there is; without it likelihood declares speeds irrelevant, or noise a pattern.
POSTURE, SPEED = Limits(0.2, 5.0, "rad", median=1.0), Limits(0.1, 30.0, "rad/s", median=1.0)


@dataclass(frozen=True, eq=False)
class Initial:
    """Latent functions with their hyperparameters and the bench data as observations of them, in the same order; whose they are."""

    latents: Mapping[str, Latent]
    observations: tuple[Observation, ...]
    limb: Limb = PAPER

    @property
    def inputs(self) -> int:
        """How many of q1, q2, w1, w2 the models see."""
        return int(self.observations[0].inputs.shape[1])


def initial_models(bench: Mapping[str, Bench], limb: Limb = PAPER) -> Initial:
    """Fit each subsystem on its own data by marginal likelihood, fx and fy with one kernel and one noise.

    A muscle's data are the force at full activation less what the model of the statics says for the measured state.
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
        observed = observe(name, data.state, name, force, noise)
        found = fit({name: Latent(start)}, [observed], *expected([name], data.state.shape[1]))
        latents[name] = found.latents[name]
        deviation = found.observations[0].deviation
        observations.append(observe(name, data.state, name, force, deviation))
    return Initial(latents, tuple(observations), limb)


def expected(names: Iterable[str], inputs: int) -> tuple[dict[str, Limits], Units]:
    """Limits of the length scales of these latent functions with so many inputs, and the units of the data."""
    kinds = (POSTURE, POSTURE, SPEED, SPEED)[:inputs]
    limits = {f"{name}.length_scales[{k + 1}]": limit for name in names for k, limit in enumerate(kinds)}
    return limits, Units(UNITS[:inputs], "N")
