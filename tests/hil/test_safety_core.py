"""The safety core: nothing passes that should not, every rule is needed, and what stops the arm stays."""

import math
import re
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fmus.errors import MisfitError
from hil.record import replaced
from hil.safety.core import begin, step
from hil.safety.cycle import Module, Motion, Reaction, Seen
from hil.safety.limiters import LIMITERS, braking_only, inwards_only, pinch_torque, torque_rate
from hil.safety.limits import MIN_RAMP_S, JointLimits, Limits, Zone, lowered
from hil.safety.motion import follow
from hil.safety.rules import RULES
from tests.hil.cycles import FIRST, JOINT, LIMITS, PERIOD, PERIOD_S, SECOND, Arm

# --- what always holds

NUMBER = st.floats(allow_nan=True, allow_infinity=True)
ANY_VECTOR = st.lists(NUMBER, min_size=2, max_size=2).map(tuple) | st.lists(NUMBER, max_size=4).map(tuple)
POSITION = st.none() | st.floats(-1.3, 1.3) | NUMBER
ADVERSARIAL = st.fixed_dictionaries(
    {
        "passed": st.sampled_from([PERIOD, PERIOD, PERIOD, 0, -PERIOD, 3 * PERIOD, 10**9, 1]),
        "positions": st.lists(POSITION, min_size=2, max_size=2).map(tuple) | st.lists(POSITION, max_size=3).map(tuple),
        "asked": ANY_VECTOR,
        "support": ANY_VECTOR,
        "computing_ns": st.sampled_from([0, PERIOD, 10**9]),
        "force": st.none() | st.lists(NUMBER, min_size=3, max_size=3).map(tuple),
        "force_saturated": st.booleans(),
        "temperatures": st.lists(st.none() | NUMBER, max_size=3).map(tuple),
        "unmodelled": st.none() | ANY_VECTOR,
        "module": st.none() | st.sampled_from(Module),
        "warning": st.sampled_from(["", "torque"]),
        "fault": st.sampled_from(["", "velocity"]),
        "foreign_torque": st.booleans(),
        "recording": st.booleans(),
        "watched": st.booleans(),
        "abort": st.booleans(),
        "end": st.booleans(),
        "arm": st.booleans(),
    }
)
CALM_MOSTLY = st.lists(
    st.one_of(
        ADVERSARIAL,
        st.fixed_dictionaries({"arm": st.just(True)}),
        st.fixed_dictionaries({"asked": st.lists(st.floats(-50, 50), min_size=2, max_size=2).map(tuple)}),
    ),
    max_size=30,
)


@settings(max_examples=300, deadline=None)
@given(CALM_MOSTLY)
def test_no_cycle_whatever_it_shows_lets_a_torque_pass_its_limits(history: list[dict]) -> None:
    arm = Arm()
    arm.cycle(arm=True)
    last = (0.0, 0.0)
    for seen in history:
        seen = dict(seen)
        time_ns = arm.now + seen.pop("passed", PERIOD)
        outcome = arm.cycle(time_ns=time_ns, **seen)
        if outcome.torques is None:
            assert outcome.reaction is Reaction.SILENCE
            last = (0.0, 0.0)
            continue
        for joint, before, torque in zip(LIMITS.joints, last, outcome.torques, strict=True):
            assert abs(torque) <= joint.torque
            grown = abs(torque) - abs(before) if torque * before >= 0 else abs(torque)
            assert grown <= joint.torque_rate * PERIOD_S * (1 + 1e-12)
        assert outcome.reaction < Reaction.RELEASE or outcome.torques == (0.0, 0.0)
        last = outcome.torques


@settings(max_examples=100, deadline=None)
@given(CALM_MOSTLY)
def test_the_same_cycles_always_give_the_same_outcomes(history: list[dict]) -> None:
    def run() -> list:
        arm = Arm()
        for seen in history:
            seen = dict(seen)
            arm.cycle(time_ns=arm.now + seen.pop("passed", PERIOD), **seen)
        return arm.outcomes

    assert repr(run()) == repr(run())  # NaN differs from itself, its name does not


@settings(max_examples=100, deadline=None)
@given(CALM_MOSTLY)
def test_what_stopped_the_arm_stays_until_it_is_armed_anew(history: list[dict]) -> None:
    arm = Arm().armed()
    worst = Reaction.PASS
    for seen in history:
        seen = dict(seen) | {"arm": False}
        outcome = arm.cycle(time_ns=arm.now + seen.pop("passed", PERIOD), **seen)
        assert worst < Reaction.COMPLY or outcome.reaction >= worst
        worst = max(worst, outcome.reaction)


# --- arming


def test_nothing_is_energised_before_the_arm_is_armed() -> None:
    outcome = Arm().cycles(100, asked=(5.0, 5.0), support=(2.0, 2.0))
    assert outcome.torques == (0.0, 0.0)
    assert not outcome.to_idle


def test_the_controller_gets_its_torque_only_along_the_ramp() -> None:
    arm = Arm()
    arm.cycle(arm=True, asked=(4.0, 0.0))
    half = arm.cycles(25, asked=(4.0, 0.0))
    whole = arm.cycles(40, asked=(4.0, 0.0))
    assert half.torques == pytest.approx((2.0, 0.0))
    assert whole.torques == (4.0, 0.0)


@pytest.mark.parametrize(
    "seen",
    [
        {"abort": True},
        {"module": Module.IDLE},
        {"module": Module.ESTOP},
        {"module": None},
        {"positions": (0.0, None)},
        {"force": (100.0, 0.0, 0.0)},
        {"warning": "torque"},
    ],
)
def test_an_arm_with_something_wrong_cannot_be_armed(seen: dict) -> None:
    arm = Arm()
    arm.cycle(arm=True, **seen)
    assert arm.state.armed_ns is None
    assert arm.cycle(asked=(5.0, 5.0)).torques in ((0.0, 0.0), None)


def test_arming_anew_forgets_what_was_stored() -> None:
    arm = Arm().armed()
    arm.cycle(asked=(5.0, 0.0))
    arm.cycles(3, abort=True, asked=(5.0, 0.0))
    assert arm.cycle().reaction is Reaction.COMPLY
    outcome = arm.cycle(arm=True, asked=(5.0, 0.0))
    assert outcome.reaction is Reaction.PASS
    assert outcome.torques == (0.0, 0.0)
    assert (arm.state.fading, arm.state.stopped, arm.state.energy) == (1.0, None, 0.0)


# --- each rule: a hazard that it stops, and that nothing else would

Drive = Callable[[Arm], None]


def _throw(arm: Arm, speed: float, cycles: int = 120) -> None:
    for k in range(1, cycles):
        arm.cycle(positions=(speed * k * PERIOD_S, 0.0))


def _give(arm: Arm) -> None:
    """Push with 8 N.m along a motion of 0.8 rad/s: 6.4 W."""
    for k in range(60):
        arm.cycle(positions=(0.8 * k * PERIOD_S, 0.0), asked=(8.0, 0.0))


def _oscillate(arm: Arm) -> None:
    for k in range(60):
        arm.cycle(asked=(8.0 * (-1) ** (k // 4), 0.0))


def _late(count: int) -> Drive:
    def drive(arm: Arm) -> None:
        for _ in range(count):
            arm.cycle(time_ns=arm.now + 2 * PERIOD)

    return drive


HAZARDS: list[tuple[str, Drive, Reaction]] = [
    ("finite_command", lambda arm: arm.cycle(asked=(math.nan, 0.0)), Reaction.SUPPORT),
    ("finite_command", lambda arm: arm.cycle(asked=(0.0, -math.inf)), Reaction.SUPPORT),
    ("finite_command", lambda arm: arm.cycle(support=(math.nan, 0.0)), Reaction.RELEASE),
    ("finite_command", lambda arm: arm.cycle(asked=(0.0,)), Reaction.RELEASE),
    ("finite_command", lambda arm: arm.cycle(support=(0.0, 0.0, 0.0)), Reaction.RELEASE),
    ("positions_answered", lambda arm: arm.cycle(positions=(None, 0.0)), Reaction.REDUCE),
    ("positions_answered", lambda arm: arm.cycles(2, positions=(0.0, None)), Reaction.REDUCE),
    ("positions_answered", lambda arm: arm.cycles(3, positions=(0.0, None)), Reaction.COMPLY),
    ("positions_answered", lambda arm: arm.cycles(14, positions=(None, None)), Reaction.COMPLY),
    ("positions_answered", lambda arm: arm.cycles(15, positions=(None, None)), Reaction.RELEASE),
    ("encoder_steady", lambda arm: arm.cycles(2, positions=(0.5, 0.0)), Reaction.COMPLY),
    ("positions_answered", lambda arm: arm.cycles(3, positions=(math.nan, 0.0)), Reaction.COMPLY),
    ("positions_answered", lambda arm: arm.cycles(3, positions=(0.0,)), Reaction.COMPLY),
    ("encoder_alive", lambda arm: arm.cycles(25, positions=(0.0, 0.0), asked=(3.5, 0.0)), Reaction.COMPLY),
    ("on_time", lambda arm: arm.cycle(time_ns=arm.now), Reaction.SUPPORT),
    ("on_time", lambda arm: arm.cycle(time_ns=arm.now - PERIOD), Reaction.SUPPORT),
    ("on_time", lambda arm: arm.cycle(time_ns=arm.now + 16 * PERIOD), Reaction.RELEASE),
    ("on_time", _late(2), Reaction.REDUCE),
    ("on_time", _late(8), Reaction.COMPLY),
    ("on_time", lambda arm: arm.cycles(15, computing_ns=PERIOD), Reaction.COMPLY),
    ("speed_limited", lambda arm: _throw(arm, 1.5), Reaction.COMPLY),
    ("speed_limited", lambda arm: _throw(arm, -3.0), Reaction.RELEASE),
    ("inside_range", lambda arm: [_creep(arm, q) for q in (1.05, 1.11)], Reaction.COMPLY),
    ("inside_range", lambda arm: [_creep(arm, q) for q in (-1.05, -1.11)], Reaction.COMPLY),
    ("energy_bounded", _give, Reaction.COMPLY),
    ("force_bounded", lambda arm: arm.cycle(force=(60.0, 60.0, 0.0)), Reaction.COMPLY),
    ("force_bounded", lambda arm: arm.cycle(force=(math.nan, 0.0, 0.0)), Reaction.COMPLY),
    ("force_bounded", lambda arm: arm.cycle(force=(1.0, 0.0, 0.0), force_saturated=True), Reaction.COMPLY),
    ("force_bounded", lambda arm: arm.cycles(25, force=(1.0, 2.0, 3.0)), Reaction.COMPLY),
    ("cool", lambda arm: arm.cycle(temperatures=(20.0, 60.0)), Reaction.REDUCE),
    ("cool", lambda arm: arm.cycle(temperatures=(75.0, None)), Reaction.COMPLY),
    ("cool", lambda arm: _overload(arm, 6.0, 450), Reaction.REDUCE),
    ("cool", lambda arm: _overload(arm, 6.0, 600), Reaction.COMPLY),
    ("encoder_alive", lambda arm: _halt(arm, 0.5), Reaction.COMPLY),
    ("torque_acts", lambda arm: _unheard(arm, 20), Reaction.RELEASE),
    ("motion_explained", lambda arm: _runaway(arm, 0.7), Reaction.RELEASE),
    ("force_bounded", lambda arm: arm.cycle(force=(0.0, 0.0, 1.0), force_missing_ns=51_000_000), Reaction.COMPLY),
    ("force_bounded", lambda arm: arm.cycle(sensor=False), Reaction.RELEASE),
    ("module_agrees", lambda arm: arm.cycle(module=Module.ABSENT), Reaction.RELEASE),
    ("unpinched", lambda arm: _press(arm, 60), Reaction.COMPLY),
    ("model_explains", lambda arm: _disagree(arm, (0.0, -1.51)), Reaction.COMPLY),
    ("model_explains", lambda arm: _disagree(arm, (math.nan, 0.0)), Reaction.COMPLY),
    ("model_explains", lambda arm: _disagree(arm, (0.0,)), Reaction.COMPLY),
    ("calm", _oscillate, Reaction.COMPLY),
    ("module_agrees", lambda arm: arm.cycle(module=None), Reaction.RELEASE),
    ("module_agrees", lambda arm: arm.cycle(module=Module.ESTOP), Reaction.SILENCE),
    ("module_agrees", lambda arm: arm.cycle(module=Module.IDLE), Reaction.RELEASE),
    ("module_agrees", lambda arm: arm.cycle(fault="torque"), Reaction.RELEASE),
    ("module_agrees", lambda arm: arm.cycle(warning="torque"), Reaction.REDUCE),
    ("drives_ready", lambda arm: arm.cycle(trouble="drive 2 has a fault"), Reaction.RELEASE),
    ("alone_on_the_bus", lambda arm: arm.cycle(foreign_torque=True), Reaction.RELEASE),
    ("watched", lambda arm: arm.cycle(watched=False), Reaction.RELEASE),
    ("recorded", lambda arm: arm.cycle(recording=False), Reaction.COMPLY),
    ("not_ended", lambda arm: arm.cycle(end=True), Reaction.RELEASE),
    ("not_aborted", lambda arm: arm.cycle(abort=True), Reaction.COMPLY),
]


def _overload(arm: Arm, torque: float, cycles: int) -> None:
    """Hold against a load that the first motor does not bear for ever: 6 N.m instead of 5, for a second."""
    for k in range(cycles):
        arm.cycle(positions=(1e-6 * (k % 2), 0.0), support=(torque, 0.0))


def _halt(arm: Arm, speed: float) -> None:
    """Move, and then be told exactly the same for 4 ms."""
    for k in range(60):
        arm.cycle(positions=(speed * k * PERIOD_S, 0.0))
    arm.cycles(3, positions=(speed * 59 * PERIOD_S, 0.0))


def _disagree(arm: Arm, torques: tuple[float, ...]) -> None:
    """A model leaves so much unexplained for 20 ms."""
    arm.limits = replace(LIMITS, effect_s=0.02)
    arm.cycles(11, unmodelled=torques)


def _runaway(arm: Arm, speed: float) -> None:
    """Move by itself, with a torque that brakes."""
    arm.limits = replace(LIMITS, unexplained=0.5)
    for k in range(1, 60):
        arm.cycle(positions=(speed * k * PERIOD_S, 0.0), asked=(-1.0, 0.0))


def _unheard(arm: Arm, cycles: int) -> None:
    """Ask for 4 N.m, where more than 3 N.m move the joint for certain, while it stands still."""
    arm.limits = replace(LIMITS, effect_s=0.03)
    for k in range(cycles):
        arm.cycle(positions=(1e-6 * (k % 2), 0.0), asked=(4.0, 0.0))


def _press(arm: Arm, cycles: int) -> None:
    """Press into the zone of the second joint with more than is allowed there."""
    _creep(arm, 0.85, joint=1)
    for k in range(cycles):
        arm.cycle(positions=(0.0, 0.85 + 1e-6 * (k % 2)), support=(0.0, 3.0))


def _creep(arm: Arm, position: float, joint: int = 0) -> None:
    """Bring a joint to a position slowly."""
    start = arm.state.motion.positions[joint]
    for k in range(1, 801):
        here = [0.0, 0.0]
        here[joint] = start + (position - start) * k / 800
        arm.cycle(positions=tuple(here))


@pytest.mark.parametrize(("rule", "drive", "reaction"), HAZARDS)
def test_a_hazard_meets_the_reaction_of_its_rule(rule: str, drive: Drive, reaction: Reaction) -> None:
    arm = Arm().armed()
    drive(arm)
    reached = max(outcome.reaction for outcome in arm.outcomes)
    assert reached is reaction
    tripped = {trip.rule for outcome in arm.outcomes for trip in outcome.trips}
    assert rule in tripped
    if reaction >= Reaction.COMPLY:
        assert arm.state.stopped is not None
        assert arm.state.stopped.rule == rule
        assert arm.state.stopped.words


@pytest.mark.parametrize(("torque", "breakaway"), [(4.0, 3.0), (-4.0, 3.0), (0.8, 0.5), (-0.8, 0.5)])
def test_a_joint_that_follows_its_torque_either_way_is_not_said_to_be_blocked(torque: float, breakaway: float) -> None:
    arm = Arm().armed()
    arm.limits = replace(LIMITS, effect_s=0.03, joints=(replace(FIRST, breakaway=breakaway), SECOND))
    for k in range(60):
        arm.cycle(positions=(math.copysign(0.3, torque) * k * PERIOD_S, 0.0), asked=(torque, 0.0))
    assert arm.state.stopped is None


@pytest.mark.parametrize(
    ("torque", "newton", "stops"), [(3.0, 0.0, False), (3.01, 0.0, True), (4.0, 1.3, False), (4.0, 1.2, True)]
)
def test_a_joint_that_stands_is_blocked_if_its_torque_is_more_than_breakaway_and_the_force_at_the_wrist_hold(
    torque: float, newton: float, stops: bool
) -> None:
    # 3 N.m move the joint for certain; 1.25 N at 0.8 m hold 1 N.m.
    arm = Arm().armed()
    for k in range(100):
        arm.limits = replace(LIMITS, effect_s=0.03, frozen_s=1.0)
        arm.cycle(positions=(1e-6 * (k % 2), 0.0), asked=(torque, 0.0), force=(newton, 0.0, 1e-6 * (k % 2)))
    assert (arm.state.stopped is not None) == stops


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_joint_that_creeps_slower_than_at_rest_under_its_torque_is_said_to_be_blocked(way: float) -> None:
    arm = Arm().armed()
    for k in range(60):  # not from zero on
        arm.cycle(positions=(way * 0.5 * k * PERIOD_S, 0.0))
    start = way * 0.5 * 59 * PERIOD_S
    arm.limits = replace(LIMITS, effect_s=0.03)
    for k in range(60):
        arm.cycle(positions=(start + way * 0.015 * k * PERIOD_S, 0.0), asked=(way * 4.0, 0.0))
    assert arm.state.stopped is not None and arm.state.stopped.rule == "torque_acts"


def test_the_torque_of_who_takes_over_comes_up_along_the_ramp_again() -> None:
    arm = Arm().armed()
    # In small steps: what a cycle may add is no limit here.
    for k in range(60):
        arm.cycle(asked=(2.0, 0.0), positions=(1e-6 * (k % 2), 0.0))
    before = arm.state.active[0]
    arm.cycle(asked=(2.0, 0.0), controller=1)
    assert before == pytest.approx(2.0) and arm.state.active[0] == 0.0
    arm.cycle(asked=(2.0, 0.0), controller=1)
    assert arm.state.active[0] == pytest.approx(2.0 * PERIOD_S / LIMITS.ramp_s)


def test_a_motion_that_is_known_already_decides_as_one_that_is_found_anew() -> None:
    arm = Arm().armed()
    shown = arm.calm(positions=(0.001, 0.0), asked=(1.0, 0.0))
    motion = follow(arm.limits, arm.state, shown.time_ns, shown.positions, shown.doubted)
    assert step(arm.limits, arm.state, shown, motion=motion) == step(arm.limits, arm.state, shown)


def test_lowered_limits_are_a_share_of_torques_rates_speeds_power_and_energy_and_the_rest_stays() -> None:
    limits = replace(LIMITS, joints=(replace(FIRST, speed=2.0), SECOND))
    less = lowered(limits, 0.25)
    for joint, usual in zip(less.joints, limits.joints, strict=True):
        lowered_parts = {name: 0.25 * getattr(usual, name) for name in ("torque", "torque_rate", "speed")}
        assert joint == replace(usual, **lowered_parts)
    assert less == replace(LIMITS, joints=less.joints, power=0.25 * LIMITS.power, energy=0.25 * LIMITS.energy)
    assert lowered(LIMITS).power == 0.5 * LIMITS.power


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_torque_that_slows_a_joint_down_acts_although_the_joint_still_moves_against_it(way: float) -> None:
    arm = Arm().armed()
    position, speed = 0.0, -0.4
    for _ in range(20):
        position += way * speed * PERIOD_S
        arm.cycle(positions=(position, 0.0))
    arm.limits = replace(LIMITS, effect_s=0.03)
    for _ in range(30):
        speed += 0.012
        position += way * speed * PERIOD_S
        arm.cycle(positions=(position, 0.0), asked=(way * 4.0, 0.0))
    assert arm.state.stopped is None


def test_what_is_said_of_an_encoder_is_said_of_this_cycle_alone() -> None:
    arm = Arm().armed()
    for shown, jumps, jumped in (
        ((0.001, 0.0), (0, 0), (0.0, 0.0)),
        ((0.9, 0.0), (1, 0), (0.899, 0.0)),
        ((0.9, None), (2, 0), (0.899, 0.0)),
        ((0.001, 0.0), (0, 0), (0.0, 0.0)),
    ):
        motion = follow(arm.limits, arm.state, arm.now + PERIOD, shown, ())
        assert (motion.jumps, motion.jumped) == (jumps, pytest.approx(jumped))
        missing = tuple(k for k, gap in enumerate(motion.missing) if gap)
        assert all(motion.halted[k] == 0.0 and motion.still[k] == 0 for k in missing)
        arm.state = replaced(arm.state, motion=motion, time_ns=arm.now + PERIOD)


def test_an_encoder_that_stops_keeps_the_speed_from_which_it_did_until_it_moves_again() -> None:
    arm = Arm().armed()
    _throw(arm, 0.5, 40)
    moving = arm.state.motion
    assert moving.halted[0] == 0.0 and moving.speeds[0] > 0.4
    for cycle in (1, 2, 3):
        arm.cycle(positions=moving.positions)
        assert arm.state.motion.halted[0] == moving.speeds[0]
        assert arm.state.motion.still[0] == cycle * PERIOD
    arm.cycle(positions=(moving.positions[0] + 1e-6, 0.0))
    assert arm.state.motion.halted[0] == 0.0


@pytest.mark.parametrize(("newton", "rule"), [(0.6, "motion_explained"), (0.65, None)])
def test_a_force_explains_motion_if_it_is_more_than_the_noise_of_its_sensor(newton: float, rule: str | None) -> None:
    # 0.5 N.m are the noise: at the reach of 0.8 m they are 0.625 N.
    arm = Arm().armed()
    arm.limits = replace(LIMITS, unexplained=0.5)
    for k in range(1, 60):
        arm.cycle(positions=(0.7 * k * PERIOD_S, 0.0), asked=(-1.0, 0.0), force=(newton, 0.0, 1e-6 * (k % 2)))
    stopped = arm.state.stopped
    assert (None if stopped is None else stopped.rule) == rule


@pytest.mark.parametrize(
    ("torque", "newton", "calm"),
    [(0.06, 0.0, 0.3), (0.05, 0.0, 0.01), (0.04, 0.0, 0.01), (-0.06, 0.0, 0.01), (0.0, 0.63, 0.3), (0.0, 0.625, 0.01)],
)
def test_a_speed_is_calm_that_something_pushes_along_and_else_follows_a_slow_drift(
    torque: float, newton: float, calm: float
) -> None:
    # Ten times 0.5 rad/s in a second are 0.01 rad/s in 2 ms.
    arm = Arm(replace(LIMITS, unexplained=0.5)).armed()
    state = replaced(arm.state, active=(torque, 0.0), calm_speed=(0.0, 0.0))
    motion = replaced(state.motion, seconds=PERIOD_S, speeds=(0.3, 0.0))
    after, _ = step(arm.limits, state, arm.calm(force=(newton, 0.0, 0.0)), motion=motion)
    assert after.calm_speed == pytest.approx((calm, 0.0))


def test_a_joint_that_trembles_under_its_torque_has_not_followed_it() -> None:
    arm = Arm(replace(LIMITS, effect_s=0.03)).armed()
    pressed = []
    for k in range(12):  # a step of 0.38 mrad is 0.05 rad/s behind the low pass
        arm.cycle(positions=(3.8e-4 * (k > 5) + 1e-6 * (k % 2), 0.0), asked=(4.0, 0.0))
        pressed.append(arm.state.pressed[0])
    assert pressed[2:] == [pressed[1] + PERIOD * k for k in range(1, 11)] and pressed[1] > 0


def test_a_torque_has_to_move_a_joint_from_where_and_how_fast_it_was_when_it_began() -> None:
    # Gone is 0.02 rad/s for 30 ms; 3 N.m, which move the joint for certain, do not count.
    arm = Arm(replace(LIMITS, effect_s=0.03)).armed()
    for torque, pressed, speed, position, expected in (
        (4.0, 0, 0.2, 0.1, (PERIOD, 0.2, 0.1)),
        (4.0, PERIOD, 0.05, 5e-4, (2 * PERIOD, 0.0, 0.0)),
        (4.0, PERIOD, 0.0, 7e-4, (0, 0.0, 0.0)),
        (-4.0, PERIOD, 0.2, 7e-4, (2 * PERIOD, 0.0, 0.0)),
        (3.0, PERIOD, 0.0, 0.0, (0, 0.0, 0.0)),
    ):
        before = {"pressed": (pressed, 0), "pressed_speed": (0.0, 0.0), "pressed_from": (0.0, 0.0)}
        state = replaced(arm.state, active=(torque, 0.0), **before)
        motion = replaced(state.motion, seconds=PERIOD_S, speeds=(speed, 0.0), positions=(position, 0.0))
        after, _ = step(arm.limits, state, arm.calm(), motion=motion)
        assert (after.pressed[0], after.pressed_speed[0], after.pressed_from[0]) == expected


def test_a_session_that_stood_still_is_told_so_although_its_positions_are_missing_as_well() -> None:
    arm = Arm().armed()
    arm.cycle(time_ns=arm.now + 228_000_000, positions=(None, None))
    assert arm.state.stopped is not None and arm.state.stopped.rule == "on_time"


def test_late_cycles_are_counted_in_a_row_only() -> None:
    arm, counts = Arm().armed(), []
    for computing in (PERIOD, PERIOD, 0, PERIOD):
        arm.cycle(computing_ns=computing)
        counts.append(arm.state.late)
    assert counts == [PERIOD, 2 * PERIOD, 0, PERIOD]


def test_a_position_makes_up_for_a_quarter_of_a_missing_one() -> None:
    arm = Arm().armed()
    arm.state = replaced(arm.state, unsure=(10 * PERIOD, 0))
    arm.cycle()
    assert arm.state.unsure == (10 * PERIOD - PERIOD // 4, 0)


@pytest.mark.parametrize(("rule", "drive", "reaction"), HAZARDS)
def test_without_its_rule_a_hazard_is_not_stopped(rule: str, drive: Drive, reaction: Reaction) -> None:
    arm = Arm(rules=tuple(r for r in RULES if r.__name__ != rule)).armed()
    try:
        drive(arm)
    except IndexError:  # without the check of their number, torques no longer match the joints
        return
    assert max(outcome.reaction for outcome in arm.outcomes) < reaction


def test_every_rule_has_a_hazard() -> None:
    assert {rule.__name__ for rule in RULES} == {rule for rule, *_ in HAZARDS}


@pytest.mark.parametrize(
    "drive",
    [
        lambda arm: arm.cycles(14, computing_ns=PERIOD),
        lambda arm: arm.cycles(2, positions=(None, 0.0)),
        lambda arm: arm.cycles(19, force=(1.0, 2.0, 3.0)),
        lambda arm: arm.cycles(500, positions=(0.0, 0.0), asked=(2.9, 0.0)),
        lambda arm: arm.cycle(force=(0.0, 79.0, 0.0)),
        lambda arm: arm.cycle(temperatures=(59.0, None)),
        lambda arm: _overload(arm, 4.9, 2000),
        lambda arm: _press(arm, 25),
        lambda arm: _throw(arm, 1.2),
        lambda arm: [_creep(arm, q) for q in (1.05, 1.09)],
    ],
)
def test_what_stays_within_its_limit_does_not_stop_the_arm(drive: Drive) -> None:
    arm = Arm().armed()
    drive(arm)
    assert arm.state.stopped is None


# --- reactions


def test_while_in_doubt_half_the_torque_is_left_and_then_it_comes_back_along_the_ramp() -> None:
    arm, given = Arm().armed(), {"asked": (4.0, 0.0), "support": (2.0, 0.0)}
    # Two cycles first: in one the torque could not grow further than to what is expected then.
    assert arm.cycles(2, **given).torques == pytest.approx((6.0, 0.0))
    assert arm.cycles(3, **given, warning="torque").torques == pytest.approx((4.0, 0.0))
    step = PERIOD_S / LIMITS.ramp_s
    for k in range(1, 40):
        left = min(LIMITS.reduced + k * step, 1.0)
        assert arm.cycle(**given).torques == pytest.approx((2.0 + 4.0 * left, 0.0))


def test_doubt_on_the_ramp_neither_stops_it_nor_makes_it_steeper_but_ends_it_at_half() -> None:
    arm, step = Arm(), PERIOD_S / LIMITS.ramp_s
    arm.cycle(arm=True, asked=(2.0, 0.0))
    for k in range(1, 60):
        found = arm.cycle(asked=(2.0, 0.0), warning="torque")
        assert found.torques == pytest.approx((2.0 * min(k * step, LIMITS.reduced), 0.0))


@pytest.mark.parametrize("ramped", [0, 5, 60])
@pytest.mark.parametrize("doubted", [0, 1, 3])
def test_no_torque_grows_while_the_arm_gives_way(ramped: int, doubted: int) -> None:
    """Before it does, it may be in doubt, and its controller may have just taken over."""
    arm, asked = Arm(replace(LIMITS, ramp_s=0.1)), (2.0, -2.5)
    arm.cycle(arm=True, asked=asked)
    for k in range(ramped + doubted):
        arm.cycle(asked=asked, warning="torque" if k >= ramped else "")
    last = [abs(torque) for torque in arm.state.active]
    for _ in range(60):
        outcome = arm.cycle(asked=asked, abort=True)
        assert outcome.reaction is Reaction.COMPLY
        now = [abs(torque) for torque in arm.state.active]
        assert all(new <= old + 1e-3 for new, old in zip(now, last, strict=True))  # damping of the wiggle
        last = now
    assert last == pytest.approx([0.0, 0.0], abs=1e-3)


def test_giving_way_fades_what_was_asked_before_and_keeps_the_weight() -> None:
    arm = Arm().armed()
    arm.cycles(3, asked=(4.0, 0.0), support=(1.0, 0.0))
    half = [arm.cycle(abort=True, asked=(-9.0, 9.0), support=(1.0, 0.0)) for _ in range(25)][-1]
    end = arm.cycles(30, asked=(-9.0, 9.0), support=(1.0, 0.0))
    assert half.torques == pytest.approx((1.0 + 0.5 * 4.0, 0.0), abs=1e-3)
    assert end.torques == pytest.approx((1.0, 0.0), abs=1e-3)
    assert not end.to_idle


@pytest.mark.parametrize(("passed", "share_left"), [(PERIOD, 0.8), (2 * PERIOD, 0.6), (PERIOD // 2, 0.8)])
def test_giving_way_takes_the_time_that_passes_and_a_period_at_least_each_cycle(passed: int, share_left: float) -> None:
    arm = Arm().armed()
    assert arm.state.fading == 1.0
    for _ in range(10):
        arm.cycle(time_ns=arm.now + passed, abort=True)
    assert arm.state.reaction is Reaction.COMPLY
    assert arm.state.fading == pytest.approx(share_left)  # of a ramp of 50 periods


def test_what_is_worse_than_giving_way_leaves_nothing_of_what_was_asked() -> None:
    arm = Arm().armed()
    arm.cycle(asked=(math.nan, 0.0))
    assert (arm.state.reaction, arm.state.fading) == (Reaction.SUPPORT, 0.0)


def test_giving_way_damps_the_motion() -> None:
    arm = Arm().armed()
    arm.cycle(abort=True)
    for k in range(1, 200):
        outcome = arm.cycle(positions=(0.5 * k * PERIOD_S, 0.0))
    assert outcome.torques is not None
    assert outcome.torques[0] == pytest.approx(-LIMITS.damping * 0.5, rel=1e-3)


def test_a_failed_controller_leaves_the_weight_held_at_once() -> None:
    arm = Arm().armed()
    arm.cycles(3, asked=(4.0, 0.0), support=(1.0, 0.0))
    assert arm.cycle(asked=(math.nan, 0.0), support=(1.0, 0.0)).torques == pytest.approx((1.0, 0.0))


def test_letting_go_sends_no_torque_and_switches_the_motors_to_idle() -> None:
    outcome = Arm().armed().cycle(foreign_torque=True, asked=(4.0, 0.0), support=(1.0, 0.0))
    assert (outcome.torques, outcome.to_idle) == ((0.0, 0.0), True)


def test_after_an_emergency_stop_nothing_is_sent() -> None:
    outcome = Arm().armed().cycle(module=Module.ESTOP, support=(1.0, 0.0))
    assert (outcome.torques, outcome.to_idle) == (None, False)


def test_the_first_reason_stays_unless_a_worse_one_comes() -> None:
    arm = Arm().armed()
    arm.cycle(abort=True)
    arm.cycle(recording=False)
    assert str(arm.state.stopped) == "not_aborted: stopped by the operator"
    arm.cycle(foreign_torque=True)
    assert arm.state.stopped.rule == "alone_on_the_bus"


@pytest.mark.parametrize(
    ("support", "held"), [((math.nan, 1.0), (0.0, 1.0)), ((1.0,), (1.0, 0.0)), ((-math.inf, 2.0, 3.0), (0.0, 2.0))]
)
def test_a_weight_that_is_no_number_is_none(support: tuple[float, ...], held: tuple[float, float]) -> None:
    arm = Arm().armed()
    outcome = arm.cycle(support=support)
    assert outcome.torques == (0.0, 0.0)
    assert arm.state.active == tuple(-weight for weight in held)  # none was sent


# --- what is remembered


def _swing(arm: Arm, size: float, halves: int) -> None:
    """Let the second joint's torque change its sign every four cycles."""
    for k in range(4 * halves):
        arm.cycle(asked=(0.0, size * (-1) ** (k // 4)))


@pytest.mark.parametrize(("size", "stopped"), [(0.1, False), (4.9, False), (5.0, False), (5.1, True)])
def test_only_swings_beyond_half_the_torque_are_an_oscillation(size: float, stopped: bool) -> None:
    arm = Arm().armed()
    _swing(arm, size, 40)
    assert (arm.state.stopped is not None and arm.state.stopped.rule == "calm") == stopped


def test_a_change_of_sign_is_forgotten_after_exactly_a_second() -> None:
    arm = Arm().armed()
    _swing(arm, 6.0, 2)
    [flip] = arm.state.flips[1]
    while arm.now < flip + 10**9 - PERIOD:
        arm.cycle()
    assert arm.state.flips[1] == (flip,)
    arm.cycle()
    assert (arm.now, arm.state.flips[1]) == (flip + 10**9, ())


def test_a_change_of_sign_exactly_a_second_after_another_is_the_only_one() -> None:
    arm = Arm().armed()
    _swing(arm, 6.0, 2)
    [flip] = arm.state.flips[1]
    while arm.now < flip + 10**9 - 2 * PERIOD:
        arm.cycle(asked=(0.0, -6.0))
    arm.cycles(2, asked=(0.0, 6.0))  # by its rate the torque needs two cycles to turn round
    assert arm.state.flips[1] == (flip + 10**9,)


def test_repeated_forces_are_counted_and_forgotten() -> None:
    arm, counts = Arm().armed(), []
    for force in ((1.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 0.0, 0.0), (2.0, 0.0, 0.0), (2.0, 0.0, 0.0), None):
        arm.cycle(force=force)
        counts.append(arm.state.force_still)
    assert counts == [0, PERIOD, 2 * PERIOD, 0, PERIOD, 0]
    arm.cycle(force=(1.0, 0.0, 0.0))
    arm.cycle(time_ns=arm.now, force=(1.0, 0.0, 0.0))
    assert arm.state.force_still == 0  # in no time nothing stays the same


@pytest.mark.parametrize(
    ("torque", "speed", "counted"),
    [(2.0, 0.0, PERIOD + 5), (0.99 * 2.0, 0.0, PERIOD + 5), (1.97, 0.0, 0), (2.0, 0.02, 0)],
)
def test_the_time_is_counted_in_which_a_joint_just_presses_and_rests(torque: float, speed: float, counted: int) -> None:
    arm = Arm().armed()
    assert arm.state.pinched == begin(LIMITS, 0, (0.0, 0.0)).pinched == (0, 0)
    here = Motion(PERIOD_S, (0.0, 0.85), (0.0, speed), (0, 0), (0, 0))
    arm.state = replaced(arm.state, motion=here, pinched=(0, 5))
    arm.cycle(positions=(0.0, None), support=(0.0, torque))  # no answer: position and speed stay what they were
    assert arm.state.pinched == (0, counted)


def test_heat_follows_the_square_of_the_torque_in_its_own_time() -> None:
    arm = Arm(replace(LIMITS, thermal_s=2.0)).armed()
    arm.cycles(400, support=(4.0, 0.0))
    # h' = (0.8^2 - h)/2 s by backward Euler over 400 cycles of 2 ms
    assert arm.state.heat == pytest.approx((0.64 * (1.0 - (1.0 + PERIOD_S / 2.0) ** -400), 0.0), rel=1e-9)


@pytest.mark.parametrize(("torque", "speed", "stopped"), [(2.0, 0.0, True), (1.9, 0.0, False), (2.0, 0.05, False)])
def test_only_a_joint_that_presses_with_all_it_may_and_rests_can_pinch(
    torque: float, speed: float, stopped: bool
) -> None:
    arm = Arm().armed()
    _creep(arm, 0.85, joint=1)
    for k in range(100):
        position = 0.85 + speed * k * PERIOD_S + 1e-6 * (k % 2)
        arm.cycle(positions=(0.0, position), support=(0.0, torque if k >= 40 else 0.0))
    assert (arm.state.stopped is not None and arm.state.stopped.rule == "unpinched") == stopped


# --- limiters


def test_only_limiters_that_cut_are_named() -> None:
    arm = Arm().armed()
    assert arm.cycle(asked=(1.0, 1.0)).limited == ()
    assert arm.cycle(asked=(9.0, 1.0)).limited == ("torque_rate",)


def _moving(arm: Arm, speed: float, **seen: object) -> None:
    for k in range(1, 100):
        arm.cycle(positions=(speed * k * PERIOD_S, 0.0), **seen)


CUTS: list[tuple[str, Drive, tuple[float, float]]] = [
    ("torque", lambda arm: arm.cycles(9, asked=(25.0, -25.0)), (10.0, -10.0)),
    ("torque_rate", lambda arm: arm.cycle(asked=(9.0, -9.0)), (4.0, -4.0)),
    ("power", lambda arm: _moving(arm, 0.95, asked=(0.0, 0.0), support=(9.0, -9.0)), (9.0, -9.0)),
    ("unpinching", lambda arm: _press(arm, 20), (0.0, 2.0)),
    ("braking_only", lambda arm: _moving(arm, 1.1, asked=(5.0, 1.0)), (0.0, 1.0)),
    ("braking_only", lambda arm: _moving(arm, -1.1, asked=(-5.0, 1.0)), (0.0, 1.0)),
    ("inwards_only", lambda arm: (_creep(arm, 1.05), _stay(arm, 1.05, (5.0, 1.0))), (0.0, 1.0)),
    ("inwards_only", lambda arm: (_creep(arm, -1.05), _stay(arm, -1.05, (-5.0, 1.0))), (0.0, 1.0)),
]


def _stay(arm: Arm, position: float, asked: tuple[float, float]) -> None:
    for k in range(9):
        arm.cycle(positions=(position + 1e-6 * (k % 2), 0.0), asked=asked)


@pytest.mark.parametrize(("limiter", "drive", "left"), CUTS)
def test_a_torque_is_cut_by_its_limiter(limiter: str, drive: Drive, left: tuple[float, float]) -> None:
    limits = replace(LIMITS, energy=1e6, power=5.0 if limiter == "power" else 1e6)
    arm = Arm(limits).armed()
    drive(arm)
    outcome = arm.outcomes[-1]
    assert limiter in outcome.limited
    if limiter == "power":
        speed = arm.state.motion.speeds[0]
        assert outcome.torques is not None
        assert outcome.torques[0] * speed == pytest.approx(2.5)
        assert outcome.torques[1] == -9.0
    else:
        assert outcome.torques == pytest.approx(left)


@pytest.mark.parametrize(("limiter", "drive", "left"), CUTS)
def test_without_its_limiter_a_torque_is_not_cut(limiter: str, drive: Drive, left: tuple[float, float]) -> None:
    limits = replace(LIMITS, energy=1e6, power=5.0 if limiter == "power" else 1e6)
    arm = Arm(limits, limiters=tuple(c for c in LIMITERS if c.__name__ != limiter)).armed()
    drive(arm)
    torques = arm.outcomes[-1].torques
    assert torques is not None
    cut = (2.5 / arm.state.motion.speeds[0], -9.0) if limiter == "power" else left
    assert torques != pytest.approx(cut)


def test_braking_and_inward_torques_are_not_cut() -> None:
    arm = Arm(replace(LIMITS, energy=1e6)).armed()
    _moving(arm, 1.1, asked=(-5.0, 0.0))
    assert arm.outcomes[-1].torques == (-5.0, 0.0)
    arm = Arm(replace(LIMITS, energy=1e6)).armed()
    _creep(arm, 1.05)
    _stay(arm, 1.05, (-5.0, 0.0))
    assert arm.outcomes[-1].torques == (-5.0, 0.0)


@pytest.mark.parametrize("end", [1.0, -1.0])
def test_at_the_very_end_of_its_range_a_joint_may_still_push_outwards(end: float) -> None:
    arm = Arm(replace(LIMITS, energy=1e6))
    arm.cycle(arm=True)
    arm.cycles(60)
    _creep(arm, end)
    outcome = arm.cycle(positions=(end, 0.0), asked=(2.0 * end, 0.0))
    assert outcome.torques == (2.0 * end, 0.0)


@pytest.mark.parametrize("size", [0.01, 0.9])
def test_torques_of_any_size_are_cut_beyond_speed_and_range(size: float) -> None:
    fast = Motion(PERIOD_S, (0.0, 0.0), (1.1, -1.1), (0, 0), (0, 0))
    assert braking_only(LIMITS, fast, (0.0, 0.0), (size, -size)) == (0.0, 0.0)
    beyond = Motion(PERIOD_S, (1.05, -1.05), (0.0, 0.0), (0, 0), (0, 0))
    assert inwards_only(LIMITS, beyond, (0.0, 0.0), (size, -size)) == (0.0, 0.0)
    assert inwards_only(LIMITS, beyond, (0.0, 0.0), (-size, size)) == (-size, size)


def test_at_its_very_limit_of_speed_a_joint_may_still_be_driven() -> None:
    motion = Motion(PERIOD_S, (0.0, 0.0), (1.0, -1.0), (0, 0), (0, 0))
    assert braking_only(LIMITS, motion, (0.0, 0.0), (3.0, -3.0)) == (3.0, -3.0)


def test_a_torque_that_turns_round_begins_at_zero() -> None:
    still = Motion(PERIOD_S, (0.0, 0.0), (0.0, 0.0), (0, 0), (0, 0))
    most = LIMITS.joints[0].torque_rate * PERIOD_S
    assert torque_rate(LIMITS, still, (5.0, -5.0), (-9.0, 9.0)) == pytest.approx((-most, most))


def test_a_torque_may_go_to_zero_at_once() -> None:
    arm = Arm().armed()
    arm.cycles(5, asked=(9.0, -9.0))
    assert arm.cycle().torques == (0.0, 0.0)


# --- what is remembered


def test_energy_is_the_work_of_the_controllers_part_less_what_is_forgiven() -> None:
    arm = Arm(replace(LIMITS, energy=1e6, power=1e6)).armed()
    _moving(arm, 0.5, asked=(0.0, 0.0))
    before = arm.state.energy
    start = 0.5 * 99 * PERIOD_S
    for k in range(1, 101):
        arm.cycle(positions=(start + 0.5 * k * PERIOD_S, 0.0), asked=(2.0, 0.0), support=(1.0, 0.0))
    # 99 cycles in which 2 N.m acted at 0.5 rad/s, 100 in which 0.2 W were forgiven
    assert before == 0.0
    assert arm.state.energy == pytest.approx((99 * 2.0 * 0.5 - 99 * LIMITS.leak) * PERIOD_S, rel=0.02)


def test_speed_is_the_slope_of_positions_through_a_low_pass() -> None:
    arm = Arm().armed()
    speed, expected, filtered = 0.6, 0.0, LIMITS.bandwidth * PERIOD_S
    arm.cycle(positions=(0.0, 0.0))
    arm.cycle(positions=(0.0, 0.0))
    first = arm.state.motion.speeds[0]
    expected = first
    for k in range(1, 6):
        arm.cycle(positions=(speed * k * PERIOD_S, 0.0))
        expected = (expected + filtered * speed) / (1 + filtered)
        assert arm.state.motion.speeds[0] == pytest.approx(expected, rel=1e-9)


def test_after_missing_answers_the_speed_is_that_of_the_whole_gap() -> None:
    arm = Arm().armed()
    _moving(arm, 0.6)
    before = arm.state.motion
    arm.cycles(2, positions=(None, 0.0))
    assert arm.state.motion.positions[0] == before.positions[0]
    arm.cycle(positions=(before.positions[0] + 0.6 * 3 * PERIOD_S, 0.0))
    assert arm.state.motion.speeds[0] == pytest.approx(0.6, rel=1e-3)
    assert arm.state.motion.missing == (0, 0)


FAST = replace(LIMITS, joints=(replace(FIRST, speed=2.0), SECOND))


@pytest.mark.parametrize(
    ("periods", "jump", "believed"),
    [
        (1.0, 0.0159, True),  # 4 times 2 rad/s, for 2 ms
        (1.0, 0.0161, False),
        (1.0, -0.0161, False),
        (3.0, 0.0477, True),
        (3.0, 0.0483, False),
        (0.001, 0.0159, True),  # answers may be due to the whole period, however short the cycle was
        (0.001, 0.0161, False),
    ],
)
def test_a_joint_is_believed_to_move_at_most_four_times_as_fast_as_it_may(
    periods: float, jump: float, believed: bool
) -> None:
    arm = Arm(FAST).armed()
    last = arm.state.motion.positions[0]
    arm.cycle(time_ns=arm.now + int(periods * PERIOD), positions=(last + jump, 0.0))
    assert (arm.state.motion.missing[0] == 0) is believed


def test_when_the_clock_stands_still_no_time_passes_and_speeds_stay() -> None:
    arm = Arm().armed()
    _moving(arm, 0.5)
    before = arm.state.motion.speeds
    arm.cycle(time_ns=arm.now, positions=(arm.state.motion.positions[0] + 1e-3, 0.0))
    assert arm.state.motion.seconds == 0.0
    assert arm.state.motion.speeds == before
    arm.cycle(time_ns=arm.now, positions=(None, 0.0))
    assert arm.state.motion.missing == (1, 0)


def test_equal_positions_and_missing_ones_are_counted_and_forgotten() -> None:
    arm = Arm().armed()
    still, missing = [], []
    for position in (0.001, 0.001, 0.001, 0.002, None, None, 0.002, 0.002):
        arm.cycle(positions=(position, 0.0))
        still.append(arm.state.motion.still[0])
        missing.append(arm.state.motion.missing[0])
    assert still == [k * PERIOD for k in (0, 1, 2, 0, 0, 0, 1, 2)]
    assert missing == [k * PERIOD for k in (0, 0, 0, 0, 1, 2, 0, 0)]


MISSING = {"positions": (None, 0.0)}
DOUBTED = {"positions": (0.0, 0.0), "doubted": (True, False)}
CERTAIN = {"positions": (0.0, 0.0), "doubted": (False, False)}


def doubts(*cycles: dict) -> tuple[Arm, list[tuple[float, ...]], list[float]]:
    """What is owed (periods) after each of some cycles, and how long the first joint has been unknown."""
    arm, owed, unknown = Arm().armed(), [], []
    for seen in cycles:
        arm.cycle(**seen)
        owed.append(tuple(time / PERIOD for time in arm.state.motion.owed))
        unknown.append(arm.state.motion.unknown[0] / PERIOD)
    return arm, owed, unknown


def test_a_doubted_position_counts_as_missing_if_none_comes_after_it() -> None:
    arm, owed, unknown = doubts(MISSING, MISSING, DOUBTED, MISSING)
    assert owed == [(), (), (3, 0), (3, 0)]
    assert unknown == [1, 2, 0, 4]
    assert arm.outcomes[-2].reaction is Reaction.PASS
    [trip] = arm.outcomes[-1].trips
    assert (trip.rule, trip.reaction) == ("positions_answered", Reaction.COMPLY)
    assert trip.words == "positions of joint 1 come too late or not at all: none is certain for 8 ms"


def test_a_certain_position_makes_a_doubted_one_good() -> None:
    arm, owed, unknown = doubts(MISSING, DOUBTED, CERTAIN, MISSING)
    assert owed == [(), (2, 0), (), ()]
    assert unknown == [1, 0, 0, 1]
    assert arm.outcomes[-1].trips[0].words == "no believable position of joint 1 for 2 ms"


def test_doubted_positions_one_after_the_other_add_up() -> None:
    _, owed, unknown = doubts(MISSING, DOUBTED, MISSING, DOUBTED, MISSING)
    assert owed == [(), (2, 0), (2, 0), (4, 0), (4, 0)]
    assert unknown == [1, 0, 3, 0, 5]


def test_one_joints_doubt_is_not_anothers() -> None:
    both = {"positions": (0.0, 0.0), "doubted": (True, True)}
    arm, owed, _ = doubts(both, DOUBTED, {"positions": (0.0, None)})
    assert owed == [(1, 1), (2, 0), ()]
    assert arm.state.motion.unknown == (0, PERIOD)


def test_the_furthest_believable_position_is_believed() -> None:
    arm = Arm()
    arm.cycle(positions=(0.008, 0.0))
    assert arm.state.motion.positions[0] == 0.008


def test_a_session_begins_at_rest() -> None:
    state = begin(LIMITS, 7, (0.1, 0.2))
    assert state.pinched == state.pressed == state.unsure == state.disagreed == (0, 0)
    assert state.motion == Motion(0.0, (0.1, 0.2), (0.0, 0.0), *((0, 0),) * 3, *((0.0, 0.0),) * 2)


# --- limits


@pytest.mark.parametrize(
    "change",
    [
        {"torque": 0.0},
        {"torque": math.nan},
        {"torque_rate": -1.0},
        {"speed": math.inf},
        {"low": 1.0},
        {"high": math.inf},
        {"margin": 0.0},
        {"breakaway": 0.0},
        {"continuous": -1.0},
        {"continuous": math.nan},
    ],
)
def test_limits_of_a_joint_that_limit_nothing_are_refused(change: dict) -> None:
    with pytest.raises(MisfitError, match="expected"):
        replace(JOINT, **change)


@pytest.mark.parametrize("name", [field.name for field in fields(Limits)[1:]])
@pytest.mark.parametrize("value", [0, -1, math.nan, math.inf])
def test_limits_of_a_session_that_limit_nothing_are_refused(name: str, value: float) -> None:
    with pytest.raises(MisfitError, match=f"limit {name}"):
        replace(LIMITS, **{name: value})


def test_limits_that_nobody_has_set_are_those_of_the_documentation() -> None:
    page = (Path(__file__).parents[2] / "docs/theory/safety_core.md").read_text()
    written = {name: float(value) for name, value in re.findall(r"^\| `(\w+)` \| ([\d.]+) \|", page, re.MULTILINE)}
    bare = JointLimits(torque=1.0, torque_rate=1.0, speed=1.0, low=0.0, high=1.0)
    unset = Limits((bare,))
    assert written == {field.name: getattr(unset, field.name) for field in fields(Limits)[2:]}
    assert (unset.period_ns, bare.margin, bare.breakaway, bare.continuous) == (2_000_000, 0.1, math.inf, math.inf)


@pytest.mark.parametrize("zone", [(0.0, 1.0, 0.0), (1.0, 1.0, 2.0), (0.0, math.nan, 2.0), (0.0, 1.0, math.inf)])
def test_a_zone_that_limits_nothing_is_refused(zone: tuple[float, float, float]) -> None:
    with pytest.raises(MisfitError, match="zone"):
        Zone(*zone)


def test_the_smallest_of_the_zones_counts_and_outside_of_them_none() -> None:
    joint = replace(JOINT, zones=(Zone(0.0, 1.0, 3.0), Zone(0.5, 0.8, 2.0)))
    assert [pinch_torque(joint, q) for q in (-0.1, 0.0, 0.5, 0.8, 1.0)] == [math.inf, 3.0, 2.0, 2.0, 3.0]


def test_heat_outlives_a_new_arming() -> None:
    arm = Arm().armed()
    _overload(arm, 6.0, 600)
    assert arm.state.stopped is not None and arm.state.stopped.rule == "cool"
    arm.cycle(arm=True)
    assert arm.state.stopped is not None
    arm.cycles(600)
    arm.cycle(arm=True)
    assert arm.state.stopped is None


@pytest.mark.parametrize(
    "change",
    [{"joints": ()}, {"reduced": 1.0}, {"missing_comply_s": 0.03}, {"ramp_s": 1e-9}, {"warm": 80.0}, {"warm": 75.0}],
)
def test_limits_that_contradict_themselves_are_refused(change: dict) -> None:
    with pytest.raises(MisfitError):
        replace(LIMITS, **change)


def test_a_weak_joint_may_have_limits_far_below_one() -> None:
    weak = replace(JOINT, torque=0.01, torque_rate=0.01, speed=0.01, margin=0.01, breakaway=0.01, continuous=0.01)
    assert weak.breakaway == weak.continuous == 0.01


def test_an_arm_may_be_let_go_as_soon_as_it_gives_way_and_have_the_shortest_ramp() -> None:
    assert Limits((JOINT,), ramp_s=MIN_RAMP_S).ramp_s == 0.05
    assert replace(LIMITS, missing_comply_s=0.029).missing_comply_s == LIMITS.missing_release_s


def test_a_single_joint_is_an_arm_too() -> None:
    limits = Limits(joints=(JointLimits(1.0, 100.0, 1.0, -1.0, 1.0),))
    state = begin(limits, 0, (0.0,))
    state, outcome = step(limits, state, Seen(limits.period_ns, (0.0,), (0.5,), (0.0,)))
    assert outcome.torques == (0.0,)


def test_the_watchdogs_own_frames_are_not_taken_for_another_host() -> None:
    arm = Arm().armed()
    outcome = arm.cycle(foreign_torque=True, watched=False)
    assert outcome.reaction is Reaction.RELEASE
    assert arm.state.stopped is not None and arm.state.stopped.rule == "watched"
    assert [trip.rule for trip in outcome.trips] == ["watched"]


def test_disagreement_with_a_model_counts_only_in_a_row_and_beyond_its_limit() -> None:
    arm = Arm(replace(LIMITS, effect_s=0.02)).armed()
    arm.cycles(30, unmodelled=(1.5, -1.5))
    assert arm.state.disagreed == (0, 0)
    for _ in range(4):
        arm.cycles(9, unmodelled=(0.0, 1.6))
        assert arm.state.disagreed == (0, 9 * PERIOD)
        arm.cycle(unmodelled=None)
        assert arm.state.disagreed == (0, 0)
    assert arm.state.stopped is None
