"""Reaching and holding the seven postures of the study, round by round, with an arm that the model does not know.

    python -m tests.benchmarks.control.run

prints the error of the held angles by round, and the margins of each loop around the arm as it is.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import control
import numpy as np

from fmus.errors import ComponentError, MisfitError
from orchestrator.control.arm import MUSCLES, PORTS, POSTURES, UNBALANCED, arm_component, feedback_at, nominal_limb
from orchestrator.control.design import linearised
from orchestrator.control.hold import LACKING, Array, Controller, Ports
from orchestrator.cosim.component import Component

ROUNDS = 4
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


@dataclass(frozen=True)
class Task:
    """Each target is reached in `reach` s along a smooth path and held for `hold` s; what counts is the mean of the
    last `judged` s.

    Activations change every `step` s, and a step after the state that they follow from was seen.
    """

    reach: float = 0.8
    hold: float = 1.2
    judged: float = 0.3
    step: float = 0.005


@dataclass(frozen=True, eq=False)
class Held:
    """A posture as it was held: the target and the mean state, rad and rad/s, the distance between their angles,
    activations and their sum of squares.

    `unrest` is the largest speed of the judged time in rad/s.
    """

    target: Array
    state: Array
    error: float
    activations: Array
    effort: float
    unrest: float


@dataclass(frozen=True, eq=False)
class Margins:
    """How far a loop is from instability, broken at its torques.

    `modulus` is the least distance from -1 over all directions and frequencies (the least singular value of I + L).
    `gain` and `phase` (joints,) are factor and rad that the loop of one joint bears while the others are closed, a
    factor below 1 if less gain is what it does not bear; `delay` is the time in s that the worst of these phases stands
    for. `decay` is the slowest rate of the closed loop in 1/s, negative if it is unstable.
    """

    modulus: float
    gain: tuple[float, ...]
    phase: tuple[float, ...]
    delay: float
    decay: float


def slope(activations: Array, capability: Array) -> Array:
    """d activations / d torque (m, p) with C = `capability` (p, m), while the same muscles stay at rest or at full activation."""
    free = (activations > 1e-6) & (activations < 1.0 - 1e-6)
    found = np.zeros((len(activations), len(capability)))
    part = capability[:, free]
    found[free] = part.T @ np.linalg.pinv(part @ part.T + np.eye(len(capability)) / LACKING)
    return found


def margins_at(target: Array, controller: Controller, parameters: Mapping[str, float], step: float) -> Margins:
    """Margins of the loop around the arm with these parameters, linearised where the controller holds it.

    Args:
        target: angles in rad.
        controller: the controller.
        parameters: of the arm, by name.
        step: of the controller, in s.
    """
    statics, capability = controller.limb.torques(np.concatenate([target, np.zeros(2)]))
    activations = controller.allocate(-statics, capability)
    at = dict(zip(PORTS.states, [*target, 0.0, 0.0], strict=True)) | dict(
        zip(PORTS.activations, activations, strict=True)
    )
    a, b = linearised(arm_component(parameters), PORTS.states, PORTS.activations, at)
    return margins(a, b @ slope(activations, capability), controller.feedback, step)


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


def hold(
    component: Component, ports: Ports, controller: Controller, start: Array, targets: Sequence[Array], task: Task
) -> list[Held]:
    """Reach and hold targets, angles (p,) each, one after the other; the limb begins at rest at `start`.

    Args:
        component: the limb.
        ports: names of its states and inputs.
        controller: what holds it.
        start: angles in rad.
        targets: angles in rad.
        task: how long and how exactly each is held.

    Raises:
        ComponentError: if the FMU fails, or the limb leaves the finite numbers.
    """
    component.set(ports.states, [*start, *np.zeros(len(start))])
    component.initialise(0.0, None, None)
    component.start()
    time, state, found = 0.0, np.concatenate([start, np.zeros(len(start))]), []
    activations = controller(state, state)
    for target in targets:
        path = _path(state[: len(target)], np.asarray(target, dtype=float), task)
        states, used = [], []
        for wanted in path:
            following = controller(state, wanted)
            component.set(ports.activations, list(activations))
            component.step(time, task.step)
            time += task.step
            states.append(state)
            used.append(activations)
            state, activations = np.array(component.get(ports.states), dtype=float), following
            if not np.isfinite(state).all():
                raise ComponentError(f"the limb left the finite numbers at t = {time:.3g} s; expected a stable loop")
        found.append(_judged(target, np.array(states), np.array(used), task))
    component.terminate()
    return found


def _path(begin: Array, target: Array, task: Task) -> Array:
    """Angles and speeds (n, 2 p) from one posture to another with the least jerk (Flash and Hogan 1985), then at rest."""
    count, rest = round(task.reach / task.step), round(task.hold / task.step)
    if count < 1 or rest * task.step < task.judged or task.judged < task.step:
        raise MisfitError(f"a task of {task}; expected to hold for longer than is judged, and steps that fit")
    s = np.concatenate([np.arange(1, count + 1) / count, np.ones(rest)])[:, None]
    share = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    speed = 30.0 * s**2 * (1.0 - s) ** 2 / task.reach
    return np.hstack([begin + share * (target - begin), speed * (target - begin)])


def _judged(target: Array, states: Array, used: Array, task: Task) -> Held:
    last = slice(-round(task.judged / task.step), None)
    joints = len(target)
    state, activations = states[last].mean(axis=0), used[last].mean(axis=0)
    error = float(np.linalg.norm(state[:joints] - target))
    return Held(
        np.asarray(target),
        state,
        error,
        activations,
        float(activations @ activations),
        float(np.abs(states[last][:, joints:]).max()),
    )


def margins(a: Array, b: Array, feedback: Array, step: float, delay_steps: int = 1) -> Margins:
    """Margins of u = -K x, computed every `step` s and applied `delay_steps` later.

    Args:
        a: (n, n), of the plant.
        b: (n, p), of the plant.
        feedback: K, (p, n).
        step: in s.
        delay_steps: steps from a measurement to its effect.
    """
    n, p = b.shape
    plant = control.c2d(control.ss(a, b, feedback, np.zeros((p, p))), step)
    shift = control.ss(np.zeros((p, p)), np.eye(p), np.eye(p), np.zeros((p, p)), step)
    loop = plant
    for _ in range(delay_steps):
        loop = loop * shift
    closed = control.feedback(loop, control.ss([], [], [], np.eye(p), step))
    frequency = np.geomspace(1e-2, np.pi / step, 2000)
    answer = control.frequency_response(loop, frequency).frdata.transpose(2, 0, 1)
    modulus = float(np.linalg.svd(np.eye(p) + answer, compute_uv=False).min())
    each = [_alone(loop, k, frequency) for k in range(p)]
    phases = [phase for _, phase, _ in each]
    times = [phase / crossing if crossing > 0.0 else np.inf for _, phase, crossing in each]
    decay = -float(np.log(max(np.abs(closed.poles()).max(), 1e-12)) / step)
    return Margins(modulus, tuple(gain for gain, *_ in each), tuple(phases), min(times), decay)


def _alone(loop: control.StateSpace, joint: int, frequency: Array) -> tuple[float, float, float]:
    """Gain margin, phase margin in rad and its frequency in rad/s of one loop while the others are closed."""
    p = loop.ninputs
    if p > 1:
        others = np.eye(p)
        others[joint, joint] = 0.0
        loop = control.feedback(loop, control.ss([], [], [], others, loop.dt))
    gain, phase, _, _, crossing, _ = control.stability_margins(
        control.frequency_response(loop[joint, joint], frequency)
    )
    return float(gain), float(np.radians(phase)), float(crossing) if np.isfinite(crossing) else 0.0


def main() -> None:
    """Print a table of rounds and one of margins."""
    found = rounds(PERSON, ROUNDS)
    print("error of the held angles, mrad")
    print(
        f"{'posture q1 q2, rad':22s}"
        + "".join(f"{'round ' + str(k + 1):>10s}" for k in range(ROUNDS))
        + f"{'effort':>20s}"
    )
    for k, posture in enumerate(POSTURES):
        cells = "".join(f"{1e3 * each.held[k].error:10.2f}" for each in found)
        efforts = f"{found[0].held[k].effort:12.4f} -> {found[-1].held[k].effort:.4f}"
        print(f"{np.array2string(posture):22s}{cells}{efforts}")
    print(f"{'root mean square':22s}" + "".join(f"{1e3 * each.error:10.2f}" for each in found))
    print("\nmargins around this arm, last round")
    print(
        f"{'posture q1 q2, rad':22s}{'|I + L|':>10s}{'gain':>16s}{'phase, deg':>16s}{'delay, ms':>12s}{'decay, 1/s':>12s}"
    )
    for posture, each in zip(POSTURES, found[-1].margins, strict=True):
        gain, phase = (" ".join(f"{v:.2f}" for v in part) for part in (each.gain, np.degrees(each.phase)))
        print(
            f"{np.array2string(posture):22s}{each.modulus:10.2f}{gain:>16s}{phase:>16s}{1e3 * each.delay:12.1f}{each.decay:12.2f}"
        )


if __name__ == "__main__":
    main()
