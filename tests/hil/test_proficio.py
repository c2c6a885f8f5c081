"""The Proficio's data against worked numbers, and against the laws they must obey."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hil.codecs.barrett.torques import saturated
from hil.robots import proficio
from hil.robots.proficio import Side

ANGLES = st.lists(st.floats(-3, 3), min_size=3, max_size=3).map(np.array)
SIDES = st.sampled_from(["left", "right"])


@pytest.mark.parametrize(
    ("angles", "side", "expected"),
    [
        ((0.0, 0.0, 0.0), "right", (1.085, -0.540, 0.225)),
        ((0.0, 0.0, 0.0), "left", (1.085, 0.540, 0.225)),
        ((0.0, 0.0, np.pi / 2), "right", (0.650, -0.105, 0.225)),
        ((-1.01, -0.96, 2.84), "right", (-0.062669, -0.658104, 0.323262)),
        ((-1.01, 0.96, -2.84), "left", (-0.062669, 0.658104, 0.323262)),
    ],
)
def test_the_tool_is_where_the_kinematics_say(
    angles: tuple[float, ...], side: Side, expected: tuple[float, ...]
) -> None:
    assert proficio.tool_position(np.array(angles), side) == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize(
    ("angles", "side", "expected"),
    [
        ((0.0, 0.0, 0.0), "right", (-13.701588, 0.0, 0.0)),
        ((0.0, 0.0, 1.57), "right", (-11.002008, 0.0, 0.0)),
        ((-1.01, -0.96, 2.84), "right", (1.774750, 5.424798, -2.235691)),
        ((0.0, 0.0, 0.0), "left", (-11.620524, 0.0, 0.0)),
        ((-1.01, 0.96, -2.84), "left", (1.841893, -5.008745, 1.827798)),
    ],
)
def test_the_weight_takes_the_calibrated_torques(
    angles: tuple[float, ...], side: Side, expected: tuple[float, ...]
) -> None:
    assert proficio.holding_torques(angles, side) == pytest.approx(expected, abs=1e-6)


@given(ANGLES, SIDES)
def test_holding_torques_do_no_work_around_a_closed_path(angles: np.ndarray, side: Side) -> None:
    """They are the gradient of a height, so their Jacobian is symmetric."""
    step = 1e-5
    jacobian = np.array(
        [
            np.subtract(proficio.holding_torques(angles + d, side), proficio.holding_torques(angles - d, side))
            / (2 * step)
            for d in step * np.eye(3)
        ]
    )
    assert jacobian == pytest.approx(jacobian.T, abs=1e-7)


@given(ANGLES, ANGLES)
def test_the_transmission_loses_no_power(speeds: np.ndarray, torques: np.ndarray) -> None:
    at_motors = proficio.motor_angles(speeds) @ proficio.motor_torques(torques)
    assert at_motors == pytest.approx(speeds @ torques, abs=1e-9)


@given(ANGLES)
def test_joints_and_motors_are_each_others_inverse(angles: np.ndarray) -> None:
    assert proficio.joint_angles(proficio.motor_angles(angles)) == pytest.approx(angles, abs=1e-12)
    assert proficio.joint_torques(proficio.motor_torques(angles)) == pytest.approx(angles, abs=1e-12)


def test_a_joint_torque_becomes_the_counts_of_the_protocol() -> None:
    motors = proficio.motor_torques(np.array([5.0, -3.0, 2.0]))
    assert motors == pytest.approx([-0.392479, 0.195065, 0.209424], abs=1e-6)
    assert saturated(proficio.Controller().torque_units * motors) == [-1060, 526, 565]


@pytest.mark.parametrize(("side", "expected"), [("right", (-3908, -15114, 17680)), ("left", (15113, 3907, -17681))])
def test_home_is_at_the_counts_of_the_protocol(side: Side, expected: tuple[int, ...]) -> None:
    counts = proficio.Controller().counts / (2 * np.pi) * proficio.motor_angles(proficio.HOME[side])
    assert tuple(np.floor(counts).astype(int)) == expected
