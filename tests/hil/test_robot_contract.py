"""The contract of robots: one that nobody here knows gets the session of all others, with its own protocol and joints."""

import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from fmus.errors import MisfitError
from hil.bus.wire import Wire
from hil.control.pilot import Pilot
from hil.errors import BusError
from hil.recording.identify import write_identification
from hil.recording.recorder import Recorder
from hil.robots.base import RobotKind
from hil.robots.known import robot_kind
from hil.session.loop import Loop, Wishes
from hil.session.recorded import ROBOT, SETTINGS, finish_session, pilot_of, recorded_pilot, replay_session
from hil.settings import default_settings, read_settings, settings_of_json, virtual_settings
from hil.virtual.direct_bus import DirectBus
from hil.virtual.faults import Faults
from tests.hil.bench import OPEN, ExactTimer
from tests.hil.toy_robot import COMMAND, HALT, Toy, VirtualToy

TOY = "tests.hil.toy_robot:Toy"
BENCH = f"""
[bus]
interface = "virtual"

[robot]
kind = "{TOY}"
reach = 0.8
proof = false
gravity = false

[controller]
kind = "hold"
stiffness = [6.0, 7.0]
damping = [0.5, 0.5]

[[joints]]
torque = 2.5
"""


class ToyBench:
    """A session with it in virtual time, from its bench file on."""

    def __init__(self, folder: Path) -> None:
        path = folder / "bench.toml"
        path.write_text(BENCH)
        self.settings, self.robot, self.faults = read_settings(path), VirtualToy(), Faults()
        self.kind = self.settings.kind
        self.bus = DirectBus(self.robot, self.faults)
        self.wire = Wire(self.bus, self.kind.torque_identifiers, "toy bus", lambda: self.bus.time_ns)
        OPEN.append(self.wire)
        self.sent: list[int] = []

    def pilot(self) -> Pilot:
        return pilot_of(self.kind.start_up(self.wire, lambda seconds: None, lambda: True), self.settings)

    def run(self, pilot: Pilot, cycles: int, disturb=lambda cycle: None, recorder: Recorder | None = None) -> Loop:  # type: ignore[no-untyped-def]
        count = 0

        def wishes() -> Wishes:
            nonlocal count
            count += 1
            disturb(count)
            return Wishes(arm=not pilot.is_armed and count < 20, over=count > cycles)

        if recorder is not None:
            self.wire.tap = recorder.frame
        loop = Loop(self.wire, pilot, ExactTimer(self), recorder)  # type: ignore[arg-type]
        loop.run(wishes)
        return loop


def test_a_bench_file_names_a_robot_of_ones_own_with_its_keys_its_limits_and_its_gains(tmp_path: Path) -> None:
    bench = ToyBench(tmp_path)
    joints = bench.settings.limits.joints
    assert [(joint.torque, joint.low, joint.high) for joint in joints] == [(2.5, -0.8, 0.8), (3.0, -0.8, 0.8)]
    assert bench.settings.stiffness == (6.0, 7.0)
    assert isinstance(bench.kind, Toy)
    assert settings_of_json(json.dumps(bench.settings.to_json())) == bench.settings


def test_it_is_held_against_a_push_and_let_go_at_the_end_with_its_own_frames(tmp_path: Path) -> None:
    bench = ToyBench(tmp_path)
    pilot = bench.pilot()

    held = np.zeros(2)

    def push(cycle: int) -> None:
        held[:] = bench.robot.plant.angles if cycle <= 2000 else held
        bench.robot.plant.outside = np.array([0.6, 0.0]) if 600 < cycle <= 2000 else np.zeros(2)

    loop = bench.run(pilot, 2000, push)
    assert loop.summary.faults == []
    # A spring of 6 N.m/rad gives way by 0.1 rad under 0.6 N.m.
    assert held == pytest.approx((0.3, -0.3), abs=5e-3)
    assert bench.robot.halted and not bench.robot.torques.any()


def test_its_answers_that_stay_away_let_it_go_in_the_time_of_any_robot(tmp_path: Path) -> None:
    bench = ToyBench(tmp_path)

    def cut(cycle: int) -> None:
        if cycle == 600:
            bench.faults.towards_host.append(lambda timed: [])

    loop = bench.run(bench.pilot(), 900, cut)
    assert loop.summary.faults[-1].startswith("positions_answered: no believable position of joint 1 for 30 ms")
    assert not bench.robot.torques.any()


def test_its_torque_frames_are_refused_from_anywhere_but_the_core(tmp_path: Path) -> None:
    bench = ToyBench(tmp_path)
    with pytest.raises(BusError, match="torque frame 020#00000000 did not come from the safety core"):
        bench.wire.send(bench.kind.stop()[0])


def test_its_session_is_a_measurement_set_that_replays_and_names_its_frame(tmp_path: Path) -> None:
    bench, folder = ToyBench(tmp_path), tmp_path / "session"
    recorder = Recorder(folder)
    pilot = bench.pilot()
    (folder / SETTINGS).write_text(json.dumps(bench.settings.to_json()))
    (folder / ROBOT).write_text(json.dumps(pilot.robot.to_json()))

    def push(cycle: int) -> None:
        bench.robot.plant.outside = np.array([0.5 * np.sin(0.02 * cycle), 0.0])

    bench.run(pilot, 1200, push, recorder)
    recorder.finish()
    found = replay_session(folder)
    assert found.cycles >= 1200 and found.first_different is None
    finish_session(folder)
    names = pq.read_schema(folder / "signals.parquet").names
    assert {"q1", "q2", "tau2", "passed2"} <= set(names) and "q3" not in names
    assert 'frame = "robot: toy (1 turns, 2 bends)"' in (folder / "case.toml").read_text()
    written = write_identification(folder, recorded_pilot(folder), tmp_path / "set")
    assert written.joint == 1


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("wam", "robot kind 'wam' is not known; there are proficio, cia402"),
        ("nowhere.at_all:Robot", "cannot be imported: No module named 'nowhere'"),
        ("tests.hil.toy_robot:Other", "cannot be imported: .*Other"),
    ],
)
def test_a_kind_that_there_is_not_is_said_so(name: str, words: str) -> None:
    with pytest.raises(MisfitError, match=words):
        robot_kind(name, {})


def test_a_key_that_a_kind_does_not_know_is_named() -> None:
    with pytest.raises(MisfitError, match="kind 'cia402': .*'rach'"):
        robot_kind("cia402", {"rach": 1.0})


@pytest.mark.parametrize("name", ["proficio", "cia402", TOY])
def test_every_kind_offers_what_the_contract_asks_for(name: str) -> None:
    kind = robot_kind(name, {})
    offered = [part for part in (*RobotKind.__annotations__, *vars(RobotKind)) if not part.startswith("_")]
    assert {"enumerate", "start_up", "limits", "stop", "frame"} <= set(offered)
    assert [part for part in offered if not hasattr(kind, part)] == []
    limits = kind.limits(200.0)
    assert len(limits.joints) == kind.joints == len(kind.gains().stiffness)
    assert all(frame.identifier in kind.torque_identifiers or not any(frame.data[1:]) for frame in kind.stop())
    settings = default_settings(robot=name)
    assert settings.limits.period_ns == 2_000_000


def test_a_virtual_robot_without_safeguards_is_one_that_says_so_with_halved_limits() -> None:
    found, usual = virtual_settings(robot="cia402"), default_settings(robot="cia402")
    assert len(found.waived) == 2
    assert found.limits.joints[0].torque == 0.5 * usual.limits.joints[0].torque
    assert virtual_settings().waived == ()


def test_only_torque_frames_and_a_halt_stop_the_toy() -> None:
    assert [frame.identifier for frame in Toy().stop()] == [COMMAND, HALT]
