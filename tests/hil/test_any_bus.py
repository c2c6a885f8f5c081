"""The same robot over different buses of python-can, in real time; SocketCAN where an interface is named.

`MISFIT_CAN=vcan0 make test` runs it on an interface of the kernel, which docs/can_setup.md says how to set up.
"""

import os
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import can
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hil.barrett.start_up import start_up
from hil.bus.gate import TORQUE_IDENTIFIERS
from hil.bus.wire import open_wire
from hil.codecs.frame import Frame
from hil.robots import proficio
from hil.session.check import check
from hil.terminal import stopped_by
from hil.virtual.adapters import BusServer, SerialAdapter
from hil.virtual.plant import FreeJoints
from hil.virtual.robot import VirtualRobot

KERNEL = os.environ.get("MISFIT_CAN", "")
BUSES = [
    pytest.param({"interface": "virtual", "channel": "misfit"}, id="virtual"),
    pytest.param({"interface": "slcan", "channel": "a pseudo-terminal", "bitrate": 1_000_000}, id="slcan"),
    pytest.param(
        {"interface": "socketcan", "channel": KERNEL},
        id="socketcan",
        marks=pytest.mark.skipif(not KERNEL, reason="no CAN interface is named: MISFIT_CAN=vcan0 make test"),
    ),
]


@contextmanager
def robot_on(settings: dict[str, Any]) -> Iterator[VirtualRobot]:
    robot, done = VirtualRobot(FreeJoints(proficio.HOME["right"]), eager=True), threading.Event()
    with SerialAdapter() if settings["interface"] == "slcan" else can.Bus(**settings) as bus:
        if isinstance(bus, SerialAdapter):
            settings["channel"] = bus.path
        thread = threading.Thread(target=BusServer(robot, bus).serve, args=(done.is_set,), daemon=True)
        thread.start()
        try:
            yield robot
        finally:
            done.set()
            thread.join(timeout=5)


@pytest.mark.parametrize("settings", BUSES)
def test_a_robot_starts_up_over_any_bus_and_is_found_to_be_well(
    settings: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    # Robot and session share a process here, so an answer may take longer than a node's millisecond.
    monkeypatch.setattr("hil.barrett.start_up.SCAN_S", (0.01, 0.04))
    with robot_on(settings) as robot:
        wire = open_wire(settings, TORQUE_IDENTIFIERS)
        try:
            found = start_up(wire, "right", time.sleep, lambda: True)
            assert found.counts == (4096,) * 3
            time.sleep(0.2)  # a setting is not acknowledged
            assert robot.safety.values["ZERO"] == 1
            # A shared machine may be too slow for a rate; what is there must be right.
            wrong = [finding.words for finding in check(wire, 50.0, time.sleep) if not finding.good]
            assert [words for words in wrong if "too slow" not in words] == []
        finally:
            wire.close()


@given(st.lists(st.binary(max_size=12), max_size=6))
def test_a_serial_adapter_bears_whatever_is_typed(lines: list[bytes]) -> None:
    with SerialAdapter() as adapter:
        for line in lines:
            adapter.hear(line + b"\r")
        while (message := adapter.recv(0.0)) is not None:
            assert message.arbitration_id <= 0x7FF


@given(st.integers(0, 0x7FF), st.binary(max_size=8))
def test_a_frame_that_is_typed_is_heard(identifier: int, data: bytes) -> None:
    with SerialAdapter() as adapter:
        adapter.hear(f"t{identifier:03X}{len(data)}{data.hex()}\r".encode())
        message = adapter.recv(0.0)
        assert message is not None
        assert (message.arbitration_id, bytes(message.data)) == (identifier, data)


class Counting(FreeJoints):
    """Counts its steps."""

    steps = 0

    def step(self, torques: np.ndarray, seconds: float) -> None:
        """Move on."""
        self.steps += 1
        super().step(torques, seconds)


MS = 1_000_000


def test_the_questions_of_a_cycle_move_the_plant_once() -> None:
    plant = Counting(proficio.HOME["right"])
    robot = VirtualRobot(plant)
    robot.advance(robot.arrival(1000 * MS))
    question = Frame(0x404, b"\x30")
    for late_ns in (0, MS // 20, MS // 11):  # one question after the other, while the first is being answered
        robot.receive(question, robot.arrival(1001 * MS + late_ns))
    assert (plant.steps, robot.time_ns) == (1, 1001 * MS)
    robot.receive(question, robot.arrival(1001 * MS + MS // 4))  # about when the cycle sends its torques
    assert (plant.steps, robot.time_ns) == (2, 1001 * MS + MS // 4)


def test_without_questions_the_plant_moves_on_every_two_milliseconds() -> None:
    plant = Counting(proficio.HOME["right"])
    robot = VirtualRobot(plant)
    robot.advance(1000 * MS)
    robot.keep_up(1001 * MS)
    assert plant.steps == 0
    robot.keep_up(1002 * MS)
    assert (plant.steps, robot.time_ns) == (2, 1002 * MS)


@pytest.mark.parametrize(
    ("virtual", "fault", "rate_hz", "hint"),
    [
        (True, "positions_answered: no believable position of joint 1 for 3 cycles", 500.0, "; try --rate 100"),
        (True, "force_bounded: the force sensor has not answered for 50 ms", 100.0, "; try --rate 50"),
        (True, "watched: the watchdog has let the arm go, or is gone", 100.0, "; try --rate 50"),
        (True, "positions_answered: no believable position of joint 1 for 3 cycles", 50.0, ""),
        (True, "force_bounded: 90 N at the wrist, the limit is 80 N", 500.0, None),
        (False, "positions_answered: no believable position of joint 1 for 3 cycles", 500.0, None),
    ],
)
def test_a_virtual_robot_that_answered_late_is_said_to_need_a_slower_session(
    virtual: bool, fault: str, rate_hz: float, hint: str | None
) -> None:
    lines = stopped_by({"faults": [fault], "rate_hz": rate_hz}, virtual).splitlines()
    assert lines[0] == f"stopped by {fault}"
    wanted = [] if hint is None else [f"this machine is too busy for a virtual robot at {rate_hz:g} Hz{hint}"]
    assert lines[1:] == wanted
