"""The arm of the library as a limb to control: what is expected of it, its FMU, and the seven postures of the study."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from orchestrator.control.design import Wanted, gains, linearised
from orchestrator.control.hold import Array, Limb, Ports
from orchestrator.cosim.built import built_fmu
from orchestrator.cosim.component import Component
from orchestrator.cosim.kinds import open_component
from orchestrator.cosim.system import ComponentSpec
from orchestrator.gp.covariance import Latent
from orchestrator.gp.kernels import OnInputs, SquaredExponential
from orchestrator.gp.physics import PriorMean, prior_means_of

PORTS = Ports(
    ("linkage.q[1]", "linkage.q[2]"),
    ("linkage.w[1]", "linkage.w[2]"),
    tuple(f"alpha_{k}" for k in range(1, 7)),
    ("correction_q1", "correction_q2"),
)
MUSCLES = ("anterior deltoid", "posterior deltoid", "biceps", "triceps long head", "triceps short head", "brachialis")
STATICS = "statics"
# rad; the workspace of the study in seven postures.
POSTURES = tuple(
    np.array(each) for each in ((0.3, 1.0), (0.3, 1.7), (0.75, 0.8), (0.75, 1.35), (0.75, 1.9), (1.2, 1.0), (1.2, 1.7))
)
# What a person's arm may differ by from the nominal one: deviations of joint torques in N.m, and over which angles in rad.
DOUBT_STATICS, DOUBT_MUSCLE, ALIKE = 5.0, 4.0, 0.8
# Torque in N.m that is left unbalanced while a posture counts as held.
UNBALANCED = 0.02
BUDGET = 100


def nominal_limb() -> Limb:
    """The arm as the physics model expects it, before anything is learned; states are angles and speeds of shoulder and
    elbow."""
    statics, muscles = prior_means_of("arm", ("tauMuscle[1]", "tauMuscle[2]"), PORTS.states, PORTS.activations)
    latents = {STATICS: _doubted(statics, DOUBT_STATICS)}
    latents |= {name: _doubted(mean, DOUBT_MUSCLE) for name, mean in zip(MUSCLES, muscles, strict=True)}
    return Limb(latents, STATICS, MUSCLES, inputs=4, joints=2, budget=BUDGET)


def _doubted(mean: PriorMean, doubt: float) -> Latent:
    return Latent(OnInputs((0, 1), SquaredExponential(doubt**2, (ALIKE, ALIKE))), mean.mean, mean.gradient)


def arm_component(parameters: Mapping[str, float] | None = None) -> Component:
    """The FMU of the nominal arm, with other parameters where a person's arm differs."""
    component = open_component(ComponentSpec("arm", "fmu", str(built_fmu("arm"))), Path())
    given = parameters or {}
    component.set(list(given), list(given.values()))
    return component


def feedback_at(target: Array, wanted: Wanted | None = None) -> Array:
    """State feedback (2, 4) of torques in N.m, designed on the nominal arm linearised at a posture without activation."""
    at = dict(zip(PORTS.states, [*target, 0.0, 0.0], strict=True))
    a, b = linearised(arm_component(), PORTS.states, PORTS.torques, at)
    return gains(a, b, wanted or Wanted())
