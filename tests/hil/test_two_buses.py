"""Two buses as one: each node is spoken to on its own, a group on both, and what either says is heard in its order."""

import threading
import time
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import can
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fmus.errors import MisfitError
from hil.barrett.start_up import start_up
from hil.bus.gate import TORQUE_IDENTIFIERS, let_go
from hil.bus.joined import JoinedBus, Part, join
from hil.bus.messages import NO_HANDLE
from hil.bus.socketcand import SocketcandBus
from hil.bus.wire import Wire, open_wire
from hil.codecs.frame import Frame
from hil.errors import BusError
from hil.robots import proficio
from hil.settings import read_settings
from hil.virtual.adapters import BusServer
from hil.virtual.plant import FreeJoints
from hil.virtual.robot import VirtualRobot
from tests.hil.peers import PATIENCE_S, Server, terminal

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
    monkeypatch.setattr("hil.barrett.start_up.SCAN_S", (0.01, 0.04))  # robot and session share a process here
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


LET_GO = b"< send 401 8 aa 00 00 00 00 00 00 00 >< send 404 6 88 00 00 00 00 00 >"


class Ended(can.BusABC):
    """A bus that is one no longer."""

    def __init__(self) -> None:
        super().__init__(channel="ended")

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        raise can.CanOperationError("unplugged")

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        raise can.CanOperationError("unplugged")


def beside_an_ended_bus(end: Server, first: bool) -> can.BusABC:
    """A bus that works, of socketcand, and one that has ended, of which node 8 is on the second one."""
    tables: list[dict[str, Any]] = [{**end.settings}, {"interface": "ended"}]
    one, other = reversed(tables) if first else tables

    def opened(table: Mapping[str, Any]) -> can.BusABC:
        if table["interface"] == "ended":
            return Ended()
        return SocketcandBus(**{key: value for key, value in table.items() if key != "interface"})

    return join(one, [{**other, "nodes": [8]}], opened)


@pytest.mark.parametrize("first", [True, False], ids=["the first ended", "the second ended"])
def test_a_bus_that_ended_is_named_and_keeps_no_frame_from_the_other(first: bool) -> None:
    with Server() as end:
        wire = Wire(beside_an_ended_bus(end, first), TORQUE_IDENTIFIERS, "both")
        with pytest.raises(BusError, match="^both: the bus broke while receiving: ended: unplugged$"):
            wire.receive(PATIENCE_S)
        with pytest.raises(BusError, match="^both: .* could not be sent: ended: unplugged$"):
            wire.send_decided(*let_go())
        assert end.wait_for(b"send 404").endswith(LET_GO)
        wire.close()


def test_an_error_that_is_reported_on_one_of_two_buses_is_named() -> None:
    with Server() as one, Server() as other:
        wire = open_wire(two(one, other), TORQUE_IDENTIFIERS)
        other.say(b"< error 00000040 17.5 >")
        with pytest.raises(
            BusError, match="^socketcand can0 and socketcand can1: socketcand can1: an error is reported"
        ):
            wire.receive(PATIENCE_S)
        wire.close()


def two(one: Server, other: Server) -> dict[str, Any]:
    """Settings of two buses behind two servers."""
    return {**one.settings, "also": [{**other.settings, "channel": "can1", "nodes": [8]}]}


def test_two_buses_are_waited_for_without_looking_again_and_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hil.bus.joined.time", Restless())
    with Server() as one, Server() as other:
        wire = open_wire(two(one, other), TORQUE_IDENTIFIERS)
        for server, number in ((other, 7), (one, 8)):
            late = threading.Timer(0.05, server.say, [b"< frame %03d 17.5 AA >" % number])
            late.start()
            timed = wire.receive(PATIENCE_S)
            assert timed is not None and timed.frame == Frame(number, b"\xaa")
            late.join()
        assert wire.receive(0.01) is None
        wire.close()


class Restless:
    """Time that nobody sleeps in."""

    monotonic = staticmethod(time.monotonic)

    def sleep(self, seconds: float) -> None:
        """Complain."""
        raise AssertionError("slept, where both buses can be waited for")


def test_frames_that_two_buses_do_not_take_are_never_waited_for() -> None:
    with terminal() as (_, path), terminal() as (_, other):
        slcan = [{"interface": "slcan", "channel": name} for name in (path, other)]
        wire = open_wire({**slcan[0], "also": [{**slcan[1], "nodes": [8]}]}, TORQUE_IDENTIFIERS)
        with pytest.raises(BusError, match=f"could not be sent: slcan {path}: .* has stopped taking frames"):
            for _ in range(100_000):
                wire.send(Frame(0x001, bytes(8)))
        wire.close()


@given(st.lists(st.tuples(st.booleans(), st.integers(1, 20)), max_size=8))
def test_each_bus_is_heard_in_its_order_whatever_the_other_says(bursts: list[tuple[bool, int]]) -> None:
    waiting: tuple[deque[Frame], deque[Frame]] = (deque(), deque())
    bus = JoinedBus([Part(name, Ended(), Said(waiting[k]), frozenset()) for k, name in enumerate("ab")])
    said: tuple[list[Frame], list[Frame]] = ([], [])
    heard_: list[Frame] = []
    for number, (second, count) in enumerate(bursts):
        for k in range(count):
            frame = Frame(second, bytes([number, k]))
            waiting[second].append(frame)
            said[second].append(frame)
        heard_ += [frame for frame in (bus.next_frame(0.0) for _ in range(count // 2)) if frame is not None]
    heard_ += list(iter(lambda: bus.next_frame(0.0), None))
    assert tuple([frame for frame in heard_ if frame.identifier == k] for k in range(2)) == said
    bus.shutdown()


class Said:
    """Frames that have come on a bus."""

    def __init__(self, waiting: deque[Frame]) -> None:
        self.waiting = waiting

    def next_frame(self, timeout_s: float) -> Frame | None:
        """The next one."""
        return self.waiting.popleft() if self.waiting else None

    def send_frames(self, frames: Sequence[Frame]) -> None:
        """Nobody listens."""

    def handle(self) -> int:
        """None."""
        return NO_HANDLE


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
