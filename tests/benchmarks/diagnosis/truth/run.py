"""A trial of a machine with effects in it: what really happened, and what a perfect recorder would have read."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from tests.benchmarks.diagnosis.truth.excitation import Plan
from tests.benchmarks.diagnosis.truth.machines import Machine
from tests.benchmarks.diagnosis.truth.native import simulate, simulate_tanks

Series = Callable[[np.ndarray, np.ndarray], np.ndarray]
# Phases of trials are irrational parts of a turn apart.
PHASE_STEP = 2.399963


@dataclass(frozen=True)
class Injection:
    """An effect put into the truth.

    `parameters` are named as in the effect's Modelica class, where it has one. `values` change the simulator's numbers;
    `command` maps (time, inputs) to what acts on the machine, `reading` what acts on it to what is recorded of it, and
    `sensor` (time, outputs) to what the sensors show.
    """

    id: str
    site: str
    parameters: Mapping[str, float]
    values: Mapping[str, float] = field(default_factory=dict)
    command: Series | None = None
    reading: Series | None = None
    sensor: Series | None = None


@dataclass(frozen=True, eq=False)
class Run:
    """A trial from the beginning of its record: `recorded` inputs and `outputs` as perfect recorders show them."""

    time: np.ndarray
    recorded: np.ndarray
    outputs: np.ndarray
    q: np.ndarray
    v: np.ndarray

    def moved(self, k: int, position: float, speed: float) -> "Run":
        """The same with another state at the beginning: coordinate `k` of the simulator is moved."""
        q, v = self.q[:1].copy(), self.v[:1].copy()
        q[0, k] += position
        if speed:
            v[0, k] += speed
        return replace(self, q=q, v=v)


def run_trial(
    machine: Machine,
    plan: Plan,
    injections: Sequence[Injection] = (),
    changed: Mapping[str, float] | None = None,
    *,
    as_recorded: np.ndarray | None = None,
    mujoco: bool = False,
) -> Run:
    """Run a trial with effects, and with `changed` values of the machine.

    With `as_recorded` inputs (n, nu) of the record, they take the place of the plan's after its run-in: the true model
    as a tool would drive it.
    """
    values = {**machine.values, **(changed or {})}
    kind, outputs_of = machine.name, machine.order
    skip = plan.run_in(machine)
    time = np.arange(len(plan.inputs)) * machine.step - skip * machine.step
    acting = plan.inputs
    for injection in injections:
        values.update(injection.values)
        if injection.command is not None:
            acting = injection.command(time, acting)
    recorded = plan.inputs
    for injection in injections:
        if injection.reading is not None:
            recorded = injection.reading(time, recorded)
    if as_recorded is not None:
        acting = _driven(time, plan, injections, as_recorded, skip)
    if values.get("trf"):
        values["trp"] = values.get("trp", 0.0) + PHASE_STEP * plan.index
    if kind == "tanks":
        levels = simulate_tanks(values, acting[:, 0], plan.q0, step=machine.step)
        q, v = levels[:, :2], levels[:, 2:]
    else:
        if kind == "drive" and "JMotor" in values:  # an elastic joint makes the drive one of two masses
            kind = "two-mass"
        double = kind == "two-mass" and machine.name == "drive"
        q0, v0 = (np.repeat(part, 2) if double else part for part in (plan.q0, plan.v0))
        q, v = simulate(kind, values, acting, q0, v0, start=time[0], step=machine.step, mujoco=mujoco)
    outputs = q[:, list(outputs_of)]
    for injection in injections:
        if injection.sensor is not None:
            outputs = injection.sensor(time, outputs)
    parts = (part[skip:] for part in (recorded, outputs, q, v))
    return Run(time[skip:], *parts)


def _driven(
    time: np.ndarray, plan: Plan, injections: Sequence[Injection], as_recorded: np.ndarray, skip: int
) -> np.ndarray:
    """What would act on the machine if the recorded inputs were right: sensor errors undone, command paths applied."""
    clean = plan.inputs
    for injection in injections:
        if injection.reading is not None:
            clean = injection.reading(time, clean)
    error = np.zeros_like(clean)
    error[skip:] = as_recorded - clean[skip:]
    acting = plan.inputs + error
    for injection in injections:
        if injection.command is not None:
            acting = injection.command(time, acting)
    return acting


def nominal_run(machine: Machine, run: Run, inputs: np.ndarray) -> np.ndarray:
    """Outputs (n, ny) of the nominal machine from the state at the beginning of a run, along given inputs (n, nu)."""
    if machine.name == "tanks":
        return simulate_tanks(machine.values, inputs[:, 0], run.q[0], step=machine.step)[:, :2]
    dofs = len(machine.order)
    q, _ = simulate(machine.name, machine.values, inputs, run.q[0, :dofs], run.v[0, :dofs], step=machine.step)
    return q[:, list(machine.order)]
