"""Trials that lack the excitation which an effect needs, and the effect that hides there."""

import numpy as np

from tests.benchmarks.diagnosis.truth.arm_effects import muscle_weakness
from tests.benchmarks.diagnosis.truth.context import Context, Sized
from tests.benchmarks.diagnosis.truth.excitation import Plan, arm_at_work, straight_between_samples, time_grid
from tests.benchmarks.diagnosis.truth.joint_effects import coulomb_friction, viscous_friction
from tests.benchmarks.diagnosis.truth.machines import Machine
from tests.benchmarks.diagnosis.truth.signal_effects import stimulation_delay


def idle_plan(machine: Machine, index: int, seconds: float, hidden: int, random: np.random.Generator) -> Plan:
    """A trial without the excitation: the arm spares muscle `hidden` (from 0), a drive keeps one speed, others rest."""
    time = time_grid(machine, seconds)
    nothing = np.zeros((len(time), len(machine.inputs)))
    if machine.name == "arm":
        inputs, q0, v0 = arm_at_work(time, random, silent=hidden)
        return Plan(index, straight_between_samples(machine, time, inputs), q0, v0)
    if machine.name == "tanks":
        inflow = random.uniform(8e-5, 1.2e-4)
        level = (inflow / machine.values["a1"]) ** 2 / (2 * machine.values["g"])
        return Plan(index, nothing + inflow, np.full(2, level), np.zeros(2))
    if machine.name in ("drive", "two-mass"):
        dofs = len(machine.order)
        return Plan(index, nothing, np.zeros(dofs), np.full(dofs, 4.0 + 0.2 * hidden))
    rest = {"pendulum": [np.pi], "cart": [np.pi, 0.0], "double-pendulum": [-np.pi / 2, 0.0]}[machine.name]
    return Plan(index, nothing, np.array(rest), np.zeros(len(rest)))


def hidden_effect(context: Context, hidden: int, noise: float) -> tuple[Sized, float]:
    """The effect that such trials cannot show, or cannot tell from others, and its size, at an encoder noise in rad.

    Friction slows a drive by a share of its speed that grows with the friction, so what tells a law from another grows
    with the square of it: at these sizes the friction is plain, and its law is lost in the noise.
    """
    name = context.machine.name
    if name == "arm":
        return muscle_weakness(context, hidden), 80.0
    if name == "tanks":
        return stimulation_delay(context), 20.0
    friction = viscous_friction if context.random.random() < 0.5 else coulomb_friction
    return friction(context), 4e-3 * (noise / 1e-3) ** 0.5 if name in ("drive", "two-mass") else 1.0
