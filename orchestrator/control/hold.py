"""Activations that hold a limb: the least that its learned torques need, with feedback about them."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

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
LACKING = 1e4


class Allocation:
    """min |a|^2 + weight |lacking|^2 such that C a + lacking = torque and 0 <= a <= 1: a quadratic program by CasADi (DAQP)."""

    def __init__(self, joints: int, muscles: int) -> None:
        self._joints, self._muscles = joints, muscles
        self._weights = np.concatenate([np.ones(muscles), np.full(joints, LACKING)])
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
