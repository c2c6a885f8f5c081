"""How the emulated arm lies on the robot: its plane is that of joints 2 and 3 while joint 1 stands at zero."""

from dataclasses import dataclass

import numpy as np

from hil.robots.proficio import Side

# Joints 2 and 3 of a Proficio turn about vertical axes then.
PLANE = (1, 2)


@dataclass(frozen=True)
class Placement:
    """`side` the arm is mounted on, and `shoulder` rad that the emulated shoulder has where joint 2 stands at zero.

    A right arm flexes as the robot's angles grow, a left one as they fall.
    """

    side: Side = "right"
    shoulder: float = 0.75

    @property
    def sign(self) -> float:
        """1 for a right arm, -1 for a left one."""
        return 1.0 if self.side == "right" else -1.0

    def angles(self, robot: np.ndarray) -> np.ndarray:
        """The arm's angles (2,) in rad from the robot's (3,)."""
        return self.sign * robot[list(PLANE)] + np.array([self.shoulder, 0.0])

    def speeds(self, robot: np.ndarray) -> np.ndarray:
        """The arm's speeds (2,) in rad/s from the robot's (3,); torques go the same way."""
        return np.asarray(self.sign * robot[list(PLANE)])

    def robot_angles(self, arm: np.ndarray) -> np.ndarray:
        """The robot's angles (3,) in rad for the arm's (2,), level."""
        shoulder, elbow = self.sign * (arm - np.array([self.shoulder, 0.0]))
        return np.array([0.0, shoulder, elbow])

    def robot_torques(self, arm: np.ndarray) -> np.ndarray:
        """The robot's joint torques (3,) in N.m for the arm's (2,); power is the same on both sides."""
        return np.array([0.0, self.sign * arm[0], self.sign * arm[1]])

    def world_force(self, sensor: np.ndarray, arm: np.ndarray) -> np.ndarray:
        """Force (2,) in N on the arm in its world axes, from the sensor's (3,): x along the forearm, y towards flexion."""
        return np.asarray(turned(float(arm.sum())) @ sensor[:2])

    def sensor_force(self, world: np.ndarray, arm: np.ndarray) -> np.ndarray:
        """What the sensor (3,) shows of a force (2,) in N in the arm's world axes."""
        return np.array([*(turned(float(arm.sum())).T @ world), 0.0])


def turned(angle: float) -> np.ndarray:
    """Rotation (2, 2) by an angle in rad."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])
