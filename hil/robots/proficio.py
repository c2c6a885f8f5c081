"""Barrett's Proficio, a rehabilitation arm with three joints: transmission, kinematics and weight.

Numbers are those of the public configuration files of libbarrett's Proficio examples.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from hil.robots.chain import Chain

Side = Literal["left", "right"]
Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]
# Cosine and sine of a joint's angle, and of its link's twist.
_Turn = tuple[float, float, float, float]

JOINTS: Final = 3
# Motor angles from joint angles; motors 1 and 2 drive joints 1 and 2 through a cable differential.
JOINT_TO_MOTOR = np.array([[-8.51, 15.19643, 0.0], [8.51, 15.19643, 0.0], [0.0, 0.0, 9.55]])
MOTOR_TO_JOINT = np.linalg.inv(JOINT_TO_MOTOR)
# Joint angles at the stops where the arm is zeroed, rad.
HOME = {"right": np.array([-1.01, -0.96, 2.84]), "left": np.array([-1.01, 0.96, -2.84])}
GRAVITY = 9.805

# First moments of each link in its frame, kg.m, as calibrated; masses further out are lumped in.
_MOMENTS: dict[Side, tuple[Vector, ...]] = {
    "right": (
        (0.008168642272, -0.2650486524, 0.03283905849),
        (1.108299475, -0.02560798116, 0.5281584342),
        (0.2809401835, 0.006553042379, -0.005389590335),
    ),
    "left": (
        (0.009139233947, -0.08760042021, 0.02949872258),
        (0.9494654736, 0.07945610708, 0.4504914595),
        (0.2265584107, -0.01389087169, 0.01418968889),
    ),
}
# Denavit-Hartenberg (Spong): angle about x, length along x, offset along z.
_LINKS = ((np.pi / 2, 0.0, 0.0), (0.0, 0.650, 0.0), (-np.pi / 2, 0.435, 0.225))
# Cosine and sine of the angle about x.
_TWISTS: tuple[tuple[float, float], ...] = tuple((math.cos(twist), math.sin(twist)) for twist, _, _ in _LINKS)
_BASE_OFFSET = {"right": -0.540, "left": 0.540}
_BASE_TO_WORLD = ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0))
# Of one kg, in the base's frame.
_WEIGHT = (0.0, GRAVITY, 0.0)


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


def matrix(values: np.ndarray) -> Matrix:
    """A matrix (3, 3) in plain numbers."""
    (a, b, c), (d, e, f), (g, h, i) = values.tolist()
    return (a, b, c), (d, e, f), (g, h, i)


def times(matrix: Matrix, vector: Vector) -> Vector:
    """A matrix times a vector in plain numbers: NumPy takes ten times as long for three of them.

    Example:
        >>> times(((1.0, 2.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), (3.0, 4.0, 5.0))
        (11.0, 4.0, 5.0)
    """
    return _dot(matrix[0], vector), _dot(matrix[1], vector), _dot(matrix[2], vector)


def _dot(row: Vector, vector: Vector) -> float:
    return row[0] * vector[0] + row[1] * vector[1] + row[2] * vector[2]


# The same as in `joint_angles` and `motor_torques`, for a session's cycles.
ANGLES_OF_MOTORS: Final = matrix(MOTOR_TO_JOINT)
TORQUES_AT_MOTORS: Final = matrix(MOTOR_TO_JOINT.T)


def chain(side: Side) -> Chain:
    """Its links as they are mounted on that side."""
    return Chain(_LINKS, _BASE_TO_WORLD, (0.0, _BASE_OFFSET[side], 0.0))


def tool_position(angles: np.ndarray, side: Side) -> np.ndarray:
    """Position (3,) in m of the tool in the world, z up, at joint angles (3,) in rad.

    Example:
        >>> tool_position(np.zeros(3), "right").round(6).tolist()
        [1.085, -0.54, 0.225]
    """
    return np.asarray(chain(side).places(angles.tolist())[-1])


def holding_torques(angles: Sequence[float], side: Side) -> Vector:
    """Joint torques in N.m that hold the arm against its weight at the angles of its joints in rad.

    From the base outwards the weight is turned into each link's frame, and from the tip inwards moments are summed. In
    plain numbers: a session needs it in every cycle, and NumPy takes ten times as long for three of them.
    """
    first, second, third = _turn(angles[0], 0), _turn(angles[1], 1), _turn(angles[2], 2)
    weight_1 = _inwards(first, _WEIGHT)
    weight_2 = _inwards(second, weight_1)
    weight_3 = _inwards(third, weight_2)
    moments = _MOMENTS[side]
    outer_3 = _outwards(third, _moment(weight_3, moments[2], (0.0, 0.0, 0.0)))
    outer_2 = _outwards(second, _moment(weight_2, moments[1], outer_3))
    outer_1 = _outwards(first, _moment(weight_1, moments[0], outer_2))
    return outer_1[2], outer_2[2], outer_3[2]


def _turn(angle: float, link: int) -> _Turn:
    twist = _TWISTS[link]
    return math.cos(angle), math.sin(angle), twist[0], twist[1]


def _moment(weight: Vector, moments: Vector, outer: Vector) -> Vector:
    """Moment of a link's weight, and of what is further out, in the link's frame."""
    (x, y, z), (a, b, c) = weight, moments
    return y * c - z * b + outer[0], z * a - x * c + outer[1], x * b - y * a + outer[2]


def _outwards(turn: _Turn, vector: Vector) -> Vector:
    """A vector of a link's frame in the frame before it: R v."""
    (c, s, ct, st), (x, y, z) = turn, vector
    across = ct * y - st * z
    return c * x - s * across, s * x + c * across, st * y + ct * z


def _inwards(turn: _Turn, vector: Vector) -> Vector:
    """A vector of the frame before a link in the link's own: R' v."""
    (c, s, ct, st), (x, y, z) = turn, vector
    along = c * y - s * x
    return c * x + s * y, ct * along + st * z, ct * z - st * along
