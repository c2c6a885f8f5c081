"""The processes of a session: what is left when one of them is stopped, killed or told to end."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import can
import pytest

from hil.barrett.start_up import start_up
from hil.bus.gate import TORQUE_IDENTIFIERS
from hil.bus.wire import MOST_DRAINED, Wire, open_wire
from hil.codecs.frame import Frame, Timed, parse_frame
from hil.control.pilot import Decision
from hil.recording.records import Kind
from hil.recording.replay import read_records
from hil.robots import proficio
from hil.session.heartbeat import LIMIT_NS, Heartbeat
from hil.session.loop import Loop, Wishes
from hil.session.recorded import replay_session
from hil.session.watchdog import watchdog
from hil.virtual.adapters import SerialAdapter
from hil.virtual.plant import FreeJoints
from hil.virtual.process import virtual_robot
from hil.virtual.robot import VirtualRobot
from hil.virtual.socketcand import SocketcandServer
from tests.hil.bench import Bench, ExactTimer
from tests.hil.held import PATIENCE_S, end_by, hold


def decided(folder: Path, frame: Frame) -> list[Timed]:
    """When a session decided to send a frame."""
    return [timed for kind, _, timed in read_records(folder) if kind is Kind.DECIDED and timed.frame == frame]


def heard_until(ear: Wire, last: str) -> list[str]:
    """Frames on a bus up to one."""
    heard, deadline = [""], time.monotonic() + PATIENCE_S
    while heard[-1] != last and time.monotonic() < deadline:
        timed = ear.receive(0.5)
        heard += [] if timed is None else [str(timed.frame)]
    return heard[1:]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_polite_end_lets_the_arm_down_and_finishes_the_recording(tmp_path: Path, number: int) -> None:
    ended = end_by(tmp_path, lambda process, _: process.send_signal(number), "not_aborted")
    assert ended.code == 1, ended.errors
    assert "Traceback" not in ended.errors
    assert ended.faults == ["not_aborted: stopped by the operator"]
    assert replay_session(ended.folder).first_different is None
    assert (ended.folder / "signals.parquet").exists()


def test_after_kill_9_everything_up_to_then_is_on_disk_and_replays(tmp_path: Path) -> None:
    folder = end_by(tmp_path, lambda process, _: process.kill(), "killed").folder
    deadline = time.monotonic() + PATIENCE_S
    size = -1
    while (now := (folder / "frames.bin").stat().st_size) != size and time.monotonic() < deadline:
        size = now
        time.sleep(0.3)
    found = replay_session(folder)
    assert found.cycles >= 100
    assert found.first_different is None or found.first_different == found.cycles - 1  # the last one may be cut off


def test_the_watchdog_lets_the_arm_go_when_the_loop_falls_silent() -> None:
    with virtual_robot() as settings, watchdog(settings) as heartbeat:
        wire = open_wire(settings, TORQUE_IDENTIFIERS)
        start_up(wire, "right", time.sleep, lambda: True)
        wire.drain()
        heartbeat.beat(time.monotonic_ns())
        deadline = time.monotonic() + PATIENCE_S
        while not heartbeat.tripped_ns and time.monotonic() < deadline:
            time.sleep(0.01)
        assert heartbeat.tripped_ns - heartbeat.last_ns >= LIMIT_NS
        seen = set()
        while time.monotonic() < deadline and len(seen) < 2:
            timed = wire.receive(0.5)
            if timed is not None and timed.frame.identifier in (0x401, 0x404):
                seen.add(str(timed.frame))
        assert seen == {"401#AA00000000000000", "404#880000000000"}
        wire.close()


def test_the_watchdog_of_a_serial_adapter_leaves_the_loop_every_frame_and_still_lets_the_arm_go() -> None:
    with SerialAdapter() as adapter:
        settings = {"interface": "slcan", "channel": adapter.path}
        with pytest.raises(RuntimeError), watchdog(settings) as heartbeat:
            wire = open_wire(settings, TORQUE_IDENTIFIERS)
            adapter.recv(0.0)  # the commands of opening
            heartbeat.beat(time.monotonic_ns() + 10**12)
            for k in range(1, 50):
                adapter.send(can.Message(arbitration_id=k, is_extended_id=False))
                time.sleep(0.002)  # the watchdog looks every millisecond
                timed = wire.receive(PATIENCE_S)
                assert timed is not None and timed.frame.identifier == k
            wire.close()
            raise RuntimeError("the session failed")
        heard = {message.arbitration_id for message in iter(lambda: adapter.recv(0.1), None)}
    assert {0x401, 0x404} <= heard


def test_the_watchdog_lets_the_arm_go_when_a_session_ends_by_an_error() -> None:
    """The loop's own bus may be what broke, so that its last torque is still on the motors."""
    with virtual_robot() as settings:
        ear = open_wire(settings, TORQUE_IDENTIFIERS)
        with pytest.raises(RuntimeError), watchdog(settings) as heartbeat:
            heartbeat.beat(time.monotonic_ns() + 10**12)  # no silence of the loop is what trips it
            raise RuntimeError("the bus broke")
        seen = heard_until(ear, "404#880000000000")
        ear.close()
    assert "401#AA00000000000000" in seen


@contextmanager
def served() -> Iterator[tuple[dict[str, Any], Callable[[], None]]]:
    """A robot on a socketcand bus, and what ends that."""
    server, done = SocketcandServer(VirtualRobot(FreeJoints(proficio.HOME["right"]))), threading.Event()
    thread = threading.Thread(target=server.serve, args=(done.is_set,), daemon=True)
    thread.start()
    try:
        yield {"interface": "socketcand", "host": "127.0.0.1", "port": server.port, "channel": "can0"}, done.set
    finally:
        done.set()
        thread.join(PATIENCE_S)


def test_where_one_of_two_buses_breaks_the_watchdog_lets_the_arm_go_on_the_other() -> None:
    with served() as (motors, _), served() as (sensor, break_it):
        ear = open_wire(motors, TORQUE_IDENTIFIERS)
        with watchdog({**motors, "also": [{**sensor, "nodes": [8]}]}) as heartbeat:
            heartbeat.beat(time.monotonic_ns() + 10**12)  # no silence of the loop is what trips it
            assert heartbeat.is_watched
            break_it()
            assert "401#AA00000000000000" in heard_until(ear, "404#880000000000")
            assert heartbeat.tripped_ns and not heartbeat.is_watched
        ear.close()


def test_a_session_whose_watchdog_was_killed_lets_the_arm_go() -> None:
    bench = Bench()
    pilot, heartbeat = bench.pilot(), Heartbeat.create()
    heartbeat.watchdog = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE, text=True)

    def wishes() -> Wishes:
        assert heartbeat.watchdog is not None
        if pilot.cycle == 600:
            heartbeat.watchdog.kill()
            heartbeat.watchdog.communicate(timeout=60)
        return Wishes(arm=pilot.cycle < 50, over=pilot.cycle > 1000)

    summary = Loop(bench.wire, pilot, ExactTimer(bench), None, heartbeat).run(wishes)
    heartbeat.remove()
    assert [fault.split(":")[0] for fault in summary.faults] == ["watched"]
    assert summary.cycles <= 602


def test_a_session_that_its_watchdog_let_go_says_how_long_it_stood_still() -> None:
    """By what the watchdog measures: 26 ms are too long for it, and within a period of that for the loop."""
    bench, heartbeat = Bench(), Heartbeat.create()
    pilot = bench.pilot()

    def stall(start_ns: int, decision: Decision) -> None:
        if pilot.cycle == 600:
            bench.bus.time_ns = start_ns + 26_000_000
            heartbeat.trip(bench.bus.time_ns)

    def wishes() -> Wishes:
        return Wishes(arm=pilot.cycle < 50, over=pilot.cycle > 1000)

    summary = Loop(bench.wire, pilot, ExactTimer(bench), None, heartbeat, watch=stall).run(wishes)
    assert heartbeat.longest_ns > heartbeat.limit_ns
    heartbeat.remove()
    assert summary.faults == [
        "watched: the watchdog has let the arm go, or is gone (the session stood still for 26 ms)"
    ]


@pytest.mark.parametrize("dry_run", [False, True])
def test_a_session_that_sent_no_torque_and_ends_by_an_error_has_none_taken_back(dry_run: bool) -> None:
    """One that ended before it cycled, and one whose cycles were a dry run."""
    with virtual_robot() as settings:
        ear = open_wire(settings, TORQUE_IDENTIFIERS)
        with pytest.raises(RuntimeError), watchdog(settings, dry_run=dry_run) as heartbeat:
            if dry_run:
                heartbeat.beat(time.monotonic_ns())
            raise RuntimeError("nobody was at home")
        voice = open_wire(settings, TORQUE_IDENTIFIERS)
        voice.send(Frame(0x7E0, b"\x01"))
        assert heard_until(ear, "7E0#01") == ["7E0#01"]
        voice.close()
        ear.close()


def test_a_watchdog_without_a_bus_lets_no_session_begin() -> None:
    from fmus.errors import ComponentError

    nowhere = {"interface": "socketcand", "host": "127.0.0.1", "port": 1, "channel": "can0"}
    with pytest.raises(ComponentError, match="the watchdog cannot reach the bus"), watchdog(nowhere):
        pass


def test_no_process_and_no_shared_memory_is_left_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shared = tmp_path / "shared"
    shared.mkdir()
    monkeypatch.setenv("MISFIT_SHARED", str(shared))
    process = hold(tmp_path / "session", 0.5)
    process.communicate(timeout=PATIENCE_S)
    assert (tmp_path / "session" / "frames.bin").stat().st_size > 0
    assert list(shared.iterdir()) == []


def watchdog_of(parent: int) -> int:
    """The process that watches a session."""
    for entry in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            fields = (entry / "stat").read_text().rpartition(")")[2].split()
            if int(fields[1]) == parent and b"hil.session.watchdog" in (entry / "cmdline").read_bytes():
                return int(entry.name)
    pytest.fail("the session has no watchdog")


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="processes are found by /proc here")
def test_a_watchdog_that_was_stopped_ends_the_session_and_its_torque(tmp_path: Path) -> None:
    """SIGSTOP: the process is there, and watches nothing."""
    idle, stopped, last = parse_frame("404#880000000000"), 0, list[Timed]()

    def stop_the_watchdog(process: "subprocess.Popen[str]", folder: Path) -> None:
        nonlocal stopped, last
        number = watchdog_of(process.pid)
        os.kill(number, signal.SIGSTOP)
        stopped = time.monotonic_ns()
        deadline = time.monotonic() + PATIENCE_S
        while not (last := decided(folder, idle)) and time.monotonic() < deadline:
            time.sleep(0.05)  # the session lets the arm go by itself
        os.kill(number, signal.SIGCONT)

    ended = end_by(tmp_path, stop_the_watchdog, "watched")
    assert ended.code == 1, ended.errors
    assert "Traceback" not in ended.errors
    assert ended.faults == ["watched: the watchdog has fallen silent"]
    assert last[0].time_ns > stopped
    assert replay_session(ended.folder).first_different is None


def test_a_watchdog_that_does_not_end_is_ended_without_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hil.session.watchdog.PATIENCE_S", 0.1)
    with virtual_robot() as settings:
        with watchdog(settings) as heartbeat:
            assert heartbeat.watchdog is not None
            os.kill(heartbeat.watchdog.pid, signal.SIGSTOP)
        assert heartbeat.watchdog.returncode == -signal.SIGKILL


def test_a_bus_that_never_falls_silent_keeps_nobody_from_going_on() -> None:
    class Babbling(can.BusABC):
        def __init__(self) -> None:
            super().__init__("babbling")

        def send(self, msg: can.Message, timeout: float | None = None) -> None:
            """Nobody hears it."""

        def _recv_internal(self, timeout: float | None):  # type: ignore[no-untyped-def]
            return can.Message(arbitration_id=0x7E5, data=b"x", is_extended_id=False), False

    wire = Wire(Babbling(), frozenset(), "babbling")
    assert len(wire.drain()) == MOST_DRAINED
    assert len(wire.drain(3)) == 3
