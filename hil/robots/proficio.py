"""Barrett's Proficio, a rehabilitation arm with three joints: transmission, kinematics and weight.

Numbers are those of the public configuration files of libbarrett's Proficio examples.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

Side = Literal["left", "right"]

JOINTS = 3
# Motor angles from joint angles; motors 1 and 2 drive joints 1 and 2 through a cable differential.
JOINT_TO_MOTOR = np.array([[-8.51, 15.19643, 0.0], [8.51, 15.19643, 0.0], [0.0, 0.0, 9.55]])
MOTOR_TO_JOINT = np.linalg.inv(JOINT_TO_MOTOR)
# Joint angles at the stops where the arm is zeroed, rad.
HOME = {"right": np.array([-1.01, -0.96, 2.84]), "left": np.array([-1.01, 0.96, -2.84])}
# The elbow's range that examples use, rad; its sign tells the side.
ELBOW_RANGE = {"right": (0.12, 2.76), "left": (-2.76, -0.12)}
GRAVITY = 9.805

# First moments of each link in its frame, kg.m, as calibrated; masses further out are lumped in.
_MOMENTS = {
    "right": np.array(
        [
            [0.008168642272, -0.2650486524, 0.03283905849],
            [1.108299475, -0.02560798116, 0.5281584342],
            [0.2809401835, 0.006553042379, -0.005389590335],
        ]
    ),
    "left": np.array(
        [
            [0.009139233947, -0.08760042021, 0.02949872258],
            [0.9494654736, 0.07945610708, 0.4504914595],
            [0.2265584107, -0.01389087169, 0.01418968889],
        ]
    ),
}
# Denavit-Hartenberg (Spong): angle about x, length along x, offset along z.
_LINKS = ((np.pi / 2, 0.0, 0.0), (0.0, 0.650, 0.0), (-np.pi / 2, 0.435, 0.225))
_BASE_OFFSET = {"right": -0.540, "left": 0.540}
_WORLD_TO_BASE = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])


@dataclass(frozen=True)
class Controller:
    """What a motor's controller says of itself: `counts` per motor turn (CTS), torque units per N.m (IPNM)."""

    counts: int = 4096
    torque_units: float = 2700.0


def joint_angles(motor_angles: np.ndarray) -> np.ndarray:
    """Joint angles (3,) in rad from motor angles (3,) in rad; speeds go the same way."""
    return np.asarray(MOTOR_TO_JOINT @ motor_angles)


def motor_angles(joint_angles: np.ndarray) -> np.ndarray:
    """Motor angles (3,) in rad from joint angles (3,) in rad."""
    return np.asarray(JOINT_TO_MOTOR @ joint_angles)


def motor_torques(joint_torques: np.ndarray) -> np.ndarray:
    """Motor torques (3,) in N.m that make joint torques (3,) in N.m: power is the same on both sides."""
    return np.asarray(MOTOR_TO_JOINT.T @ joint_torques)


def joint_torques(motor_torques: np.ndarray) -> np.ndarray:
    """Joint torques (3,) in N.m from motor torques (3,) in N.m."""
    return np.asarray(JOINT_TO_MOTOR.T @ motor_torques)


def tool_position(angles: np.ndarray, side: Side) -> np.ndarray:
    """Position (3,) in m of the tool in the world, z up, at joint angles (3,) in rad.

    Example:
        >>> tool_position(np.zeros(3), "right").round(6).tolist()
        [1.085, -0.54, 0.225]
    """
    position = np.zeros(3)
    for angle, link in zip(angles[::-1], _LINKS[::-1], strict=True):
        position = _rotation(angle, link[0]) @ position + _shift(angle, link)
    return np.asarray(_WORLD_TO_BASE @ position + [0.0, _BASE_OFFSET[side], 0.0])


def holding_torques(angles: np.ndarray, side: Side) -> np.ndarray:
    """Joint torques (3,) in N.m that hold the arm against its weight at joint angles (3,) in rad."""
    rotations = [_rotation(angle, link[0]) for angle, link in zip(angles, _LINKS, strict=True)]
    to_world = [_WORLD_TO_BASE @ rotations[0]]
    for rotation in rotations[1:]:
        to_world.append(to_world[-1] @ rotation)
    carried, torques = np.zeros(3), np.zeros(JOINTS)
    for k in reversed(range(JOINTS)):
        weight = to_world[k].T @ [0.0, 0.0, -GRAVITY]
        outer = rotations[k + 1] @ carried if k + 1 < JOINTS else carried
        carried = np.cross(weight, _MOMENTS[side][k]) + outer
        torques[k] = (rotations[k] @ carried)[2]
    return torques


def _rotation(angle: float, twist: float) -> np.ndarray:
    c, s, ct, st = np.cos(angle), np.sin(angle), np.cos(twist), np.sin(twist)
    return np.array([[c, -s * ct, s * st], [s, c * ct, -c * st], [0.0, st, ct]])


def _shift(angle: float, link: tuple[float, float, float]) -> np.ndarray:
    _, length, offset = link
    return np.array([length * np.cos(angle), length * np.sin(angle), offset])
