"""Reaching and holding postures with the least activations, around an FMU of the limb."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmus.errors import ComponentError, MisfitError
from orchestrator.control.allocation import Allocation
from orchestrator.control.limb import Limb
from orchestrator.cosim.component import Component

Array = NDArray[Any]


@dataclass(frozen=True)
class Ports:
    """Names of an FMU's variables: states of angles, then of speeds, and its inputs of activations and of joint torques."""

    angles: tuple[str, ...]
    speeds: tuple[str, ...]
    activations: tuple[str, ...]
    torques: tuple[str, ...]

    @property
    def states(self) -> tuple[str, ...]:
        """Angles, then speeds."""
        return (*self.angles, *self.speeds)


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


@dataclass(eq=False)
class Controller:
    """Activations for a state: the least that the learned limb needs at the wanted state, and feedback of torques about it."""

    limb: Limb
    feedback: Array
    muscles: int
    _allocation: Allocation = field(init=False)

    def __post_init__(self) -> None:
        self._allocation = Allocation(len(self.feedback), self.muscles)

    def __call__(self, state: Array, wanted: Array) -> Array:
        """Activations (m,) at a state (angles, speeds) where another one is wanted."""
        statics, capability = self.limb.torques(wanted)
        return self._allocation(-self.feedback @ (state - wanted) - statics, capability)

    def allocate(self, torque: Array, capability: Array) -> Array:
        """The least activations (m,) that make a torque (p,) with muscles of that capability (p, m), or the closest one."""
        return self._allocation(torque, capability)

    def slope(self, wanted: Array) -> tuple[Array, Array]:
        """Activations at the wanted state itself, (m,), and what they change by a torque, (m, p)."""
        statics, capability = self.limb.torques(wanted)
        activations = self._allocation(-statics, capability)
        return activations, self._allocation.slope(activations, capability)


def hold(
    component: Component, ports: Ports, controller: Controller, start: Array, targets: Sequence[Array], task: Task
) -> list[Held]:
    """Reach and hold targets, angles (p,) each, one after the other; the limb begins at rest at `start`.

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
