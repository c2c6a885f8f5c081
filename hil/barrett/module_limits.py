"""The session's limits beside those of the robot's own safety module: a session only tightens."""

from collections.abc import Sequence

import numpy as np

from hil.robots import proficio
from hil.safety.limits import JointLimits


def motor_units(joints: Sequence[JointLimits], torque_units: Sequence[int]) -> list[int]:
    """What each motor gets at most, in its controller's units, when all joints make their largest torques at once."""
    torques = np.array([joint.torque for joint in joints])
    return [
        int(units * most) for units, most in zip(torque_units, np.abs(proficio.MOTOR_TO_JOINT).T @ torques, strict=True)
    ]


def looser_than(
    joints: Sequence[JointLimits], torque_units: Sequence[int], torque_limit: int, speed_limit: int
) -> list[str]:
    """Where limits of a session are looser than the module's, or the module has none; in words.

    Args:
        torque_limit, speed_limit: the module's TL2 in torque units and VL2 in units of 1/4096 m/s; 0 never trips.
    """
    found = []
    if torque_limit <= 0:
        found.append("the safety module has no limit of torque (TL2 is 0)")
    if speed_limit <= 0:
        found.append("the safety module has no limit of speed (VL2 is 0)")
    for k, units in enumerate(motor_units(joints, torque_units), start=1):
        if 0 < torque_limit < units:
            found.append(
                f"the session's torques need {units} units of motor {k}, its module allows {torque_limit} (TL2);"
                " lower `torque` of [[joints]]"
            )
    return found
