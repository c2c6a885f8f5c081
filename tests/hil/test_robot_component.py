"""A robot where an FMU was."""

from pathlib import Path

import pytest

from fmus.errors import ComponentError, MisfitError
from hil.component import open_robot
from orchestrator.cosim.system import ComponentSpec


def robot(**options: object):  # type: ignore[no-untyped-def]
    return open_robot(ComponentSpec("robot", "robot", isolate=False, options={"rate_hz": 100.0, **options}), Path())


def test_a_torque_that_is_asked_for_turns_the_joint_its_way() -> None:
    component = robot(virtual=True)
    component.initialise(0.0, None, None)
    try:
        component.start()
        before, time = component.get(["q3"])[0], 0.0
        component.set(["asked3"], [-0.5])
        for _ in range(30):
            time = component.step(time, 0.01).time
        angle, speed, sent, reaction = component.get(["q3", "w3", "tau3", "reaction"])
    finally:
        component.terminate()
    assert time == pytest.approx(0.3)
    assert angle < before
    assert speed < 0
    assert -0.5 <= sent < 0
    assert reaction == 0


def test_what_the_safety_core_stops_ends_the_run_with_its_reason() -> None:
    component = robot(virtual=True)
    component.initialise(0.0, None, None)
    try:
        component.start()
        component.set(["asked1"], [float("nan")])
        with pytest.raises(ComponentError, match="the safety core stopped the robot: finite_command"):
            component.step(0.0, 0.5)
    finally:
        component.terminate()


@pytest.mark.parametrize("options", [{}, {"virtual": True, "speed": 3}])
def test_a_robot_that_is_neither_virtual_nor_at_a_bench_is_refused(options: dict) -> None:
    with pytest.raises(MisfitError, match="either virtual = true or source"):
        robot(**options)


def test_a_rate_that_is_no_number_is_refused_by_its_value() -> None:
    with pytest.raises(MisfitError, match="rate_hz = 'fast'; a number"):
        robot(virtual=True, rate_hz="fast")


def test_a_robot_that_was_not_started_up_does_not_step() -> None:
    with pytest.raises(ComponentError, match="has not been started up"):
        robot(virtual=True).step(0.0, 0.01)
