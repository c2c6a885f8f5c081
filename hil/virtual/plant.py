"""What the motors of a virtual robot move."""

from typing import Protocol

import numpy as np


class Plant(Protocol):
    """A mechanism with joints; angles in rad, speeds in rad/s, forces that a person exerts on its wrist in N."""

    angles: np.ndarray
    speeds: np.ndarray
    force: np.ndarray

    def step(self, torques: np.ndarray, seconds: float) -> None:
        """Move on by a time, under constant joint torques in N.m."""
        ...


def encoder_angles(plant: Plant) -> np.ndarray:
    """Angles in rad as the encoders of a plant show them: what its method `shown` says, if it has one."""
    shown = getattr(plant, "shown", None)
    return plant.angles if shown is None else np.asarray(shown())


class FreeJoints:
    """Joints that do not feel each other: inertia, damping, and torques from outside; exact for constant torque.

    w' = (tau + outside - d w)/J, so w(t) = w_end + (w - w_end) exp(-t d/J) with w_end = (tau + outside)/d.
    """

    def __init__(self, angles: np.ndarray, inertia: float | np.ndarray = 0.05, damping: float = 0.3) -> None:
        self.angles, self.inertia, self.damping = np.array(angles, dtype=float), inertia, damping
        self.speeds = np.zeros_like(self.angles)
        self.outside = np.zeros_like(self.angles)
        self.force = np.zeros(3)

    def step(self, torques: np.ndarray, seconds: float) -> None:
        """Move on by a time."""
        end = (torques + self.outside) / self.damping
        constant = self.inertia / self.damping
        fading = np.exp(-seconds / constant)
        self.angles = self.angles + end * seconds + (self.speeds - end) * constant * (1.0 - fading)
        self.speeds = end + (self.speeds - end) * fading
