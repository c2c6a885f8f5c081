"""A drive in closed loop: a controller that sees a noisy encoder drives it along the planned motion."""

from dataclasses import replace

import numpy as np

from tests.benchmarks.diagnosis.truth.excitation import Plan
from tests.benchmarks.diagnosis.truth.families import Drawn
from tests.benchmarks.diagnosis.truth.native import simulate
from tests.benchmarks.diagnosis.truth.run import nominal_run, run_trial

# Stiffness and damping of the controller: natural frequency in rad/s, and damping ratio.
FREQUENCY, DAMPING = 12.0, 0.7


def close_loop(case: Drawn, random: np.random.Generator) -> Drawn:
    """The case with the torques that a controller gave; effects of commands and sensors are not allowed."""
    if case.machine.name != "drive" or any(i.command or i.sensor or i.reading for i in case.injections):
        raise ValueError("only a drive with effects of its mechanics can be closed in a loop here")
    return replace(case, plans=tuple(_controlled(case, plan, random) for plan in case.plans))


def _controlled(case: Drawn, plan: Plan, random: np.random.Generator) -> Plan:
    """The plan with the torque of the controller, which is straight between samples and holds its last slope's end."""
    machine = case.machine
    every = round(1 / (machine.rate_hz * machine.step))
    # The motion that the plan's torque would make of the nominal machine is what the controller is to follow.
    free = run_trial(machine, replace(plan, run_in_s=0.0))
    wanted = nominal_run(machine, free, plan.inputs)[:, 0]
    speed = np.gradient(wanted, machine.step)
    values = {**machine.values, **case.changed}
    for injection in case.injections:
        values.update(injection.values)
    kind = "two-mass" if "JMotor" in values else "drive"
    count = 2 if kind == "two-mass" else 1
    q, v = np.repeat(plan.q0, count), np.repeat(plan.v0, count)
    torque = plan.inputs[:, 0].copy()
    stiffness, damping = machine.values["J"] * FREQUENCY**2, 2 * DAMPING * machine.values["J"] * FREQUENCY
    now, seen = float(torque[0]), float(q[0])
    for begin in range(0, len(torque) - 1, every):
        end = min(begin + every, len(torque) - 1)
        measured = float(q[0]) + case.recorder.std * float(random.normal())
        rate = (measured - seen) / (every * machine.step) if begin else float(v[0])
        seen = measured
        ahead = float(plan.inputs[end, 0]) + stiffness * (wanted[begin] - measured) + damping * (speed[begin] - rate)
        torque[begin : end + 1] = np.linspace(now, ahead, end + 1 - begin)
        now = ahead
        start = -plan.run_in(machine) * machine.step + begin * machine.step
        positions, speeds = simulate(kind, values, torque[begin : end + 1, None], q, v, start=start, step=machine.step)
        q, v = positions[-1], speeds[-1]
    return replace(plan, inputs=torque[:, None])
