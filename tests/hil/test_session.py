"""A whole session against the virtual robot, in one process and without waiting for time to pass."""

import ast
import threading
import time
from dataclasses import replace
from pathlib import Path

import can
import numpy as np
import pytest

from fmus.errors import MisfitError
from hil.barrett.start_up import scan
from hil.bus.gate import TORQUES
from hil.bus.wire import Wire, open_wire
from hil.codecs.barrett.safety_module import Button, Mode
from hil.codecs.barrett.torques import pack_torques, unpack_torques
from hil.codecs.frame import Frame, Timed, parse_frame
from hil.control.controllers import Observed, Passive
from hil.control.pilot import Pilot
from hil.errors import BusError
from hil.recording.recorder import Recorder
from hil.recording.records import MAGIC, RECORD, Flag
from hil.recording.replay import Replayed, read_records, replay
from hil.robots import proficio
from hil.session.check import check
from hil.session.loop import Loop, Wishes
from hil.session.recorded import recorded_pilot
from hil.settings import default_settings, virtual_settings
from hil.terminal import stopped_by
from hil.virtual.control import Control
from hil.virtual.motor import IDLE, TORQUE
from tests.hil.bench import Bench, ExactTimer

HIL = Path(__file__).parents[2] / "hil"


def test_a_scan_finds_exactly_the_nodes_that_are_there() -> None:
    nodes = scan(Bench().wire)
    assert [(node.number, node.kind.value) for node in nodes] == [
        (1, "motor"),
        (2, "motor"),
        (3, "motor"),
        (8, "force/torque sensor"),
        (10, "safety module"),
    ]
    assert [node.awake for node in nodes] == [False, False, False, False, True]


def test_start_up_wakes_the_motors_and_zeroes_the_arm_on_its_stops() -> None:
    bench = Bench(eager=False)
    robot = bench.started()
    assert all(node.is_awake for node in bench.robot.nodes)
    counts = np.array([motor.counts for motor in bench.robot.motors])
    assert robot.joint_angles(counts) == pytest.approx(proficio.HOME["right"], abs=2e-4)
    assert bench.robot.safety.values["ZERO"] == 1


@pytest.mark.parametrize("frame", ["401#AA0000000000C000", "404#30", "003#05"])
def test_a_robot_that_another_host_talks_to_is_left_alone(frame: str) -> None:
    """Waking, zeroing or idling its motors would drop the arm of the session that runs."""
    bench = Bench()
    hears = bench.bus.recv

    def recv(timeout: float | None = None) -> can.Message | None:
        if timeout:  # it talks while somebody waits
            bench.bus.inject(parse_frame(frame))
        return hears(timeout)

    bench.bus.recv = recv  # type: ignore[method-assign]
    with pytest.raises(MisfitError, match=f"another program talks to this robot \\({frame}\\); end its session first"):
        bench.started()
    assert bench.sent == []
    (finding,) = check(bench.wire, 500.0, bench.sleep)
    assert not finding.good and "another program talks" in finding.words
    assert bench.sent == []


def test_start_up_sends_no_torque() -> None:
    bench = Bench()
    bench.started()
    assert bench.torque_frames() == []


def test_an_arm_that_is_not_on_its_stops_is_not_zeroed() -> None:
    bench = Bench()
    with pytest.raises(MisfitError, match="not zeroed and not on its stops"):
        bench.started(lambda: False)
    assert bench.robot.safety.values["ZERO"] == 0


@pytest.mark.parametrize("missing", [1, 2, 3])
def test_a_robot_without_one_of_its_motors_is_refused_by_what_is_there(missing: int) -> None:
    bench = Bench()
    bench.robot.motors[missing - 1].powered = False
    with pytest.raises(MisfitError, match=r"a Proficio has motors 1, 2, 3 and no others; found .*safety module"):
        bench.started()


def test_a_held_arm_stays_where_it_was_and_loses_no_answer() -> None:
    bench = Bench()
    summary = bench.run(bench.pilot(), 1000)
    assert (summary.frames_lost, summary.faults) == (0, [])
    assert bench.plant.angles == pytest.approx([-0.3, 0.2, 1.5], abs=0.01)


@pytest.mark.parametrize(("verb", "late", "lost"), [("late", 4, 0), ("lose", 0, 4)])
def test_answers_that_come_later_are_told_from_those_that_never_come(verb: str, late: int, lost: int) -> None:
    bench = Bench()
    pilot = bench.pilot()
    control = Control(bench.robot, bench.faults)

    def disturb(cycle: int) -> None:
        if cycle in (300, 310, 320, 330):
            control.follow([verb, "1"], bench.bus.time_ns)

    summary = bench.run(pilot, 600, disturb)
    assert (summary.answers_late, summary.frames_lost, summary.faults) == (late, lost, [])


def test_a_bus_that_breaks_while_the_arm_is_let_down_leaves_the_lost_answers_counted() -> None:
    bench = Bench()
    pilot = bench.pilot()
    control, hears, broken = Control(bench.robot, bench.faults), bench.bus.recv, threading.Event()

    def recv(timeout: float | None = None) -> can.Message | None:
        if broken.is_set():
            raise can.CanOperationError("unplugged")
        return hears(timeout)

    bench.bus.recv = recv  # type: ignore[method-assign]

    def wishes() -> Wishes:
        if pilot.cycle in (300, 310, 320, 330):
            control.follow(["lose", "1"], bench.bus.time_ns)
        if pilot.cycle == 400:
            broken.set()
        return Wishes(arm=pilot.cycle < 50, over=broken.is_set())

    loop = Loop(bench.wire, pilot, ExactTimer(bench))
    with pytest.raises(BusError, match="unplugged"):
        loop.run(wishes)
    assert (loop.summary.cycles, loop.summary.frames_lost) == (400, 4)


@pytest.mark.parametrize("rate_hz", [100.0, 500.0, 1000.0])
def test_a_virtual_robot_and_its_session_may_stand_still_for_100_ms_at_least_and_otherwise_has_the_limits_of_a_real_one(
    rate_hz: float,
) -> None:
    real, virtual = default_settings(rate_hz=rate_hz).limits, virtual_settings(rate_hz=rate_hz).limits
    assert virtual.missing_comply_s >= 0.1 and virtual.missing_release_s > virtual.missing_comply_s
    patience = ("missing_comply_s", "missing_release_s", "late_comply_s", "stall_s")
    assert all(getattr(virtual, name) > getattr(real, name) for name in patience[2:])
    assert replace(virtual, **{name: getattr(real, name) for name in patience}) == real


def test_a_pushed_arm_gives_way_as_its_stiffness_says_and_comes_back() -> None:
    bench, seen = Bench(), {}
    pilot = bench.pilot()

    def push(cycle: int) -> None:
        bench.plant.outside = np.array([0.0, 0.0, 1.0 if 600 < cycle < 1500 else 0.0])
        seen[cycle] = bench.plant.angles[2]

    summary = bench.run(pilot, 2500, push)
    assert summary.faults == []
    # 1 N.m against 20 N.m/rad
    assert seen[1490] - 1.5 == pytest.approx(1.0 / bench.settings.stiffness[2], rel=0.05)
    assert seen[2490] == pytest.approx(1.5, abs=0.01)


def test_a_session_ends_with_no_torque_and_idle_motors() -> None:
    bench = Bench()
    bench.run(bench.pilot(), 700)
    last = bench.torque_frames()[-1].frame
    assert unpack_torques(last.data) == (0, 0, 0, 0)
    assert all(motor.values["MODE"] == IDLE for motor in bench.robot.motors)


def test_before_it_is_armed_an_active_arm_gets_only_zero_torques() -> None:
    bench = Bench()
    pilot = bench.pilot()
    Loop(bench.wire, pilot, ExactTimer(bench)).run(_for(bench, 100))
    frames = bench.torque_frames()
    assert len(frames) >= 100
    assert {timed.frame.data for timed in frames} == {pack_torques([0, 0, 0])}


def test_a_dry_run_sends_no_torque_at_all() -> None:
    bench = Bench()
    pilot = bench.pilot()
    Loop(bench.wire, pilot, ExactTimer(bench), dry_run=True).run(_for(bench, 100, arm=True))
    assert pilot.is_armed
    assert bench.torque_frames() == []
    assert all(motor.values["MODE"] == TORQUE for motor in bench.robot.motors)


def test_a_pressed_emergency_stop_ends_the_session_in_silence() -> None:
    bench = Bench()
    pilot = bench.pilot()

    def press(cycle: int) -> None:
        if cycle == 600:
            bench.robot.safety.press(Button.ESTOP, bench.bus.time_ns)

    summary = bench.run(pilot, 2000, press)
    assert any("emergency stop" in fault for fault in summary.faults)
    assert summary.cycles < 700


def test_idle_on_the_pendant_lets_the_arm_go() -> None:
    bench = Bench()
    pilot = bench.pilot()

    def press(cycle: int) -> None:
        if cycle == 600:
            bench.robot.safety.press(Button.IDLE, bench.bus.time_ns)

    summary = bench.run(pilot, 2000, press)
    assert summary.faults == ["module_agrees: the safety module is idle"]
    assert bench.robot.safety.mode is Mode.IDLE


@pytest.mark.parametrize("cycle", range(600, 606))
def test_a_module_that_lets_the_arm_go_says_of_which_limit_it_warned(cycle: int) -> None:
    """Whether its mode or its pendant is heard first."""
    bench = Bench()
    pilot = bench.pilot()

    def pass_limits(now: int) -> None:
        if now in (300, cycle):  # no speed is below them
            bench.robot.safety.values["VL1" if now == 300 else "VL2"] = -1

    (fault,) = bench.run(pilot, 2000, pass_limits).faults
    assert fault in (
        "module_agrees: the safety module is idle, after it warned of velocity",
        "module_agrees: the safety module found a limit passed: velocity",
    )


def test_a_controller_of_ones_own_that_fails_leaves_no_torque() -> None:
    class Broken(Passive):
        def torque(self, observed):  # type: ignore[no-untyped-def]
            return np.full(3, np.nan) if observed.seconds > 0.5 else np.zeros(3)

    bench = Bench()
    summary = bench.run(bench.pilot(Broken()), 2000)
    assert summary.faults == ["finite_command: torque asked for at joint 1 is nan N.m"]
    assert unpack_torques(bench.torque_frames()[-1].frame.data) == (0, 0, 0, 0)


@pytest.mark.parametrize(
    "answer", [ValueError("no idea"), SystemExit("no idea"), np.zeros(2), "none", np.full(3, -np.inf)]
)
def test_a_controller_that_raises_or_answers_nonsense_stops_the_arm(answer: object) -> None:
    class Broken(Passive):
        def torque(self, observed):  # type: ignore[no-untyped-def]
            if observed.seconds < 0.5:
                return np.array([0.0, 0.0, 1.0])
            if isinstance(answer, BaseException):
                raise answer
            return answer

    bench = Bench()
    summary = bench.run(bench.pilot(Broken()), 2000)
    assert summary.cycles < 1000
    assert len(summary.faults) == 1
    assert summary.faults[0].startswith("finite_command")
    assert "no idea" in summary.faults[0] or not isinstance(answer, BaseException)
    assert unpack_torques(bench.torque_frames()[-1].frame.data) == (0, 0, 0, 0)


def test_torques_of_somebody_else_end_the_session_at_once() -> None:
    bench = Bench()
    pilot = bench.pilot()

    def interfere(cycle: int) -> None:
        if cycle == 600:
            bench.bus.inject(Frame(TORQUES, pack_torques([100, 0, 0])))

    summary = bench.run(pilot, 2000, interfere)
    assert summary.faults == ["alone_on_the_bus: somebody else commands torques on this bus"]
    assert summary.cycles <= 603


def test_a_torque_frame_that_does_not_come_from_the_core_is_not_sent() -> None:
    bench = Bench()
    with pytest.raises(BusError, match="did not come from the safety core"):
        bench.wire.send(Frame(TORQUES, pack_torques([1])))
    assert bench.torque_frames() == []


def test_only_loop_and_watchdog_send_frames_past_the_gate_and_only_the_gate_packs_torques() -> None:
    """Read from the source: who calls `send_decided`, and who calls `pack_torques`."""
    callers: dict[str, set[str]] = {"send_decided": set(), "pack_torques": set()}
    for path in HIL.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Call):
                name = getattr(node.func, "attr", getattr(node.func, "id", ""))
                if name in callers:
                    callers[name].add(str(path.relative_to(HIL)))
    assert callers == {
        "send_decided": {"bus/wire.py", "session/loop.py", "session/watchdog.py"},
        "pack_torques": {"bus/gate.py"},
    }


def test_a_recording_replays_to_the_same_frames_bit_for_bit(tmp_path: Path) -> None:
    bench = Bench()
    pilot = bench.pilot()
    recorder = Recorder(tmp_path / "recording")
    bench.wire.tap = recorder.frame
    loop = Loop(bench.wire, pilot, ExactTimer(bench), recorder)
    loop.run(_for(bench, 400, arm=True))
    recorder.finish()
    again = Pilot(pilot.robot, pilot.limits, bench.settings.make_controller(), gravity=False)
    found = Replayed()
    for found, cycle, _ in replay(tmp_path / "recording", again):  # noqa: B007
        pass
    assert found.cycles > 400
    assert found.first_different is None


def test_a_replay_with_other_limits_says_where_it_differs(tmp_path: Path) -> None:
    bench = Bench()
    pilot = bench.pilot()
    recorder = Recorder(tmp_path / "recording")
    bench.wire.tap = recorder.frame
    bench.plant.outside = np.array([0.0, 0.0, 0.3])
    Loop(bench.wire, pilot, ExactTimer(bench), recorder).run(_for(bench, 400, arm=True))
    recorder.finish()
    other = Pilot(pilot.robot, pilot.limits, Passive(), gravity=False)
    found = [found for found, _, _ in replay(tmp_path / "recording", other)][-1]
    assert found.first_different is not None


def test_a_folder_that_holds_a_recording_is_not_written_over(tmp_path: Path) -> None:
    Recorder(tmp_path).finish()
    with pytest.raises(MisfitError, match="holds a recording already"):
        Recorder(tmp_path)


def test_a_damaged_recording_is_named_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "frames.bin").write_bytes(MAGIC + b"\x09" * RECORD.size)
    for name in ("settings.json", "robot.json"):
        (tmp_path / name).write_text("{}")
    with pytest.raises(MisfitError, match="settings.json or robot.json is damaged"):
        recorded_pilot(tmp_path)
    with pytest.raises(MisfitError, match="frames.bin is damaged"):
        list(read_records(tmp_path))


def test_every_wish_has_a_bit_of_its_own() -> None:
    assert sorted(Flag) == [1 << k for k in range(len(Flag))]


def test_a_bus_that_does_not_exist_is_named_with_those_that_do() -> None:
    with pytest.raises(MisfitError, match="bus 'nonsense' cannot be opened.*socketcan"):
        open_wire({"interface": "nonsense"}, frozenset())


def test_an_error_frame_is_an_error_and_silence_is_none() -> None:
    class Sick(can.BusABC):
        def __init__(self) -> None:
            super().__init__(channel="sick")
            self.messages = [can.Message(is_error_frame=True), None]

        def send(self, msg: can.Message, timeout: float | None = None) -> None:
            raise can.CanOperationError("bus off")

        def _recv_internal(self, timeout: float | None):  # type: ignore[no-untyped-def]
            return self.messages.pop(), False

    wire = Wire(Sick(), frozenset(), "sick bus")
    assert wire.receive(0.0) is None
    with pytest.raises(BusError, match="sick bus: the adapter reports an error"):
        wire.receive(0.0)
    with pytest.raises(BusError, match=r"sick bus: 001#05 could not be sent: bus off"):
        wire.send(Frame(1, b"\x05"))
    wire.close()


def _for(bench: Bench, cycles: int, arm: bool = False):  # type: ignore[no-untyped-def]
    count = iter(range(10**9))

    def wishes() -> Wishes:
        k = next(count)
        return Wishes(arm=arm and k < 20, over=k >= cycles)

    return wishes


def test_times_of_a_cycle_are_those_of_the_bus() -> None:
    bench = Bench()
    bench.wire.send(Frame(0x001, b"\x05"))
    timed = bench.wire.receive(0.01)
    assert timed == Timed(75_000, Frame(0x426, bytes.fromhex("850000000000")))


class Slow(Passive):
    """Takes its time, of one clock or the other."""

    def __init__(self, take) -> None:  # type: ignore[no-untyped-def]
        self.take = take

    def torque(self, observed: Observed) -> np.ndarray:
        """None."""
        self.take(0.0012)
        return super().torque(observed)


def test_a_busy_machine_does_not_look_like_a_slow_controller_where_time_is_virtual() -> None:
    def count(seconds: float) -> None:
        end = time.perf_counter() + seconds
        while time.perf_counter() < end:
            pass

    bench = Bench()
    assert bench.run(bench.pilot(Slow(count)), 100).faults == []


def test_a_controller_that_takes_too_long_once_is_told_and_nothing_else() -> None:
    bench, slow = Bench(), {300}

    class Once(Passive):
        def torque(self, observed: Observed) -> np.ndarray:
            if bench.cycle in slow:
                slow.remove(bench.cycle)
                bench.sleep(0.0011)
            return super().torque(observed)

    pilot = bench.pilot(Once())
    summary = bench.run(pilot, 600)

    assert (pilot.slow_cycles, summary.faults) == (1, [])
    words = stopped_by({"slow_cycles": 1, "faults": [], "rate_hz": 500.0}, True)
    assert words.startswith("the controller took more than half of the cycle 1 time;")


def test_a_stall_inside_a_cycle_is_told_by_its_length_though_no_cycle_began_late() -> None:
    bench, stalls = Bench(), {300}

    class Stalls(Passive):
        def torque(self, observed: Observed) -> np.ndarray:
            if bench.cycle in stalls:
                stalls.remove(bench.cycle)
                bench.sleep(0.0868)
            return super().torque(observed)

    summary = bench.run(bench.pilot(Stalls()), 600)
    assert summary.lateness.to_json()["max"] == 0.0
    # From the last torque frame before it to the first one after it, and from the cycle in which it was to the next.
    assert summary.torque_gap_ns == pytest.approx(88_800_000, abs=1_000_000)
    assert summary.cycle_gap_ns == pytest.approx(87_000_000, abs=1_000_000)
    assert summary.faults[0].startswith("on_time: the session stood still: 87")


def test_a_controller_that_takes_more_than_half_of_a_cycle_is_stopped() -> None:
    bench = Bench()
    faults = bench.run(bench.pilot(Slow(bench.sleep)), 100).faults
    assert faults
    assert "on_time: for 30 ms all cycles were late or took more than half of 2 ms" in faults[0]
