"""What asks for torques: each gets where the arm is and says what it would like; the safety core decides."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from hil.record import Record
from hil.safety.cycle import Vector

_NOTHING = (0.0, 0.0, 0.0)


class Observed(Record):
    """What a controller sees: time since it took over in s (negative before the arm is armed), joint angles `q` rad, speeds
    `w` rad/s, wrist force `f` N.

    `tau` N.m is what the core let pass in the last cycle, without the part that holds the weight; `confirm` whether
    the operator has just confirmed; `fresh` whether all angles were measured in this cycle; `asked` N.m what a program
    beside the session asks for, None while it does not. `angles`, `speeds`, `force` and `sent` are the four as arrays.
    """

    def __init__(
        self,
        seconds: float,
        q: Vector,
        w: Vector,
        f: Vector,
        tau: Vector = _NOTHING,
        confirm: bool = False,
        fresh: bool = True,
        asked: Vector | None = None,
    ) -> None:
        self.seconds = seconds
        self.q = q
        self.w = w
        self.f = f
        self.tau = tau
        self.confirm = confirm
        self.fresh = fresh
        self.asked = asked

    @property
    def angles(self) -> np.ndarray:
        """(n,) rad."""
        return np.array(self.q)

    @property
    def speeds(self) -> np.ndarray:
        """(n,) rad/s."""
        return np.array(self.w)

    @property
    def force(self) -> np.ndarray:
        """(3,) N."""
        return np.array(self.f)

    @property
    def sent(self) -> np.ndarray:
        """(n,) N.m."""
        return np.array(self.tau)


class Controller(Protocol):
    """Anything with this method, such as a class of the user's own; see `hil.control.abilities` for what else it may say."""

    def torque(self, observed: Observed) -> np.ndarray | Vector:
        """Joint torques in N.m that it asks for, without those that hold the arm's weight."""
        ...


class Asked:
    """Asks for what a program beside the session asks for, such as a coupled run; for nothing while it is silent."""

    def __init__(self) -> None:
        self.turn, self._is_asking = 0, False

    def torque(self, observed: Observed) -> Vector:
        """The torques that are asked for."""
        if (is_asking := observed.asked is not None) and not self._is_asking:
            self.turn += 1
        self._is_asking = is_asking
        return observed.asked if observed.asked is not None else (0.0,) * len(observed.q)


class Hold:
    """Holds the posture in which the arm was armed: tau = stiffness (q0 - q) - damping w.

    Args:
        stiffness: N.m/rad by joint.
        damping: N.m.s/rad by joint.
    """

    def __init__(self, stiffness: Sequence[float], damping: Sequence[float]) -> None:
        self.stiffness, self.damping = tuple(map(float, stiffness)), tuple(map(float, damping))
        self._posture: Vector = ()

    def torque(self, observed: Observed) -> Vector:
        """Spring and damper towards the posture."""
        if observed.seconds <= 0 or not self._posture:
            self._posture = observed.q
        posture, q, w = self._posture, observed.q, observed.w
        return tuple([self.stiffness[k] * (posture[k] - q[k]) - self.damping[k] * w[k] for k in range(len(q))])


class Passive:
    """Asks for nothing: the arm's weight is held, a person moves it."""

    def torque(self, observed: Observed) -> Vector:
        """No torque."""
        return (0.0,) * len(observed.q)
