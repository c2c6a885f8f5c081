"""The virtual robot answers as the real one does: expected values are those of the vendor's library and manuals, not of our code."""

import math

import pytest

from hil.barrett.start_up import ask, start_up
from hil.bus.gate import TORQUE_IDENTIFIERS, TORQUES
from hil.bus.wire import Wire
from hil.codecs.barrett.identifiers import Group, to_group, to_node
from hil.codecs.barrett.properties import encode_value
from hil.codecs.barrett.safety_module import Button
from hil.codecs.barrett.tables import ABSOLUTE_ENCODER, MONITOR, Kind, properties
from hil.codecs.barrett.torques import pack_torques
from hil.codecs.frame import Frame
from hil.virtual.direct_bus import DirectBus
from hil.virtual.made import Made
from hil.virtual.robot import VirtualRobot
from tests.hil.bench import Bench

TORQUE_MODE = 2


def awake(version: int = 200) -> tuple[VirtualRobot, Wire]:
    robot = Made(eager=False, version=version).robot()
    bus = DirectBus(robot)
    wire = Wire(bus, TORQUE_IDENTIFIERS, "virtual robot", lambda: bus.time_ns)

    def sleep(seconds: float) -> None:
        bus.time_ns += int(seconds * 1e9)

    start_up(wire, "right", sleep, lambda: True)
    return robot, wire


def test_a_motor_with_an_absolute_encoder_says_where_its_rotor_is_whatever_it_was_zeroed_to() -> None:
    robot, wire = awake()
    motor = robot.motors[1]
    assert ask(wire, 2, motor.numbers["ROLE"], 0.01) & ABSOLUTE_ENCODER  # type: ignore[operator]
    turned = ask(wire, 2, motor.numbers["MECH"], 0.01)
    expected = math.floor(motor.angle * 4096 / (2 * math.pi)) % 4096
    wire.send(Frame(to_node(2), encode_value(motor.numbers["P"], 77)))
    assert turned == expected == ask(wire, 2, motor.numbers["MECH"], 0.01)
    assert turned != 0
    wire.close()


def test_nodes_that_were_woken_are_left_alone_while_they_restart(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hil.barrett.start_up.SETTLE_S", 0.7)  # other tests do not wait
    bench = Bench()
    bench.started()
    waking = encode_value(MONITOR["STAT"], 2)
    last = max(k for k, sent in enumerate(bench.sent) if sent.frame.data == waking)
    assert bench.sent[last + 1].time_ns - bench.sent[last].time_ns >= 0.7e9


def test_a_motor_says_its_supply_and_its_poles() -> None:
    robot, wire = awake()
    numbers = robot.motors[0].numbers
    assert (ask(wire, 1, numbers["VBUS"], 0.01), ask(wire, 1, numbers["POLES"], 0.01)) == (48, 6)
    wire.close()


@pytest.mark.parametrize(("version", "number"), [(113, 44), (114, 106), (118, 106), (119, 44), (200, 44)])
def test_the_velocity_of_a_motor_has_the_number_of_its_firmware_and_a_session_wakes_it(
    version: int, number: int
) -> None:
    robot, wire = awake(version)
    robot.motors[0].values["V"] = 321
    assert properties(Kind.MOTOR, version)["V"] == number
    assert ask(wire, 1, number, 0.01) == 321
    wire.close()


def test_a_motor_that_left_the_group_of_the_arm_hears_it_no_more_until_power_comes_back() -> None:
    robot, wire = awake()
    numbers = robot.motors[0].numbers
    wire.send(Frame(to_node(1), encode_value(numbers["GRPC"], 0)))
    wire.drain()
    wire.send(Frame(to_group(Group.ARM), bytes([numbers["P"]])))
    heard = {timed.frame.identifier for timed in iter(lambda: wire.receive(0.01), None)}
    assert heard == {0x443, 0x463}
    robot.safety.press(Button.ESTOP, 10**9)
    robot.safety.press(Button.IDLE, 10**9)
    assert robot.motors[0].values["GRPC"] == Group.ARM
    wire.close()


def test_a_motor_takes_its_mode_from_the_safety_module_and_not_from_the_host() -> None:
    robot, wire = awake()
    numbers = robot.motors[0].numbers
    wire.send(Frame(to_group(Group.ARM), encode_value(numbers["MODE"], TORQUE_MODE)))
    wire.send_decided(Frame(TORQUES, pack_torques([500, 500, 500])))
    assert ask(wire, 1, numbers["MODE"], 0.01) == 0
    assert all(motor.torque == 0.0 for motor in robot.motors)
    robot.safety.press(Button.ACTIVATE, 2 * 10**9)
    assert ask(wire, 1, numbers["MODE"], 0.01) == TORQUE_MODE
    wire.close()
