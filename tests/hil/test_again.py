"""A session whose bus broke is taken up again from the very beginning, and nothing moves before somebody has armed it once more."""

import json
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import can
import pytest
from click.testing import CliRunner

from fmus.errors import ComponentError, MisfitError
from hil.barrett import kind as barrett
from hil.barrett.start_up import Robot
from hil.bus.gate import TORQUE_IDENTIFIERS, let_go
from hil.bus.wire import open_wire
from hil.cli import hil
from hil.codecs.frame import Frame
from hil.control.pilot import Decision, Pilot
from hil.errors import BusError
from hil.recording.records import Kind
from hil.recording.replay import read_records
from hil.robots import proficio
from hil.session import again
from hil.session.again import keep_on, wait_for_arm
from hil.session.entry import Operator
from hil.session.recorded import ROBOT, replay_session
from hil.session.session import BrokenSession, run_session
from hil.settings import virtual_settings
from hil.virtual.adapters import BusServer
from hil.virtual.plant import FreeJoints
from hil.virtual.robot import VirtualRobot

PATIENCE_S = 60.0
LET_GO = [str(frame) for frame in let_go()]


class Time:
    """Passes only when somebody waits."""

    def __init__(self, while_waiting: Callable[[], None] = lambda: None) -> None:
        self.seconds, self.while_waiting = 0.0, while_waiting

    def sleep(self, seconds: float) -> None:
        """Wait."""
        self.seconds += seconds
        self.while_waiting()

    def now(self) -> float:
        """Since it began."""
        return self.seconds


def on(channel: str) -> dict[str, Any]:
    return {"interface": "virtual", "channel": channel}


def heard(bus: can.BusABC) -> list[str]:
    """What has been said on a bus."""
    return [str(Frame(m.arbitration_id, bytes(m.data))) for m in iter(lambda: bus.recv(0.0), None)]


@contextmanager
def answering(bus: can.BusABC) -> Iterator[Callable[[], None]]:
    """A robot on a bus, from when the yielded function is called."""
    robot, done = VirtualRobot(FreeJoints(proficio.HOME["right"]), eager=True), threading.Event()
    thread = threading.Thread(target=BusServer(robot, bus).serve, args=(done.is_set,), daemon=True)
    try:
        yield thread.start
    finally:
        done.set()
        thread.join(PATIENCE_S)


def test_the_first_that_a_bus_hears_which_came_back_is_no_torque_and_idle() -> None:
    time = Time()
    with can.Bus("back", "virtual") as ear:
        with pytest.raises(BusError, match=r"has not come back within 0.1 s: virtual back: motor 1 does not answer"):
            wait_for_arm(on("back"), 0.1, sleep=time.sleep, now=time.now)
        said = heard(ear)
    assert said[: len(LET_GO)] == LET_GO
    assert set(said) == {*LET_GO, "001#05"}, "besides, motors are only asked whether they are there"


def test_a_bus_is_waited_for_until_all_motors_answer_on_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(barrett, "ANSWER_S", 0.001)
    with can.Bus("slow", "virtual") as far, answering(far) as begin:
        began: list[float] = []

        def while_waiting() -> None:
            if time.seconds > 0.5 and not began:
                began.append(time.seconds)
                monkeypatch.setattr(barrett, "ANSWER_S", 5.0)  # robot and session share a process here
                begin()

        time = Time(while_waiting)
        wait_for_arm(on("slow"), PATIENCE_S, sleep=time.sleep, now=time.now)
    assert began


def test_where_another_host_talks_to_the_robot_by_now_nothing_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    with can.Bus("taken", "virtual") as other:
        wire = open_wire(on("taken"), TORQUE_IDENTIFIERS)
        other.send(can.Message(arbitration_id=0x404, data=[0x30], is_extended_id=False))
        monkeypatch.setattr(again, "open_wire", lambda *_: wire)
        wait_for_arm(on("taken"), 0.1)
        assert heard(other) == []


def test_a_dry_run_takes_no_torque_back_from_whoever_commands_the_arm() -> None:
    time = Time()
    with can.Bus("dry", "virtual") as ear:
        with pytest.raises(BusError):
            wait_for_arm(on("dry"), 0.1, dry_run=True, sleep=time.sleep, now=time.now)
        assert set(heard(ear)) == {"001#05"}


def test_a_bus_that_cannot_be_opened_is_said_to_be_why() -> None:
    time = Time()
    with pytest.raises(BusError, match="has not come back within 3 s: bus 'socketcan none0' cannot be opened"):
        wait_for_arm({"interface": "socketcan", "channel": "none0"}, 3.0, sleep=time.sleep, now=time.now)
    assert 2.5 < time.seconds <= 3.0


@pytest.fixture
def back_at_once(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    waits: list[float] = []
    monkeypatch.setattr(again, "wait_for_arm", lambda bus, patience_s, **_: waits.append(patience_s))
    return waits


def breaking(times: int) -> tuple[list[Path], Callable[[Path], dict[str, Any]]]:
    """A session whose bus breaks so often, and the folders that it was given."""
    folders: list[Path] = []

    def run(folder: Path) -> dict[str, Any]:
        folder.mkdir()
        folders.append(folder)
        if len(folders) <= times:
            raise BrokenSession(f"unplugged {len(folders)}")
        return {"faults": []}

    return folders, run


def test_each_session_records_into_a_folder_of_its_own_and_what_broke_is_kept(
    tmp_path: Path, back_at_once: list[float]
) -> None:
    (tmp_path / "arm-3").mkdir()  # of another day
    folders, run = breaking(2)
    said: list[str] = []
    document = keep_on(run, tmp_path / "arm", on("x"), 7.0, said.append)
    assert [folder.name for folder in folders] == ["arm", "arm-2", "arm-4"]
    assert document["breaks"] == [
        {"recording": str(tmp_path / "arm"), "fault": "unplugged 1"},
        {"recording": str(tmp_path / "arm-2"), "fault": "unplugged 2"},
    ]
    assert back_at_once == [7.0, 7.0]
    assert "unplugged 1" in said[0] and "waiting up to 7 s" in said[0] and "armed again" in said[1]


def test_a_session_that_ended_by_anything_but_its_bus_is_not_begun_anew(
    tmp_path: Path, back_at_once: list[float]
) -> None:
    def run(folder: Path) -> dict[str, Any]:
        raise ComponentError("records were lost")

    with pytest.raises(ComponentError, match="records were lost"):
        keep_on(run, tmp_path / "arm", on("x"), 7.0, lambda words: None)
    assert back_at_once == []


def test_a_virtual_robot_is_not_waited_for() -> None:
    result = CliRunner().invoke(hil, ["hold", "--virtual", "--reconnect", "5"])
    assert isinstance(result.exception, MisfitError)
    assert "--reconnect needs --bench FILE" in str(result.exception)


def test_holding_says_what_was_broken_off(
    tmp_path: Path, back_at_once: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[Path] = []
    whole = {"cycles": 5, "rate_hz": 500.0, "missed": 0, "answers_late": 0, "frames_lost": 0, "not_permitted": []}
    whole |= {"lateness_us": {"p50": 0, "p99": 0, "max": 0}, "faults": [], "recording": "arm-2"}

    def run(settings: object, seconds: float, operator: Operator, folder: Path, **_: object) -> dict[str, Any]:
        assert not operator.abort.is_set()
        calls.append(folder)
        if len(calls) == 1:
            operator.abort.set()  # nothing of an operator's wishes is left for the next session
            raise BrokenSession("virtual nowhere: unplugged")
        return whole

    monkeypatch.setattr("hil.session.session.run_session", run)
    (tmp_path / "bench.toml").write_text('[bus]\ninterface = "virtual"\nchannel = "nowhere"\n')
    options = ["--bench", str(tmp_path / "bench.toml"), "--out", str(tmp_path / "arm"), "--reconnect", "5"]
    result = CliRunner().invoke(hil, ["hold", *options])
    assert result.exit_code == 0, result.output
    assert "broken off: virtual nowhere: unplugged" in result.stdout
    assert back_at_once == [5.0]


@pytest.mark.parametrize("stopped", [False, True])
def test_a_bus_that_breaks_while_the_arm_is_let_down_breaks_no_session_that_should_go_on(
    stopped: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def cycles(settings: object, seconds: float, operator: Operator, folder: Path, *_: object) -> None:
        folder.mkdir()
        (folder / ROBOT).touch()
        if stopped:
            operator.abort.set()
        raise BusError("unplugged")

    monkeypatch.setattr("hil.session.session._cycles", cycles)
    monkeypatch.setattr("hil.session.session.finish_session", lambda folder, summary: None)
    with pytest.raises(ComponentError, match="unplugged; what was recorded until then is in") as caught:
        run_session(virtual_settings(), 1.0, Operator(bool, bool), tmp_path / "arm")
    assert isinstance(caught.value, BrokenSession) is not stopped


def start_robot(port: int) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "hil.virtual", "--port", str(port)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True, start_new_session=True)


def test_after_a_restart_of_the_server_all_is_asked_again_and_an_arm_that_nobody_arms_gets_no_torque(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("hil.session.session.real_time_priority", lambda: nullcontext([]))
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    bus = {"interface": "socketcand", "host": "127.0.0.1", "port": port, "channel": "can0"}
    settings = replace(virtual_settings(rate_hz=50.0), bus=bus)
    asked: list[str] = []
    robots = [start_robot(port)]

    def on_stops() -> bool:
        asked.append("stops")
        return True

    def may_arm(robot: Robot) -> bool:
        asked.append("arm")
        return asked.count("arm") == 1

    def watch(pilot: Pilot, decision: Decision) -> None:
        # A machine that stands still may keep the arm from being armed; its bus breaks all the same.
        if len(robots) == 1 and (pilot.is_armed or pilot.cycle > 200):
            robots[0].kill()

    def run(folder: Path) -> dict[str, Any]:
        return run_session(settings, 0.4 if asked else 600.0, Operator(on_stops, may_arm, watch=watch), folder)

    def tell(words: str) -> None:
        if len(robots) == 1:
            robots.append(start_robot(port))

    try:
        assert robots[0].stdout is not None and robots[0].stdout.readline().strip() == str(port)
        document = keep_on(run, tmp_path / "arm", bus, PATIENCE_S, tell)
    finally:
        for robot in robots:
            robot.kill()
            robot.communicate(timeout=60)
    assert asked == ["stops", "arm"] * 2
    (broken,) = document["breaks"]
    (latched,) = json.loads((tmp_path / "arm" / "summary.json").read_text())["faults"]
    assert broken["fault"].startswith(latched)
    assert replay_session(tmp_path / "arm").cycles > 0
    torques = {
        str(timed.frame)
        for kind, _, timed in read_records(tmp_path / "arm-2")
        if kind is Kind.SENT and timed.frame.identifier in TORQUE_IDENTIFIERS
    }
    assert torques == {LET_GO[0]}
