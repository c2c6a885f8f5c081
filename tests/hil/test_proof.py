"""Before anything else an armed arm proves that it stands still and turns its way; limits only tighten the module's."""

import json
import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from hil.barrett.module_limits import looser_than, motor_units
from hil.codecs.barrett.identifiers import Node
from hil.control.pilot import Pilot
from hil.robots import proficio
from hil.session.check import check
from hil.settings import settings_of_json
from tests.hil.bench import SETTINGS, Bench

PROVING = replace(SETTINGS, proof=True)
START = np.array([-0.3, 0.2, 1.5])


def proving() -> tuple[Bench, Pilot]:
    bench = Bench(settings=PROVING)
    robot = bench.started()
    bench.plant.angles = START.copy()
    bench.robot.advance(bench.bus.time_ns)
    pilot = Pilot(robot, PROVING.limits, PROVING.make_controller(), gravity=False, proof=PROVING.make_proof())
    return bench, pilot


def _reversed(bench: Bench) -> None:
    motor = bench.robot.motors[2]
    motor.controller = replace(motor.controller, torque_units=-motor.controller.torque_units)


def _swapped(bench: Bench) -> None:
    bench.robot.motors[0].values["PIDX"], bench.robot.motors[2].values["PIDX"] = 2, 0


def _powerless(bench: Bench) -> None:
    motor = bench.robot.motors[2]
    motor.controller = replace(motor.controller, torque_units=1e9)


def _pulled(bench: Bench) -> None:
    bench.plant.outside = np.array([0.0, 0.1, 0.0])


def test_a_sound_arm_proves_itself_with_little_motion_and_is_then_held() -> None:
    bench, pilot = proving()
    summary = bench.run(pilot, 2500)
    assert summary.faults == []
    assert pilot.proof is not None and pilot.proof.is_done
    assert bench.plant.angles == pytest.approx(START, abs=0.03)


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        (_reversed, "joint 3 turned by .* its sign, or the side, is wrong"),
        (_swapped, "joints are mixed up"),
        (_powerless, "joint 3 did not turn under"),
        (_pulled, "joint 2 drifts at"),
    ],
)
def test_an_arm_that_is_not_what_it_should_be_is_stopped_before_it_goes_anywhere(
    fault: Callable[[Bench], None], words: str
) -> None:
    bench, pilot = proving()
    fault(bench)
    summary = bench.run(pilot, 2500)
    assert len(summary.faults) == 1
    assert summary.faults[0].startswith("finite_command")
    assert re.search(words, summary.faults[0]), summary.faults
    if fault is not _pulled:
        assert bench.plant.angles == pytest.approx(START, abs=0.1)


def test_settings_of_a_recording_ask_for_the_same_proof() -> None:

    again = settings_of_json(json.dumps(PROVING.to_json()))
    assert again == PROVING
    assert again.make_proof() is not None
    assert SETTINGS.make_proof() is None


# --- the module's limits


def test_largest_motor_torques_are_those_of_the_worst_corner_of_the_joints_limits() -> None:
    joints, units = PROVING.limits.joints, (2700, 2700, 2700)
    corners = np.array(np.meshgrid(*([-joint.torque, joint.torque] for joint in joints))).reshape(3, -1)
    worst = np.max(np.abs(proficio.MOTOR_TO_JOINT.T @ corners), axis=1)
    assert motor_units(joints, units) == pytest.approx(2700 * worst, abs=1)


def test_limits_within_those_of_the_module_are_not_looser() -> None:
    assert looser_than(PROVING.limits.joints, (2700,) * 3, torque_limit=5204, speed_limit=4096) == []


@pytest.mark.parametrize(
    ("torque", "speed", "words"),
    [(1000, 4096, "motor 1, its module allows 1000"), (0, 4096, "TL2 is 0"), (5204, 0, "VL2 is 0")],
)
def test_looser_limits_are_named_and_refused(torque: int, speed: int, words: str) -> None:
    assert any(words in line for line in looser_than(PROVING.limits.joints, (2700,) * 3, torque, speed))
    bench = Bench()
    robot = bench.started()
    module = next(node for node in bench.robot.nodes if node.number == Node.SAFETY)
    module.values |= {"TL2": torque, "VL2": speed}
    assert any(words in line for line in robot.looser_limits(bench.wire, SETTINGS.limits))
    found = list(check(bench.wire, 500.0, bench.sleep, SETTINGS.limits.joints))
    assert any(words in finding.words for finding in found if not finding.good)


# --- temperatures


def test_motors_are_asked_for_their_temperature_and_a_hot_one_stops_the_arm() -> None:
    bench = Bench()
    pilot = bench.pilot()

    def heat(cycle: int) -> None:
        if cycle == 700:
            bench.robot.motors[1].values["TEMP"] = 80

    summary = bench.run(pilot, 2000, heat)
    assert summary.faults == ["cool: a motor is at 80 degC, the limit is 75 degC"]
    assert 700 < summary.cycles < 700 + 3 * 100 + 600
