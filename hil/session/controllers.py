"""What asks for torques: each gets where the arm is and says what it would like; the safety core decides."""

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np


class Observed(NamedTuple):
    """What a controller sees: time since arming in s (negative before), joint angles rad, speeds rad/s, wrist force N."""

    seconds: float
    angles: np.ndarray
    speeds: np.ndarray
    force: np.ndarray


class Controller(Protocol):
    """Anything with this method, such as a class of the user's own."""

    def torque(self, observed: Observed) -> np.ndarray:
        """Joint torques in N.m that it asks for, without those that hold the arm's weight."""
        ...


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
        return np.asarray(self.stiffness * (self._posture - observed.angles) - self.damping * observed.speeds)


class Passive:
    """Asks for nothing: the arm's weight is held, a person moves it."""

    def torque(self, observed: Observed) -> np.ndarray:
        """No torque."""
        return np.zeros_like(observed.angles)
