"""What asks for torques: each gets where the arm is and says what it would like; the safety core decides."""

from dataclasses import dataclass
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np

_NOTHING = np.zeros(3)


class Observed(NamedTuple):
    """What a controller sees: time since it took over in s (negative before the arm is armed), joint angles rad, speeds
    rad/s, wrist force N.

    `sent` N.m is what the core let pass in the last cycle, without the part that holds the weight; `confirm` whether
    the operator has just confirmed; `fresh` whether all angles were measured in this cycle; `asked` N.m what a program
    beside the session asks for, None while it does not.
    """

    seconds: float
    angles: np.ndarray
    speeds: np.ndarray
    force: np.ndarray
    sent: np.ndarray = _NOTHING
    confirm: bool = False
    fresh: bool = True
    asked: tuple[float, ...] | None = None


class Controller(Protocol):
    """Anything with this method, such as a class of the user's own.

    One that pauses counts in `turn` how often it has begun to ask: its torque comes up along the ramp each time.
    """

    def torque(self, observed: Observed) -> np.ndarray:
        """Joint torques in N.m that it asks for, without those that hold the arm's weight."""
        ...


class Asked:
    """Asks for what a program beside the session asks for, such as a coupled run; for nothing while it is silent."""

    def __init__(self) -> None:
        self.turn, self._is_asking = 0, False

    def torque(self, observed: Observed) -> np.ndarray:
        """The torques that are asked for."""
        if (is_asking := observed.asked is not None) and not self._is_asking:
            self.turn += 1
        self._is_asking = is_asking
        return np.zeros_like(observed.angles) if observed.asked is None else np.array(observed.asked)


@dataclass
class Hold:
    """Holds the posture in which the arm was armed: tau = stiffness (q0 - q) - damping w."""

    stiffness: np.ndarray
    damping: np.ndarray
    _posture: np.ndarray | None = None

    def torque(self, observed: Observed) -> np.ndarray:
        """Spring and damper towards the posture."""
        if observed.seconds <= 0 or self._posture is None:
            self._posture = observed.angles.copy()
        torques: np.ndarray = self.stiffness * (self._posture - observed.angles) - self.damping * observed.speeds
        return torques


class Passive:
    """Asks for nothing: the arm's weight is held, a person moves it."""

    def torque(self, observed: Observed) -> np.ndarray:
        """No torque."""
        return np.zeros_like(observed.angles)


class Shown(NamedTuple):
    """A signal that a controller shows beside its torque."""

    name: str
    unit: str
    description: str


@runtime_checkable
class Showing(Protocol):
    """A controller that shows what it knows: `signals` are what, `shown` their values in the last cycle."""

    signals: tuple[Shown, ...]
    shown: tuple[float, ...]


@runtime_checkable
class Modelling(Protocol):
    """A controller that knows the arm: `unmodelled` N.m of each joint are what it cannot explain of the last motion,
    None if it cannot tell."""

    unmodelled: tuple[float, ...] | None


@runtime_checkable
class Ending(Protocol):
    """A controller that knows when it is done."""

    @property
    def is_done(self) -> bool:
        """Whether the session may end."""
        ...
