"""The arm of the library as a limb to control: what is expected of it, its FMU, and the seven postures of the study."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from orchestrator.control.design import Margins, Wanted, gains, linearised, margins
from orchestrator.control.hold import Array, Controller, Held, Limb, Ports, Task, hold
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
# An arm that the nominal model does not know: weaker shoulder and brachialis, a stronger biceps, stiffer passive
# tissue, and a force of 14 N that pulls at the wrist.
PERSON = {
    "Fmax[1]": 560.0,
    "Fmax[2]": 640.0,
    "Fmax[3]": 1250.0,
    "Fmax[6]": 560.0,
    "Kp": 10000.0,
    "fx": -12.0,
    "fy": -8.0,
}
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


def margins_at(target: Array, controller: Controller, parameters: Mapping[str, float], step: float) -> Margins:
    """Margins of the loop around the arm with these parameters, linearised where the controller holds it.

    Args:
        target: angles in rad.
        controller: the controller.
        parameters: of the arm, by name.
        step: of the controller, in s.
    """
    activations, slope = controller.slope(np.concatenate([target, np.zeros(2)]))
    at = dict(zip(PORTS.states, [*target, 0.0, 0.0], strict=True)) | dict(
        zip(PORTS.activations, activations, strict=True)
    )
    a, b = linearised(arm_component(parameters), PORTS.states, PORTS.activations, at)
    return margins(a, b @ slope, controller.feedback, step)


@dataclass(frozen=True, eq=False)
class Round:
    """One round through the postures: how each was held, and the margins of its loop."""

    held: tuple[Held, ...]
    margins: tuple[Margins, ...]

    @property
    def error(self) -> float:
        """Root mean square over the postures of the distance in angle, rad."""
        return float(np.sqrt(np.mean([each.error**2 for each in self.held])))


def rounds(
    parameters: Mapping[str, float], count: int, postures: Sequence[Array] = POSTURES, task: Task | None = None
) -> list[Round]:
    """Reach and hold all postures with an arm of these parameters, `count` times; what each round showed is learned for
    the next.

    Args:
        parameters: of the arm, by name.
        count: number of rounds.
        postures: angles in rad.
        task: how long and how exactly each is held.
    """
    task = task or Task()
    middle = np.mean(postures, axis=0)
    controller = Controller(nominal_limb(), feedback_at(middle), len(MUSCLES))
    found = []
    for _ in range(count):
        checked = tuple(margins_at(target, controller, parameters, task.step) for target in postures)
        held = hold(arm_component(parameters), PORTS, controller, postures[0], postures, task)
        found.append(Round(tuple(held), checked))
        for each in held:
            rest = np.concatenate([each.state[:2], np.zeros(2)])
            controller.limb.learn(rest, each.activations, np.zeros(2), UNBALANCED)
    return found
