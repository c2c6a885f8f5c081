"""Two buses as one: each node is spoken to on its own, a group on both, and what either says is heard in its order."""

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import can
import pytest

from fmus.errors import MisfitError
from hil.bus.gate import TORQUE_IDENTIFIERS
from hil.bus.wire import open_wire
from hil.codecs.frame import Frame
from hil.errors import BusError
from hil.robots import proficio
from hil.session.settings import read_settings
from hil.session.start_up import start_up
from hil.virtual.any_bus import BusServer
from hil.virtual.plant import FreeJoints
from hil.virtual.robot import VirtualRobot

BENCH = """
[bus]
interface = "virtual"
channel = "{0}-motors"
[[bus.also]]
interface = "virtual"
channel = "{0}-sensor"
nodes = [8]
"""


def settings(name: str, tmp_path: Path) -> dict[str, Any]:
    (tmp_path / "bench.toml").write_text(BENCH.format(name))
    return dict(read_settings(tmp_path / "bench.toml").bus)


@contextmanager
def ends(name: str) -> Iterator[tuple[can.BusABC, can.BusABC]]:
    """The other ends of both buses."""
    with can.Bus(f"{name}-motors", "virtual") as motors, can.Bus(f"{name}-sensor", "virtual") as sensor:
        yield motors, sensor


def heard(bus: can.BusABC) -> list[int]:
    found = []
    while (message := bus.recv(0.0)) is not None:
        found.append(message.arbitration_id)
    return found


def test_a_node_is_spoken_to_on_its_bus_and_a_group_on_both(tmp_path: Path) -> None:
    with ends("spoken") as (motors, sensor):
        wire = open_wire(settings("spoken", tmp_path), TORQUE_IDENTIFIERS)
        for identifier in (0x001, 0x008, 0x404):
            wire.send(Frame(identifier, b"\x05"))
        assert (heard(motors), heard(sensor)) == ([0x001, 0x404], [0x008, 0x404])
        wire.close()


def test_what_either_bus_says_is_heard_and_a_busy_one_does_not_hide_the_other(tmp_path: Path) -> None:
    with ends("heard") as (motors, sensor):
        wire = open_wire(settings("heard", tmp_path), TORQUE_IDENTIFIERS)
        for k in range(50):
            motors.send(can.Message(arbitration_id=0x423, data=[k], is_extended_id=False))
        sensor.send(can.Message(arbitration_id=0x50A, data=[1], is_extended_id=False))
        first = [wire.receive(1.0) for _ in range(3)]
        assert 0x50A in [timed.frame.identifier for timed in first if timed is not None]
        rest = [timed.frame.data[0] for timed in wire.drain() if timed.frame.identifier == 0x423]
        assert rest == list(range(2, 50))
        assert wire.receive(0.01) is None
        wire.close()


def test_a_robot_whose_force_sensor_is_on_a_bus_of_its_own_starts_up(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("hil.session.start_up.SCAN_S", (0.01, 0.04))  # robot and session share a process here
    done, threads = threading.Event(), []
    with ends("whole") as buses:
        for bus, numbers in zip(buses, ((1, 2, 3, 10), (8,)), strict=True):
            robot = VirtualRobot(FreeJoints(proficio.HOME["right"]), eager=True)
            for node in robot.nodes:
                node.powered = node.number in numbers
            threads.append(threading.Thread(target=BusServer(robot, bus).serve, args=(done.is_set,), daemon=True))
            threads[-1].start()
        wire = open_wire(settings("whole", tmp_path), TORQUE_IDENTIFIERS)
        try:
            found = start_up(wire, "right", time.sleep, lambda: True)
        finally:
            done.set()
            for thread in threads:
                thread.join(timeout=5)
            wire.close()
    assert found.sensor is not None and found.module is not None


def test_a_break_of_one_bus_is_a_break_of_both_and_named_by_both(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    wire = open_wire(settings("broken", tmp_path), TORQUE_IDENTIFIERS)

    def fail(timeout: float | None = None) -> None:
        raise can.CanOperationError("unplugged")

    monkeypatch.setattr(wire.bus._buses[1], "recv", fail)  # type: ignore[attr-defined]
    with pytest.raises(BusError, match="virtual broken-motors and virtual broken-sensor: .*unplugged"):
        wire.receive(0.1)
    wire.close()


@pytest.mark.parametrize(
    ("also", "words"),
    [
        ({"interface": "virtual", "channel": "x"}, r"nodes = \(\); numbers from 1 to 31 were expected"),
        ({"interface": "virtual", "channel": "x", "nodes": [0]}, r"nodes = \[0\]"),
        ({"interface": "virtual", "channel": "x", "nodes": ["8"]}, "numbers from 1 to 31"),
        ({"interface": "nonsense", "nodes": [8]}, "bus 'nonsense' cannot be opened: .*; interfaces are"),
        ({"nodes": [8]}, r"\[bus\] names no interface; there are"),
    ],
)
def test_a_second_bus_that_says_nothing_is_refused(also: dict[str, Any], words: str) -> None:
    with pytest.raises(MisfitError, match=words):
        open_wire({"interface": "virtual", "channel": "y", "also": [also]}, TORQUE_IDENTIFIERS)


def test_a_node_cannot_be_on_two_buses() -> None:
    also = [{"interface": "virtual", "channel": name, "nodes": [8]} for name in ("x", "z")]
    with pytest.raises(MisfitError, match="node 8 is on two buses; name it once"):
        open_wire({"interface": "virtual", "channel": "y", "also": also}, TORQUE_IDENTIFIERS)


def test_an_interface_that_is_there_but_cannot_be_opened_leads_to_its_setup() -> None:
    with pytest.raises(
        MisfitError, match="bus 'socketcan none0' cannot be opened: .*; docs/can_setup.md says what it needs"
    ):
        open_wire({"interface": "socketcan", "channel": "none0"}, TORQUE_IDENTIFIERS)
