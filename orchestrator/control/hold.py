"""Reaching and holding postures with the least activations, around an FMU of the limb."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from fmus.errors import ComponentError, MisfitError
from orchestrator.cosim.component import Component
from orchestrator.gp.covariance import Latents
from orchestrator.gp.observations import observe
from orchestrator.gp.online import Learner
from orchestrator.gp.predictor import Predictor

Array = NDArray[Any]


class Limb:
    """Joint torques (p,) in N.m at a state (d,): `statics`, and of `muscles` (m,) what each adds at full activation.

    Every balance of torques that is seen is learned, in constant memory: it shows the sum of all at once.
    """

    def __init__(
        self, latents: Latents, statics: str, muscles: Sequence[str], inputs: int, joints: int, budget: int
    ) -> None:
        self.statics, self.muscles = statics, tuple(muscles)
        self._learner = Learner(latents, inputs, joints, budget)
        self._last: tuple[Array, Array] | None = None

    def torques(self, state: ArrayLike) -> tuple[Array, Array]:
        """Expected torque without activation, (p,), and of each muscle at full activation, (p, m)."""
        x = np.asarray(state, dtype=float)
        if self._last is None or not np.array_equal(
            self._last[0], x
        ):  # while a posture is held, the same is asked again and again
            self._last = (x.copy(), self._predictor(x))
        found = self._last[1]
        return found[0], found[1:].T

    def deviations(self, state: ArrayLike, activations: ArrayLike) -> float:
        """Standard deviation of each component of the total torque at activations (m,), N.m."""
        of = {self.statics: 1.0} | dict(zip(self.muscles, np.asarray(activations), strict=True))
        return float(np.sqrt(self._learner.live().variance(of, state)[0]))

    def learn(self, state: ArrayLike, activations: ArrayLike, torque: ArrayLike, noise: float) -> None:
        """Learn that statics and activated muscles (m,) together made a torque (p,), to a standard deviation `noise` in N.m."""
        parts = dict(zip(self.muscles, np.asarray(activations, dtype=float), strict=True))
        seen, made = np.atleast_2d(np.asarray(state)), np.atleast_2d(np.asarray(torque))
        self._learner.add(observe("balance", seen, {self.statics: 1.0, **parts}, made, noise))
        self.__dict__.pop("_predictor", None)
        self._last = None

    @cached_property
    def _predictor(self) -> Predictor:
        return Predictor(self._learner.live(), (self.statics, *self.muscles))


# Torque that is lacking counts so much more than activation (per (N.m)^2) that it is lacking only where no activations
# make it.
_LACKING = 1e4


class Allocation:
    """min |a|^2 + weight |lacking|^2 such that C a + lacking = torque and 0 <= a <= 1: a quadratic program by CasADi (DAQP)."""

    def __init__(self, joints: int, muscles: int) -> None:
        self._joints, self._muscles = joints, muscles
        self._weights = np.concatenate([np.ones(muscles), np.full(joints, _LACKING)])
        shapes = {"h": ca.Sparsity.diag(muscles + joints), "a": ca.Sparsity.dense(joints, muscles + joints)}
        options: dict[str, Any] = {"error_on_fail": False}
        # Not qrqp, which now and then gives activations below 0 and calls that a success (CasADi 3.8.2).
        self._solve = ca.conic("allocation", "daqp", shapes, options)
        self._low = np.concatenate([np.zeros(muscles), np.full(joints, -np.inf)])
        self._high = np.concatenate([np.ones(muscles), np.full(joints, np.inf)])

    def __call__(self, torque: Array, capability: Array) -> Array:
        """Activations (m,) for a torque (p,) with C = `capability` (p, m), N.m at full activation; the closest torque
        if none is enough."""
        balance = np.hstack([capability, np.eye(self._joints)])
        found = self._solve(
            h=ca.diag(ca.DM(self._weights)), a=balance, lba=torque, uba=torque, lbx=self._low, ubx=self._high
        )
        return np.clip(np.array(found["x"]).ravel()[: self._muscles], 0.0, 1.0)

    def slope(self, activations: Array, capability: Array) -> Array:
        """d activations / d torque, (m, p), while the same muscles stay at rest or at full activation."""
        free = (activations > 1e-6) & (activations < 1.0 - 1e-6)
        slope = np.zeros((self._muscles, self._joints))
        part = capability[:, free]
        slope[free] = part.T @ np.linalg.pinv(part @ part.T + np.eye(self._joints) / _LACKING)
        return slope


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
