"""Sessions with CiA 402 drives on a virtual bus: the session of any other robot, in virtual time."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from fmus.errors import MisfitError
from hil.bus.wire import Wire
from hil.cia402 import objects
from hil.cia402.frames import OFF, command_of, nearer, pack_command, state_of, unpack_command
from hil.cia402.kind import Drives
from hil.cli import hil
from hil.codecs.frame import Frame, Timed
from hil.control.controllers import Controller, Hold, Observed
from hil.control.pilot import Pilot
from hil.errors import BusError
from hil.recording.recorder import Recorder
from hil.robots.absent import MODULE, SENSOR
from hil.safety.limits import lowered
from hil.session.loop import Loop, Wishes
from hil.session.recorded import replay_session
from hil.session.round_trip import measured, too_slow
from hil.virtual.direct_bus import DirectBus
from hil.virtual.drives import VirtualDrive, VirtualDrives
from hil.virtual.faults import Faults
from hil.virtual.plant import FreeJoints
from tests.hil.bench import OPEN, ExactTimer

NODES, GEAR, RATED, RATE = (3, 5), (50.0, -30.0), 0.5, 500.0
WAIVED = (MODULE, SENSOR)


class Steady:
    """Asks for the same torques."""

    def __init__(self, *torques: float) -> None:
        self.torques = np.array(torques)

    def torque(self, observed: Observed) -> np.ndarray:
        return self.torques


class Axes:
    """Two joints with a drive each on a bus inside the process."""

    def __init__(self, **options: object) -> None:
        self.kind = Drives(NODES, GEAR, home=(0.3, -0.2), **options)  # type: ignore[arg-type]
        self.plant = FreeJoints(np.array([0.3, -0.2]))
        self.drives = [VirtualDrive(node, rated=RATED) for node in NODES]
        self.robot, self.faults = VirtualDrives(self.plant, self.drives, GEAR), Faults()
        self.bus = DirectBus(self.robot, self.faults)
        self.wire = Wire(self.bus, self.kind.torque_identifiers, "virtual drives", lambda: self.bus.time_ns)
        OPEN.append(self.wire)
        self.sent: list[Timed] = []
        self.wire.tap = lambda timed, sent: self.sent.append(timed) if sent else None
        self.settings = type("Settings", (), {"limits": lowered(self.kind.limits(RATE))})

    def sleep(self, seconds: float) -> None:
        self.bus.time_ns += int(seconds * 1e9)

    def pilot(self, controller: Controller | None = None, waived: tuple[str, ...] = WAIVED) -> Pilot:
        robot = self.kind.start_up(self.wire, self.sleep, lambda: True)
        hold = Hold(np.array([4.0, 4.0]), np.array([0.4, 0.4]))
        return Pilot(robot, self.settings.limits, controller or hold, gravity=False, waived=waived)  # type: ignore[attr-defined]

    def run(self, pilot: Pilot, cycles: int, disturb=lambda cycle: None, recorder: Recorder | None = None) -> Loop:  # type: ignore[no-untyped-def]
        count = 0

        def wishes() -> Wishes:
            nonlocal count
            count += 1
            disturb(count)
            return Wishes(arm=not pilot.is_armed and count < 50, over=count > cycles)

        loop = Loop(self.wire, pilot, ExactTimer(self), recorder)  # type: ignore[arg-type]
        loop.run(wishes)
        return loop

    def commands(self) -> list[tuple[int, int]]:
        identifiers = self.kind.torque_identifiers
        return [unpack_command(timed.frame) for timed in self.sent if timed.frame.identifier in identifiers]


def test_drives_are_enumerated_checked_and_set_up_for_torque_with_a_watchdog_of_their_own() -> None:
    axes = Axes()
    assert axes.kind.enumerate(axes.wire) == [f"drive {n}: profile 402, SWITCH ON DISABLED" for n in NODES]
    axes.pilot()
    for drive in axes.drives:
        assert drive.value(objects.MODE_SHOWN) == 10
        assert drive.value(0x1400, objects.EVENT_TIMER) == 100
        assert drive.node.nmt.state == "OPERATIONAL"
        assert drive.state == "SWITCH ON DISABLED"


def test_joint_angles_are_those_of_the_plant_through_gears_of_either_sign() -> None:
    axes = Axes()
    pilot = axes.pilot()
    axes.plant.angles = np.array([0.5, 0.1])
    axes.robot.advance(axes.bus.time_ns + 1)
    counts = np.array([drive.position for drive in axes.drives], dtype=float)
    found = pilot.robot.joint_angles(counts)  # type: ignore[attr-defined]
    assert found == pytest.approx(axes.plant.angles, abs=2 * math.pi / 4096 / 30)


def test_a_torque_that_is_asked_for_is_made_at_the_joints() -> None:
    axes = Axes()
    pilot = axes.pilot(Steady(0.6, -0.4))
    axes.plant.damping = 20.0  # so that they hardly move
    made = []
    axes.run(pilot, 800, lambda cycle: made.append(axes.robot.gear * [drive.torque for drive in axes.drives]))
    step = np.array(GEAR) * RATED / 1000
    assert made[-1] == pytest.approx([0.6, -0.4], abs=float(np.abs(step).max()))


def test_no_drive_is_in_operation_before_arming_and_none_after_the_end() -> None:
    axes = Axes()
    pilot = axes.pilot()
    states = []
    axes.run(pilot, 400, lambda cycle: states.append((pilot.is_armed, *(drive.state for drive in axes.drives))))
    assert {state for armed, *both in states if not armed for state in both} <= {
        "SWITCH ON DISABLED",
        "READY TO SWITCH ON",
    }
    assert states[-1] == (True, "OPERATION ENABLED", "OPERATION ENABLED")
    assert axes.commands()[-2:] == [(OFF, 0), (OFF, 0)]
    assert {drive.state for drive in axes.drives} == {"SWITCH ON DISABLED"}


def test_without_a_safety_module_and_a_force_sensor_it_is_not_armed_unless_the_bench_says_so() -> None:
    axes = Axes()
    pilot = axes.pilot(waived=())
    axes.run(pilot, 60)
    assert not pilot.is_armed
    assert "there is no" in str(pilot.refused)
    assert set(axes.commands()) <= {(0x06, 0), (OFF, 0)}


def test_a_drive_that_fails_lets_all_of_them_go_and_says_its_error() -> None:
    axes = Axes()
    pilot = axes.pilot(Steady(0.5, 0.5))
    axes.plant.damping = 20.0
    loop = axes.run(pilot, 600, lambda cycle: cycle == 400 and axes.robot.fail(5, axes.bus.time_ns))
    assert loop.summary.faults == ["drives_ready: drive 5 is in the state FAULT, error 0x4310"]
    assert all(drive.torque == 0.0 for drive in axes.drives)


def test_drives_switch_themselves_off_when_commands_stay_away() -> None:
    axes = Axes()
    axes.plant.damping = 20.0
    pilot = axes.pilot(Steady(0.5, 0.5))

    def cut(cycle: int) -> None:
        if cycle == 400:
            axes.faults.towards_robot.append(lambda timed: [])  # the cable is out
            axes.faults.towards_host.append(lambda timed: [])

    axes.run(pilot, 600, cut)
    axes.robot.advance(axes.bus.time_ns + 150_000_000)
    assert {drive.state for drive in axes.drives} == {"FAULT"}
    assert all(drive.torque == 0.0 for drive in axes.drives)


def test_answers_that_stay_away_stop_the_arm_within_the_times_of_any_robot() -> None:
    axes = Axes()
    pilot = axes.pilot()
    lost = lambda cycle: cycle == 400 and axes.faults.towards_host.append(lambda timed: [])  # noqa: E731
    loop = axes.run(pilot, 600, lost)
    assert loop.summary.faults[-1].startswith("positions_answered: no believable position of joint 1")


def test_somebody_elses_commands_stop_the_arm_and_another_master_keeps_it_from_starting() -> None:
    axes = Axes()
    pilot = axes.pilot()
    loop = axes.run(pilot, 600, lambda cycle: cycle == 400 and axes.bus.inject(pack_command(3, 0x0F, 100)))
    assert "somebody else commands torques" in loop.summary.faults[0]
    busy = Axes()
    busy.bus.inject(Frame(0x080, b""))
    with pytest.raises(MisfitError, match=r"another program talks to these drives \(080#\)"):
        busy.pilot()


@pytest.mark.parametrize(
    ("index", "value", "words"),
    [
        (objects.DEVICE_TYPE, 401, "node 5 has the device profile 401"),
        (objects.SUPPORTED_MODES, 1, "drive 5 does not support the cyclic synchronous torque mode"),
        (objects.RATED_TORQUE, 0, "positive numbers were expected"),
    ],
)
def test_what_is_no_drive_for_torques_is_refused(index: int, value: int, words: str) -> None:
    axes = Axes()
    axes.drives[1]._store(index, 0, value)
    with pytest.raises(MisfitError, match=words):
        axes.pilot()


def test_a_drive_that_is_not_there_or_has_a_fault_is_named() -> None:
    axes = Axes()
    axes.drives[1].fail(0x2310, 0)
    with pytest.raises(MisfitError, match="drive 5 is in the state FAULT, error 0x2310"):
        axes.pilot()
    silent = Axes()
    silent.drives[0].powered = False
    with pytest.raises(BusError, match="drive 3, object 0x1000:0: No SDO response"):
        silent.pilot()
    assert "drive 3" in silent.kind.missing(silent.wire)


def test_limits_that_need_more_than_a_drive_allows_are_refused() -> None:
    axes = Axes()
    robot = axes.pilot().robot
    limits = axes.kind.limits(RATE)
    assert robot.looser_limits(axes.wire, limits) == []
    strong = replace(limits, joints=tuple(replace(joint, torque=100.0) for joint in limits.joints))
    assert (
        "joint 1 needs 4000 thousandths of the rated torque of drive 3, which allows 3000"
        in robot.looser_limits(axes.wire, strong)[0]
    )


def test_the_round_trip_is_measured_and_in_time() -> None:
    axes = Axes()
    robot = axes.pilot().robot
    assert too_slow(measured(axes.wire, robot), axes.kind.limits(RATE)) == ""


def test_a_robot_comes_back_from_its_recording() -> None:
    axes = Axes()
    robot = axes.pilot().robot
    assert axes.kind.restore(json.loads(json.dumps(robot.to_json()))) == robot


def test_decisions_come_out_again_from_their_frames_alone() -> None:
    axes = Axes()
    pilot = axes.pilot()
    given, decided, decide = [], [], pilot.decide

    def kept(cycle):  # type: ignore[no-untyped-def]
        decision = decide(cycle)
        given.append(cycle)
        decided.append(decision.frames)
        return decision

    pilot.decide = kept  # type: ignore[method-assign]
    axes.run(pilot, 400)
    other = Pilot(
        pilot.robot, pilot.limits, Hold(np.array([4.0, 4.0]), np.array([0.4, 0.4])), gravity=False, waived=WAIVED
    )
    assert [other.decide(cycle).frames for cycle in given] == decided


@pytest.mark.parametrize(
    ("word", "state"),
    [(0x0000, "NOT READY TO SWITCH ON"), (0x0250, "SWITCH ON DISABLED"), (0x0231, "READY TO SWITCH ON"), (0x0237, "OPERATION ENABLED"), (0x0218, "FAULT")],
)  # fmt: skip
def test_states_are_those_of_the_profile(word: int, state: str) -> None:
    assert state_of(word) == state


def test_only_a_fault_and_what_is_unknown_leave_the_power_stage_off() -> None:
    assert [nearer(state) for state in ("SWITCH ON DISABLED", "READY TO SWITCH ON", "SWITCHED ON", "FAULT", "")] == [
        6,
        7,
        15,
        0,
        0,
    ]


@pytest.mark.parametrize(
    "options",
    [{"nodes": ()}, {"nodes": (1, 1)}, {"nodes": (0, 1)}, {"nodes": (1, 2), "gear": (1.0,)}, {"nodes": (1,), "gear": (0.0,)}],
)  # fmt: skip
def test_numbers_that_do_not_fit_each_other_are_refused(options: dict) -> None:
    with pytest.raises(MisfitError, match="were expected|numbers each"):
        Drives(**options)


def test_commands_are_torque_frames_that_only_the_gate_sends(tmp_path: Path) -> None:
    axes = Axes()
    with pytest.raises(BusError, match="did not come from the safety core"):
        axes.wire.send(pack_command(3, 0x0F, 10))
    assert {command_of(node) for node in NODES} == axes.kind.torque_identifiers


def test_a_hold_with_virtual_drives_is_recorded_and_replays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    command = ["hold", "--virtual", "--robot", "cia402", "--rate", "50", "--seconds", "1", "--out", "s"]
    found = CliRunner().invoke(hil, command)
    assert found.exit_code == 0, found.output
    assert "without safety module, with halved limits" in found.output
    assert json.loads((tmp_path / "s" / "settings.json").read_text())["robot"] == "cia402"
    assert replay_session(tmp_path / "s").first_different is None


def test_trials_with_drives_that_measure_no_force_are_held_by_nobody_and_come_to_their_end(tmp_path: Path) -> None:
    """They were stopped, as joints that somebody held did not follow, and nobody could tell why."""
    timing = "settle_s = 0.1\nannounce_s = 0.1\nstimulate_s = 0.3\nrise_s = 0.1\n"
    trial = "[[trials]]\nposture = [0.74, 1.34]\nactivations = [0.01, 0, 0.01, 0, 0, 0.01]\n"
    (tmp_path / "short.toml").write_text(f"rest = [0.75, 1.35]\nmove_speed = 0.5\n{timing}{trial}")
    where = ["--virtual", "--robot", "cia402", "--rate", "100", "--out", str(tmp_path / "session")]
    done = CliRunner().invoke(hil, ["record", str(tmp_path / "short.toml"), *where])
    assert done.exit_code == 0, done.output
    assert "keep clear of the arm" in done.output and "WITHOUT FORCE SENSOR" in done.output
    assert "1 of 1 trials recorded" in done.output
