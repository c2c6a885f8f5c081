"""Trials from a protocol file: read, run on the virtual robot, recorded, replayed, and used as measurements."""

from dataclasses import replace
from itertools import count, pairwise
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fmus.errors import MisfitError
from hil.bus.gate import TORQUES
from hil.codecs.barrett.identifiers import Group, answer_of
from hil.codecs.frame import Timed
from hil.emulation.anatomy import anatomy
from hil.emulation.planar import Placement
from hil.session.recorded import replay_session
from hil.trials.files import CUT, STRAIGHT, acted, middles, pushes
from hil.trials.phases import PEAK, Course, Movement, Phase
from hil.trials.protocol import Protocol, Trial, protocol_of_json, read_protocol
from hil.virtual.faults import Faults
from orchestrator.measurements.load import load_measurements
from tests.hil.trial_session import FRICTION, Session, run_trials, some_trials

# --- protocols


def test_the_study_has_each_of_seven_postures_three_times() -> None:
    study = read_protocol("study")
    postures = [trial.posture for trial in study.trials]
    assert len(postures) == 21
    assert sorted(postures) == sorted(3 * list(set(postures)))
    assert len(set(postures)) == 7
    assert study.confirm


def test_a_protocol_comes_back_from_its_json() -> None:
    study = read_protocol("study")
    assert protocol_of_json(study.to_json()) == study


ONE = "[[trials]]\nposture = [0.7, 1.3]\nactivations = [0, 0, 0.2, 0, 0, 0]\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "a protocol without trials"),
        ("move_speed = 0\n" + ONE, "move_speed = 0; a positive number"),
        ("stimulate_s = 'long'\n" + ONE, "value of the wrong kind"),
        ("colour = 3\n" + ONE, "'colour', which is not known"),
        ("confirm = 1\n" + ONE, "confirm = 1; true or false"),
        ("rise_s = 1.5\n" + ONE, "rise and fall in 1.5 s each"),
        ("announce_s = -1\n" + ONE, "announce_s = -1 s"),
        ("held_out = 1.0\n" + ONE, "held_out = 1.0"),
        (ONE + "speed = 1\n", r"\[\[trials\]\] has 'speed'"),
        ("[[trials]]\nposture = [1.0]\nactivations = [0, 0, 0, 0, 0, 0]\n", "posture = "),
        ("[[trials]]\nposture = [1.0, nan]\nactivations = [0, 0, 0, 0, 0, 0]\n", "posture = "),
        ("[[trials]]\nposture = [1.0, 1.0]\nactivations = [0, 0, 0, 0, 0, 1.1]\n", "between 0 and 1"),
        ("[[trials]]\nactivations = [0, 0, 0, 0, 0, 0]\n", "posture"),
        ("[study]\npostures = 7\n", "wrong kind|postures"),
        ("[trials\n", "no TOML file"),
    ],
)
def test_a_protocol_that_cannot_be_run_is_refused_in_one_line(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "protocol.toml"
    path.write_text(text)
    with pytest.raises(MisfitError, match=words) as caught:
        read_protocol(str(path))
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)


def test_a_protocol_that_does_not_exist_is_named() -> None:
    with pytest.raises(MisfitError, match="nowhere.toml cannot be read"):
        read_protocol("nowhere.toml")


# --- movements and phases

POSTURE = st.lists(st.floats(-2.0, 2.0), min_size=3, max_size=3).map(np.array)


@given(POSTURE, POSTURE, st.floats(0.1, 2.0))
def test_a_movement_ends_where_it_should_and_is_never_too_fast(
    start: np.ndarray, end: np.ndarray, speed: float
) -> None:
    movement = Movement(start, end, speed)
    times = np.linspace(0.0, movement.seconds, 101)
    rates = np.array([movement.at(t)[1] for t in times])
    assert movement.at(0.0)[0] == pytest.approx(start)
    assert movement.at(movement.seconds)[0] == pytest.approx(end)
    assert np.max(np.abs(rates)) <= speed * (1 + 1e-9)
    assert PEAK * np.max(np.abs(end - start)) <= speed * movement.seconds * (1 + 1e-9)


def test_speeds_of_a_movement_are_the_slopes_of_its_angles() -> None:
    movement = Movement(np.zeros(3), np.array([0.3, -0.7, 1.0]), 0.5)
    for t in (0.3, 1.0, 2.5):
        slope = (movement.at(t + 1e-6)[0] - movement.at(t - 1e-6)[0]) / 2e-6
        assert movement.at(t)[1] == pytest.approx(slope, abs=1e-6)


def phases_of(protocol: Protocol, confirm_at: float = 0.0) -> list[tuple[float, int, Phase]]:
    course, found = Course(protocol, Placement()), []
    q = np.array([0.0, 0.1, 1.0])
    for k in range(4000):
        now = 0.01 * k
        course.advance(now, q, confirm=confirm_at > 0 and now >= confirm_at)
        if not found or found[-1][1:] != (course.trial, course.phase):
            found.append((now, course.trial, course.phase))
        if course.phase is Phase.DONE:
            break
    return found


TWO = Protocol(trials=(Trial((0.7, 1.3), (0.1,) * 6),) * 2, confirm=False)


def test_a_trial_moves_settles_announces_stimulates_and_returns() -> None:
    found = phases_of(TWO)
    one = [Phase.MOVE, Phase.SETTLE, Phase.ANNOUNCE, Phase.STIMULATE, Phase.RETURN]
    assert [(trial, phase) for _, trial, phase in found] == [
        *((1, phase) for phase in one),
        *((2, phase) for phase in one),
        (2, Phase.DONE),
    ]
    times = {(trial, phase): at for at, trial, phase in found}
    assert times[1, Phase.RETURN] - times[1, Phase.STIMULATE] == pytest.approx(2.0, abs=0.011)
    assert times[1, Phase.STIMULATE] - times[1, Phase.ANNOUNCE] == pytest.approx(1.0, abs=0.011)


def test_without_the_operators_word_no_stimulation_begins() -> None:
    asking = replace(TWO, confirm=True)
    assert all(phase is not Phase.STIMULATE for _, _, phase in phases_of(asking))
    found = phases_of(asking, confirm_at=20.0)
    assert next(at for at, _, phase in found if phase is Phase.STIMULATE) == pytest.approx(20.0, abs=0.011)


def test_activations_rise_stay_and_fall() -> None:
    course = Course(replace(TWO, rise_s=0.5), Placement())
    course.phase, course.began = Phase.STIMULATE, 10.0
    shares = [course.activations(10.0 + t)[0] / 0.1 for t in (0.0, 0.25, 0.5, 1.0, 1.5, 1.75, 2.0, 2.1)]
    assert shares == pytest.approx([0.0, 0.5, 1.0, 1.0, 1.0, 0.5, 0.0, 0.0])
    course.phase = Phase.ANNOUNCE
    assert not course.activations(11.0).any()


# --- a session on the virtual robot, in virtual time


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Session:
    return run_trials(tmp_path_factory.mktemp("trials") / "session", some_trials(2), rate_hz=250.0, keep=True)


def test_a_session_runs_all_its_trials_without_a_fault(session: Session) -> None:
    assert session.summary.faults == []
    assert session.summary.frames_lost == 0
    assert session.controller.is_done


def test_a_session_of_trials_replays_bit_for_bit(session: Session) -> None:
    found = replay_session(session.folder)
    assert found.cycles == session.summary.cycles + 1
    assert found.first_different is None


def test_a_recorded_session_is_a_measurement_set_of_its_trials(session: Session) -> None:
    measured = load_measurements(session.folder)
    assert len(measured.trials) == 2
    table = pq.read_table(session.folder / "trial_01.parquet")
    times = table["time"].to_numpy()
    assert times[0] == 0.0
    assert times[-1] == pytest.approx(2.0, abs=0.02)
    pattern = session.controller.course.protocol.trials[0].activations
    middle = len(times) // 2
    assert [table[f"alpha_{k}"].to_numpy()[middle] for k in range(1, 7)] == pytest.approx(pattern)


def test_the_robot_makes_the_torque_of_the_muscles(session: Session) -> None:
    table = pq.read_table(session.folder / "signals.parquet")
    stimulated = table["phase"].to_numpy() == Phase.STIMULATE
    for joint, muscle in ((2, 1), (3, 2)):
        sent = table[f"tau{joint}"].to_numpy()[stimulated]
        assert sent == pytest.approx(table[f"muscle_tau{muscle}"].to_numpy()[stimulated], abs=1e-9)
        assert np.ptp(sent) > 0.5


def test_the_caregivers_push_balances_the_muscles_at_rest(session: Session) -> None:
    """Halfway through a stimulation the arm stands nearly still: J' f = -tau, within what its motion takes."""
    table = pq.read_table(session.folder / "trial_02.parquet")
    chosen = slice(len(table) // 3, 2 * len(table) // 3)
    q, f, tau = (
        np.array([table[f"{name}{k}"].to_numpy()[chosen].mean() for k in ends])
        for name, ends in (("q", "12"), ("f", "xy"), ("muscle_tau", "12"))
    )
    pull = session.controller.anatomy.jacobian(q).T @ f
    assert np.max(np.abs(tau)) > 3.0
    assert pull == pytest.approx(-tau, abs=0.25)


def test_what_was_learned_during_the_session_explains_its_residual(session: Session) -> None:
    shown = np.array([decision.shown for decision in session.decisions])
    names = [signal.name for signal in session.controller.signals]
    later = (shown[:, names.index("trial")] == 2) & (shown[:, names.index("phase")] == Phase.STIMULATE)
    residual, learned = shown[later, names.index("residual2")], shown[later, names.index("learned2")]
    assert np.std(residual - learned) < 0.6 * np.std(residual)


@pytest.fixture(scope="module")
def lossy(tmp_path_factory: pytest.TempPathFactory) -> Session:
    """The same session, but that every 41st position of a motor is lost, and the core cuts torques each time."""
    answers = count()

    def lose(timed: Timed) -> list[Timed]:
        position = timed.frame.identifier == answer_of(2, Group.POSITIONS)
        return [] if position and next(answers) % 41 == 40 else [timed]

    folder = tmp_path_factory.mktemp("lossy") / "session"
    return run_trials(folder, some_trials(2), rate_hz=250.0, faults=Faults(towards_host=[lose]))


def test_torques_lost_below_the_breakaway_are_noticed_by_the_model_of_the_arm(tmp_path: Path) -> None:
    """Muscles ask for 2.7 N.m at most, less than moves a joint for certain, and from the stimulation on no torque arrives."""
    arrived: list[float] = []

    def lose(timed: Timed) -> list[Timed]:
        if timed.frame.identifier != TORQUES or (arrived and timed.time_ns > arrived[0] + 7.1e9):
            return [] if timed.frame.identifier == TORQUES else [timed]
        arrived.append(timed.time_ns)
        return [timed]

    protocol = replace(some_trials(1), strength=(0.7,) * 6)
    lost = run_trials(tmp_path / "session", protocol, 100.0, keep=True, faults=Faults(towards_robot=[lose]))
    assert "model_explains: for 150 ms joint 3 has moved as if more than 1.5 N.m acted on it" in lost.summary.faults[0]
    asked = np.array([decision.asked for decision in lost.decisions])
    stopped = next(k for k, decision in enumerate(lost.decisions) if decision.outcome.trips)
    assert 2.0 < np.abs(asked[:stopped, 2]).max() < 3.0  # never beyond its breakaway
    assert stopped < 7.8 * 100.0


def test_a_trial_with_lost_answers_is_recorded_whole(lossy: Session) -> None:
    assert lossy.summary.faults == []
    assert lossy.summary.frames_lost > 80
    for path in sorted(lossy.folder.glob("trial_*.parquet")):
        table = pq.read_table(path)
        assert table["time"].to_numpy()[-1] == pytest.approx(2.0, abs=0.02)
        # The arm is never faster than 3 rad/s, and a lost angle is not simply that of 4 ms before.
        steps = np.diff(table["q2"].to_numpy())
        assert np.max(np.abs(np.diff(steps))) < 1e-3
    assert len(load_measurements(lossy.folder).trials) == 2


def _unbalanced(folder: Path, forces: np.ndarray, trial: int) -> float:
    """RMS in N.m of what the momentum of windows of 0.1 s changes by, beyond what `forces`, muscles and hidden friction do."""
    table, body = pq.read_table(folder / f"trial_{trial:02d}.parquet"), anatomy()
    times = table["time"].to_numpy()
    q, muscles = (np.column_stack([table[f"{name}{k}"].to_numpy() for k in (1, 2)]) for name in ("q", "muscle_tau"))
    w = np.gradient(q, times, axis=0)
    friction = -np.array([0.0, FRICTION]) * w
    rate = np.array(
        [
            body.expected_rate(q[k], w[k], muscles[k - 1] + body.jacobian(q[k]).T @ forces[k - 1]) + friction[k]
            for k in range(1, len(q))
        ]
    )
    momentum = np.array([body.mass_matrix(each) @ speed for each, speed in zip(q, w, strict=True)])
    ends = np.arange(0, len(q), 25)
    given = [np.diff(times)[a:b] @ rate[a:b] for a, b in pairwise(ends)]
    return float(np.sqrt(np.mean(np.square((np.diff(momentum[ends], axis=0) - given) / 0.1))))


def test_torques_that_the_core_has_cut_stand_in_the_trials_forces(session: Session, lossy: Session) -> None:
    def recorded(of: Session, trial: int) -> np.ndarray:
        table = pq.read_table(of.folder / f"trial_{trial:02d}.parquet")
        return np.column_stack([table["fx"].to_numpy(), table["fy"].to_numpy()])

    signals = pq.read_table(lossy.folder / "signals.parquet")
    felt = (signals["phase"].to_numpy() == Phase.STIMULATE) & (signals["trial"].to_numpy() == 2)
    sensed = np.column_stack([signals["pull1"].to_numpy()[felt], signals["pull2"].to_numpy()[felt]])
    whole = _unbalanced(session.folder, recorded(session, 2), 2)
    # Each loss leaves two cycles of 4 ms without an angle: its own, and the quiet one in which a late answer would show itself.
    assert _unbalanced(lossy.folder, recorded(lossy, 2), 2) < 1.4 * whole
    assert _unbalanced(lossy.folder, sensed, 2) > 1.5 * whole


def test_torques_of_a_cycle_are_weighed_with_the_time_in_which_they_act() -> None:
    """Sent 1 ms after the middle of 2 ms before and after, 2 N.m follow 6 N.m for 3 of 4 ms: a mean of 5 N.m."""
    torques = np.array([[6.0, 0.0], [2.0, 1.0], [2.0, 1.0], [0.0, 0.0]])
    times, took = 0.004 * np.arange(4.0), np.array([0.0, 0.001, 0.002, 0.003])
    found = acted(middles(times), times, torques, took)
    assert found == pytest.approx(np.array([[6.0, 0.0], [5.0, 0.25], [2.0, 1.0], [2.0, 1.0]]))


def test_a_late_cycle_lets_the_torque_before_it_act_for_longer() -> None:
    """6 N.m from 1 ms on, 2 N.m from 12 ms on: (6 + 3 * 2)/4 N.m from 11 to 15 ms, and 6 N.m from 4 to 11 ms."""
    times, torques, took = (
        np.array([0.0, 0.004, 0.011, 0.015]),
        np.array([[6.0], [6.0], [2.0], [2.0]]),
        np.full(4, 0.001),
    )
    assert acted(times, times, torques, took)[:, 0] == pytest.approx([6.0, 6.0, 3.0])


@given(
    arrays(float, (5, 2), elements=st.floats(-3.0, 3.0)),
    arrays(float, (5, 2), elements=st.floats(-20.0, 20.0)),
)
def test_a_push_does_to_the_arm_what_the_torques_do_unless_the_arm_is_straight(
    q: np.ndarray, torque: np.ndarray
) -> None:
    for angles, wanted, force in zip(q, torque, pushes(q, torque), strict=True):
        if abs(np.sin(angles[1])) > STRAIGHT:
            assert anatomy().jacobian(angles).T @ force == pytest.approx(wanted, abs=1e-9)
        else:
            assert np.isnan(force).all() if np.max(np.abs(wanted)) > CUT else not force.any()
