"""What a virtual robot says of itself can be set, and sessions go by it."""

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

from fmus.errors import MisfitError
from hil.barrett.module_limits import looser_than
from hil.barrett.start_up import start_up
from hil.bus.gate import TORQUE_IDENTIFIERS, TorqueGate
from hil.bus.wire import Wire
from hil.cli import hil
from hil.codecs.barrett.safety_module import Button, Level, Mode
from hil.robots import proficio
from hil.robots.proficio import Controller
from hil.safety.cycle import Outcome, Reaction
from hil.settings import virtual_settings
from hil.virtual.body import Body
from hil.virtual.direct_bus import DirectBus
from hil.virtual.made import MOST_COUNTS, MOST_TORQUE_UNITS, Made, controllers
from hil.virtual.safety_module import TORQUES

OTHER = controllers("40960,4096,8192", "4961,2562,2700")


def test_a_session_reads_what_each_motor_was_made_with_and_finds_the_arm_at_home() -> None:
    robot = Made(controllers=OTHER).robot()
    bus = DirectBus(robot)
    wire = Wire(bus, TORQUE_IDENTIFIERS, "virtual robot", lambda: bus.time_ns)

    def sleep(seconds: float) -> None:
        bus.time_ns += int(seconds * 1e9)

    found = start_up(wire, "right", sleep, lambda: True)
    assert (found.counts, found.torque_units) == ((40960, 4096, 8192), (4961, 2562, 2700))
    counts = np.array([motor.counts for motor in robot.motors])
    assert found.joint_angles(counts) == pytest.approx(proficio.HOME["right"], abs=2e-4)
    wire.close()


def test_a_torque_of_a_session_is_the_same_whatever_units_motors_have() -> None:
    wanted = (3.0, -2.0, 1.0)
    made = []
    for motors in (OTHER, (Controller(),) * 3):
        robot = Made(controllers=motors).robot()
        for motor in robot.motors:
            motor.values["STAT"] = 2
        robot.safety.press(Button.ACTIVATE, 0)
        gate = TorqueGate([motor.torque_units for motor in motors], robot.motors[0].numbers["MODE"])
        (frame,) = gate.frames(Outcome(wanted, False, Reaction.PASS, (), ()))
        robot.receive(frame, 0)
        made.append(proficio.joint_torques(np.array([motor.torque for motor in robot.motors])))
    for torques in made:
        assert torques == pytest.approx(wanted, abs=0.02)  # a unit is 0.0004 N.m of a motor, which is geared


@pytest.mark.parametrize("units", [1000, 2700, 4961])
def test_the_module_lets_go_at_the_same_torque_in_any_units_and_the_usual_session_stays_below(units: int) -> None:
    robot = Made(controllers=controllers("4096", str(units))).robot()
    assert robot.safety.values["TL2"] / units == pytest.approx(TORQUES[1], abs=1 / units)
    limit, speed = robot.safety.values["TL2"], robot.safety.values["VL2"]
    assert looser_than(virtual_settings().limits.joints, (units,) * 3, limit, speed) == []


def test_the_usual_limits_are_those_in_the_protocols_units() -> None:
    assert [Made().robot().safety.values[name] for name in ("TL1", "TL2")] == [4731, 5204]


@pytest.mark.parametrize(("heartbeat_s", "mode"), [(0.05, Mode.IDLE), (0.2, Mode.ACTIVE)])
def test_an_arm_to_which_nobody_speaks_is_let_go_after_its_heartbeat(heartbeat_s: float, mode: Mode) -> None:
    robot = Made(heartbeat_s=heartbeat_s).robot()
    robot.safety.press(Button.ACTIVATE, 0)
    for ms in range(101):
        robot.advance(ms * 1_000_000)
    assert robot.safety.mode is mode
    assert (robot.safety.levels["heartbeat"] is Level.FAULT) is (mode is Mode.IDLE)


@pytest.mark.parametrize(
    ("options", "made"),
    [
        ([], Made()),
        (
            ["--counts", "40960,4096,8192", "--torque-units", "4961,2562,2700", "--heartbeat", "0.5"],
            Made(controllers=OTHER, heartbeat_s=0.5),
        ),
        (["--side", "left", "--pendant", "idle", "--counts", "40960"], Made("left", False, None, controllers("40960", "2700"))),
        (["--body", "arm", "--set", "Kp=0"], Made(body=Body("arm", {"Kp": 0.0}))),
    ],
)  # fmt: skip
@pytest.mark.parametrize("way", ["serve", "serve_on", "serve_slcan"])
def test_options_reach_the_robot_on_every_bus(
    way: str, options: list[str], made: Made, monkeypatch: pytest.MonkeyPatch
) -> None:
    served: list[object] = []
    monkeypatch.setattr(f"hil.virtual.__main__.{way}", lambda *given: served.append(given[-1]))
    where = {"serve": [], "serve_on": ["--interface", "virtual"], "serve_slcan": ["--slcan"]}[way]
    assert CliRunner().invoke(hil, ["robot", *where, *options]).exit_code == 0
    assert served == [made]


@pytest.mark.parametrize("text", ["0", "-1", "many", "1,2", "1,2,3,4", "1,,3", "", "1.5", str(MOST_COUNTS + 1), "²"])
def test_counts_that_no_motor_has_are_refused(text: str) -> None:
    with pytest.raises(MisfitError, match="^--counts .*: a whole number from 1 to 2097151 was expected, or 3 of them"):
        controllers(text, "2700")


@given(st.text(alphabet="0123456789,- ²x", max_size=12))
def test_torque_units_are_read_or_refused_in_one_line(text: str) -> None:
    try:
        found = controllers("4096", text)
    except MisfitError as error:
        assert str(error).startswith(f"--torque-units {text}: a whole number from 1 to 32767 was expected")
    else:
        assert all(1 <= motor.torque_units <= MOST_TORQUE_UNITS for motor in found)
        words = text.split(",")
        assert [motor.torque_units for motor in found] == [int(word) for word in words] * (3 // len(words))
