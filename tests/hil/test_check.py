"""`misfit hil check`: what is wrong with a bus is said in words."""

import re
from collections.abc import Callable, Collection

import pytest

from hil.codecs.barrett.safety_module import Button
from hil.codecs.barrett.tables import Kind
from hil.robots.absent import MODULE, SENSOR
from hil.session.check import check
from hil.virtual.node import Node
from tests.hil.bench import Bench


def found(bench: Bench, rate_hz: float = 500.0, waived: Collection[str] = ()) -> tuple[list[str], list[str]]:
    """What is good, and what is not."""
    findings = list(check(bench.wire, rate_hz, bench.sleep, waived=waived))
    return [f.words for f in findings if f.good], [f.words for f in findings if not f.good]


def test_a_robot_that_is_well_has_nothing_wrong() -> None:
    good, bad = found(Bench())
    assert bad == []
    assert any("fast enough for 500 Hz" in words for words in good)


def test_looking_energises_nothing() -> None:
    bench = Bench()
    found(bench)
    assert bench.torque_frames() == []
    assert all(motor.torque == 0 for motor in bench.robot.motors)


def _without(number: int) -> Callable[[Bench], None]:
    def change(bench: Bench) -> None:
        next(node for node in bench.robot.nodes if node.number == number).powered = False

    return change


def _stranger(bench: Bench) -> None:
    bench.robot.nodes = (*bench.robot.nodes, Node(5, Kind.MOTOR, ()))


def _value(node: int, name: str, value: int) -> Callable[[Bench], None]:
    def change(bench: Bench) -> None:
        next(n for n in bench.robot.nodes if n.number == node).values[name] = value

    return change


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (_without(2), "node 2 (motor) does not answer"),
        (_stranger, "node 5 is a motor that a Proficio does not have"),
        (_value(8, "ROLE", 0), "node 8 is a motor, a force/torque sensor belongs there"),
        (_value(3, "ROLE", 1), "ROLE 0x0001 is a node of type 1"),
        (_value(1, "CTS", 0), "motor 1: 0 counts a turn"),
        (_value(2, "PIDX", 3), "motor 2 takes torque 3 of the frame"),
        (_value(10, "VL2", 0), "limit of speed 0 m/s: none is set"),
        (_value(10, "TL2", 0), "limit of torque 0 units: none is set"),
        (lambda bench: bench.robot.safety.press(Button.ESTOP, 0), "ESTOP"),
    ],
)
def test_what_is_wrong_is_named(change: Callable[[Bench], None], words: str) -> None:
    bench = Bench()
    change(bench)
    _, bad = found(bench)
    assert any(words in line for line in bad), bad


def test_a_bus_without_a_robot_says_what_to_look_at() -> None:
    bench = Bench()
    for node in bench.robot.nodes:
        node.powered = False
    _, bad = found(bench)
    assert bad == [
        "virtual robot: nothing answers; is the robot on, is the bit rate 1 Mbit/s, is the cable plugged in?"
    ]


@pytest.mark.parametrize(
    ("number", "name", "key"), [(8, SENSOR, "without_force_sensor"), (10, MODULE, "without_safety_module")]
)
def test_a_missing_safeguard_is_bad_unless_the_bench_may_do_without(number: int, name: str, key: str) -> None:
    bench = Bench()
    _without(number)(bench)
    _, bad = found(bench)
    assert len(bad) == 1
    assert re.search(rf"node {number} \(.*\) does not answer: no {name} answers: .* say {key} = true", bad[0])
    good, bad = found(bench, waived=(name,))
    assert bad == []
    assert any(f"node {number} " in words and "its limits are halved" in words for words in good)


def test_a_rate_that_the_bus_cannot_hold_is_named_with_what_it_leaves() -> None:
    _, bad = found(Bench(), rate_hz=5000.0)
    assert len(bad) == 1
    assert "too slow for 5000 Hz, which leaves 0.1 ms; lower --rate" in bad[0]
