"""What is done to a machine in a trial: commands, forces, releases."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tests.benchmarks.diagnosis.truth.machines import MACHINES, Machine
from tests.benchmarks.diagnosis.truth.native import simulate

RUN_IN_S = 1.0
_ARM_RANGE = np.array([[-0.05, 0.25], [1.65, 2.35]])
_TONES = {
    "drive": (0.15, 0.4, 0.9, 1.7, 3.1),
    "two-mass": (0.3, 0.8, 2.0, 5.0, 11.0),
    "cart": (0.15, 0.4, 0.8, 2.6),
}


@dataclass(frozen=True, eq=False)
class Plan:
    """A trial before it is run: `inputs` (steps + 1, nu) on the machine's time grid, which begins with a run-in.

    `q0`, `v0` are positions and speeds at the beginning of the run-in; `index` numbers the trials of a case.
    """

    index: int
    inputs: np.ndarray
    q0: np.ndarray
    v0: np.ndarray
    run_in_s: float = RUN_IN_S

    def run_in(self, machine: Machine) -> int:
        """Steps before the record begins."""
        return round(self.run_in_s * machine.slow / machine.step)


def time_grid(machine: Machine, seconds: float) -> np.ndarray:
    """Time from the beginning of the run-in of a trial of `seconds`, stretched as the machine is slow."""
    return np.arange(round((seconds + RUN_IN_S) * machine.slow / machine.step) + 1) * machine.step


def plan_trial(machine: Machine, index: int, seconds: float, random: np.random.Generator) -> Plan:
    """Draw a trial of a machine that moves it richly but stays within its range."""
    time = time_grid(machine, seconds)
    draw: dict[str, Callable[[np.ndarray, np.random.Generator], tuple[np.ndarray, np.ndarray, np.ndarray]]] = {
        "arm": arm_at_work,
        "pendulum": _pendulum,
        "double-pendulum": _double_pendulum,
        "tanks": _tanks,
    }
    if machine.name in draw:
        inputs, q0, v0 = draw[machine.name](time, random)
    else:
        inputs, q0, v0 = _tones(machine.name, time, random)
    return Plan(index, straight_between_samples(machine, time, inputs), q0, v0)


def straight_between_samples(machine: Machine, time: np.ndarray, inputs: np.ndarray) -> np.ndarray:
    """Inputs (n, nu) that are straight between the samples of a record: a perfect recorder misses nothing of them."""
    every = round(1 / (machine.rate_hz * machine.step))
    samples = np.append(np.arange(0, len(time) - 1, every), len(time) - 1)
    columns = [np.interp(time, time[samples], column[samples]) for column in inputs.T]
    return np.column_stack(columns) if columns else inputs


def _pendulum(time: np.ndarray, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    angle = np.pi + random.choice([-1, 1]) * random.uniform(0.4, 2.0, 1)
    return np.zeros((len(time), 0)), angle, random.uniform(-1, 1, 1)


def _double_pendulum(time: np.ndarray, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    q0 = np.array([-np.pi / 2, 0.0]) + random.uniform(-0.5, 0.5, 2)
    return np.zeros((len(time), 0)), q0, np.zeros(2)


def _tones(name: str, time: np.ndarray, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A force whose tones would move the machine, if it were rigid, along a sum of sines without drifting."""
    values = MACHINES[name].values
    inertia = values["J"] if name == "drive" else values.get("JMotor", 0) + values.get("JLoad", 0)
    inertia = inertia or values["M"] + values["m"]
    tones = np.array(_TONES[name]) * random.uniform(0.85, 1.15, len(_TONES[name]))
    size = (0.15 if name == "cart" else 1.0) * random.uniform(0.6, 1.2, len(tones)) * (tones / tones[0]) ** -1.3
    w, phase = 2 * np.pi * tones, random.uniform(0, 2 * np.pi, len(tones))
    force = -inertia * np.sin(np.outer(time, w) + phase) @ (size * w**2)
    q, v = float(size @ np.sin(phase)), float((size * w) @ np.cos(phase))
    if name == "cart":  # the pole comes first
        return force[:, None], np.array([np.pi + random.uniform(-0.8, 0.8), q]), np.array([0.0, v])
    dofs = 1 if name == "drive" else 2
    return force[:, None], np.full(dofs, q), np.full(dofs, v)


def _tanks(time: np.ndarray, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    levels = plateaus(time, 60.0, 5.0, lambda: random.uniform(3e-5, 1.6e-4, 1), random)
    return levels, random.uniform(0.1, 0.4, 2), np.zeros(2)


def plateaus(
    time: np.ndarray,
    hold: float,
    ramp: float,
    draw: Callable[[], np.ndarray],
    random: np.random.Generator,
) -> np.ndarray:
    """A signal (n, k) that stays at drawn levels for about `hold` s each and moves between them in `ramp` s."""
    ends = np.cumsum(random.uniform(0.5, 1.5, int(2 * time[-1] / hold) + 3) * hold)
    level = draw()
    signal = np.tile(level, (len(time), 1)).astype(float)
    for begin in ends[ends < time[-1]]:
        new = draw()
        signal[time >= begin] = new
        rising = (time >= begin) & (time < begin + ramp)
        share = ((time[rising] - begin) / ramp)[:, None]
        signal[rising] = level + (new - level) * share
        level = new
    return signal


def arm_at_work(
    time: np.ndarray, random: np.random.Generator, silent: int | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Activations at random levels that keep the nominal arm in its range, and pushes at the wrist.

    A `silent` muscle (from 0) is never stimulated.
    """
    machine, stride = MACHINES["arm"], 4
    inputs = np.zeros((len(time), 8))
    inputs[:, 6:] = _pushes(time, random)
    q, v = np.array([random.uniform(0.3, 1.2), random.uniform(0.7, 1.7)]), np.zeros(2)
    used = np.array([k != silent for k in range(6)])
    q0, begin, level = q.copy(), 0, used * random.uniform(0.05, 0.6, 6)
    while begin < len(time) - 1:
        end = min(begin + stride * int(random.uniform(125, 300)), len(time) - 1)
        best = np.inf
        for _ in range(25):
            new = used * random.uniform(0.05, 0.6, 6)
            share = np.clip((time[begin : end + 1] - time[begin]) / 0.05, 0, 1)[:, None]
            part = np.hstack([level + (new - level) * share, inputs[begin : end + 1, 6:]])
            positions, speeds = simulate("arm", machine.values, part[::stride], q, v, step=stride * machine.step)
            outside = np.maximum(positions - _ARM_RANGE[1], _ARM_RANGE[0] - positions).max()
            if outside < best:
                best, chosen, at = outside, part, (positions[-1], speeds[-1])
            if best <= 0:
                break
        inputs[begin : end + 1, :6] = chosen[:, :6]
        level, (q, v), begin = chosen[-1, :6], at, end
    return inputs, q0, np.zeros(2)


def _pushes(time: np.ndarray, random: np.random.Generator) -> np.ndarray:
    force, at = np.zeros((len(time), 2)), random.uniform(0, 1.5)
    while at < time[-1]:
        length, angle = random.uniform(0.3, 1.0), random.uniform(0, 2 * np.pi)
        inside = (time >= at) & (time < at + length)
        shape = np.sin(np.pi * (time[inside] - at) / length)[:, None]
        force[inside] = random.uniform(1.5, 6.0) * shape * [np.cos(angle), np.sin(angle)]
        at += length + random.uniform(0.2, 1.8)
    return force
