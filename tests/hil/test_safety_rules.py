"""Each rule of the safety core by itself, at its limit and just before it; what is expected is written down as numbers."""

import re
from dataclasses import replace
from typing import Any

import pytest

from hil.record import replaced
from hil.safety import rules
from hil.safety.core import begin
from hil.safety.cycle import Module, Motion, Reaction, Seen, Trip
from hil.safety.limits import Limits
from tests.hil.cycles import LIMITS, PERIOD, PERIOD_S

PASS = None
REDUCE, COMPLY, SUPPORT, RELEASE = Reaction.REDUCE, Reaction.COMPLY, Reaction.SUPPORT, Reaction.RELEASE


def trip_of(rule: str, changes: dict[str, Any], limits: Limits = LIMITS) -> Trip | None:
    """What a rule says of a calm cycle with changes; names begin with s_ (state), m_ (motion) or n_ (what is seen now)."""
    limits = replace(limits, unexplained=0.5, effect_s=0.15)
    parts: dict[str, Any] = {
        "s": begin(LIMITS, 0, (0.0, 0.0)),
        "m": Motion(PERIOD_S, (0.0, 0.0), (0.0, 0.0), (0, 0), (0, 0)),
        "n": Seen(PERIOD, (0.0, 0.0), (0.0, 0.0), (0.0, 0.0)),
    }
    for name, value in changes.items():
        part, field = name.split("_", 1)
        parts[part] = replaced(parts[part], **{field: value})
    found: Trip | None = getattr(rules, rule)(limits, *parts.values())
    assert found is None or found.rule == rule
    return found


@pytest.mark.parametrize(
    ("rule", "changes", "reaction"),
    [
        ("positions_answered", {"m_missing": (0, 1)}, REDUCE),
        ("positions_answered", {"m_missing": (4_999_999, 0)}, REDUCE),
        ("positions_answered", {"m_missing": (5_000_000, 0)}, COMPLY),
        ("positions_answered", {"m_missing": (0, 28_999_999)}, COMPLY),
        ("positions_answered", {"m_missing": (0, 29_000_000)}, RELEASE),
        # What is missing now and then counts for less than what is missing now.
        ("positions_answered", {"s_unsure": (0, 28_999_999), "m_missing": (0, PERIOD)}, COMPLY),
        ("positions_answered", {"s_unsure": (0, 29_000_000), "m_missing": (0, PERIOD)}, RELEASE),
        # breakaway is 3 N.m, frozen after 40 ms
        ("encoder_alive", {"s_active": (3.0, 0.0), "m_still": (10**9, 10**9)}, PASS),
        ("encoder_alive", {"s_active": (0.0, 3.1), "m_still": (10**9, 39_999_999)}, PASS),
        ("encoder_alive", {"s_active": (0.0, 3.1), "m_still": (0, 40_000_000)}, COMPLY),
        ("encoder_alive", {"s_active": (-3.1, 0.0), "m_still": (40_000_000, 0)}, COMPLY),
        # A force F holds back F reach = 0.8 F at most.
        ("encoder_alive", {"s_active": (3.1, 0.0), "m_still": (10**9, 0), "n_force": (0.0, 0.13, 0.0)}, PASS),
        ("encoder_alive", {"s_active": (3.1, 0.0), "m_still": (10**9, 0), "n_force": (0.0, 0.12, 0.0)}, COMPLY),
        ("on_time", {"n_time_ns": 0}, SUPPORT),
        ("on_time", {"n_time_ns": -1}, SUPPORT),
        ("on_time", {"n_time_ns": 1}, PASS),
        ("on_time", {"n_time_ns": PERIOD + 25_000_000}, REDUCE),
        ("on_time", {"n_time_ns": PERIOD + 25_000_001}, RELEASE),
        ("on_time", {"n_time_ns": 3 * PERIOD // 2, "s_late": 10**9}, PASS),
        ("on_time", {"n_time_ns": 3 * PERIOD // 2 + 1, "s_late": 2_999_998}, PASS),
        ("on_time", {"n_time_ns": 3 * PERIOD // 2 + 1, "s_late": 2_999_999}, REDUCE),
        ("on_time", {"n_time_ns": 3 * PERIOD // 2 + 1, "s_late": 26_999_998}, REDUCE),
        ("on_time", {"n_time_ns": 3 * PERIOD // 2 + 1, "s_late": 26_999_999}, COMPLY),
        ("on_time", {"n_computing_ns": PERIOD // 2, "s_late": 10**9}, PASS),
        ("on_time", {"n_computing_ns": PERIOD // 2 + 1, "s_late": 28_000_000}, COMPLY),
        # 1 rad/s: gives way beyond 1.25, is let go beyond 2
        ("speed_limited", {"m_speeds": (1.25, -1.25)}, PASS),
        ("speed_limited", {"m_speeds": (0.0, -1.26)}, COMPLY),
        ("speed_limited", {"m_speeds": (2.0, 0.0)}, COMPLY),
        ("speed_limited", {"m_speeds": (0.0, 2.01)}, RELEASE),
        # [-1, 1] rad with a margin of 0.1
        ("inside_range", {"m_positions": (1.099, -1.099)}, PASS),
        ("inside_range", {"m_positions": (0.0, 1.101)}, COMPLY),
        ("inside_range", {"m_positions": (-1.101, 0.0)}, COMPLY),
        ("energy_bounded", {"s_energy": 0.5}, PASS),
        ("energy_bounded", {"s_energy": 0.501}, COMPLY),
        ("force_bounded", {"n_force": (48.0, 64.0, 0.0)}, PASS),  # 80 N
        ("force_bounded", {"n_force": (0.0, 48.0, -64.1)}, COMPLY),
        ("force_bounded", {"n_force": (1.0, 1.0, 1.0), "s_force_still": 39_999_999}, PASS),
        ("force_bounded", {"n_force": (1.0, 1.0, 1.0), "s_force_still": 40_000_000}, COMPLY),
        ("force_bounded", {"n_force_saturated": True}, PASS),  # of a sensor that is not there
        ("cool", {"n_temperatures": (59.9, None)}, PASS),
        ("cool", {"n_temperatures": (None, 60.0)}, REDUCE),
        ("cool", {"n_temperatures": (74.9,)}, REDUCE),
        ("cool", {"n_temperatures": (20.0, 75.0)}, COMPLY),
        ("cool", {"n_temperatures": (float("nan"),)}, COMPLY),
        ("cool", {"s_heat": (0.0, 0.8)}, PASS),
        ("cool", {"s_heat": (0.81, 0.0)}, REDUCE),
        ("cool", {"s_heat": (1.0, 0.0)}, REDUCE),
        ("cool", {"s_heat": (0.0, 1.01)}, COMPLY),
        ("unpinched", {"s_pinched": (0, 59_999_999)}, PASS),
        ("unpinched", {"s_pinched": (60_000_000, 0)}, COMPLY),
        ("calm", {"s_flips": ((1,) * 10, ())}, PASS),
        ("calm", {"s_flips": ((), (1,) * 11)}, COMPLY),
        ("module_agrees", {"n_module": Module.IDLE}, PASS),  # an arm that is not armed may be idle
        ("module_agrees", {"n_module": Module.IDLE, "s_armed_ns": 0}, RELEASE),
        ("module_agrees", {"n_module": None}, RELEASE),
        ("module_agrees", {"n_module": Module.ESTOP, "n_fault": "torque"}, Reaction.SILENCE),
        ("module_agrees", {"n_fault": "torque", "n_warning": "velocity"}, RELEASE),
        ("module_agrees", {"n_warning": "velocity"}, REDUCE),
        ("drives_ready", {"n_trouble": "drive 2 has a fault"}, RELEASE),
        ("drives_ready", {"n_trouble": ""}, PASS),
        ("alone_on_the_bus", {"n_foreign_torque": True}, RELEASE),
        ("watched", {"n_watched": False}, RELEASE),
        ("recorded", {"n_recording": False}, COMPLY),
        ("not_aborted", {"n_abort": True}, COMPLY),
        ("not_ended", {"n_end": True}, RELEASE),
        ("finite_command", {"n_asked": (0.0, float("inf"))}, SUPPORT),
        ("finite_command", {"n_support": (float("nan"), 0.0)}, RELEASE),
        ("finite_command", {"n_asked": ()}, RELEASE),
        ("finite_command", {"n_support": (0.0,) * 3}, RELEASE),
        # what the sensor, the module, or the watchdog are missing for
        ("force_bounded", {"n_force": (0.0,) * 3, "n_force_missing_ns": 50_000_000}, PASS),
        ("force_bounded", {"n_force": (0.0,) * 3, "n_force_missing_ns": 50_000_001}, COMPLY),
        ("force_bounded", {"n_sensor": False}, RELEASE),
        ("module_agrees", {"n_module": Module.ABSENT}, RELEASE),
        ("positions_answered", {"s_unsure": (10_000_000, 0)}, PASS),
        ("positions_answered", {"s_unsure": (0, 10_000_001)}, COMPLY),
        ("positions_answered", {"s_unsure": (0, 28_999_999)}, COMPLY),
        ("positions_answered", {"s_unsure": (0, 29_000_000)}, RELEASE),
        ("positions_answered", {"s_unsure": (0, 10**9), "m_missing": (0, 29_000_000)}, RELEASE),
        ("encoder_steady", {"m_jumps": (1, 0), "m_jumped": (0.5, 0.0)}, PASS),
        ("encoder_steady", {"m_jumps": (0, 2), "m_jumped": (0.0, 0.5)}, COMPLY),
        # stops at once from 0.3 rad/s, for a tenth of 40 ms
        ("encoder_alive", {"m_halted": (0.3, 0.0), "m_still": (10**9, 0)}, PASS),
        ("encoder_alive", {"m_halted": (0.0, 0.31), "m_still": (0, 3_999_999)}, PASS),
        ("encoder_alive", {"m_halted": (0.0, 0.31), "m_still": (0, 4_000_000)}, COMPLY),
        ("torque_acts", {"s_pressed": (0, 149_999_999)}, PASS),
        ("torque_acts", {"s_pressed": (0, 150_000_000)}, RELEASE),
        ("model_explains", {"s_disagreed": (0, 149_999_999)}, PASS),
        ("model_explains", {"s_disagreed": (150_000_000, 0)}, COMPLY),
        ("motion_explained", {"m_speeds": (0.5, 0.0)}, PASS),
        ("motion_explained", {"m_speeds": (0.0, -0.9), "s_calm_speed": (0.0, 0.4)}, PASS),
        ("motion_explained", {"m_speeds": (0.0, -0.91), "s_calm_speed": (0.0, 0.4)}, RELEASE),
    ],
)
def test_a_rule_trips_beyond_its_limit_and_not_before(rule: str, changes: dict, reaction: Reaction | None) -> None:
    trip = trip_of(rule, changes)
    assert (trip.reaction if trip is not None else None) == reaction


WIDE = replace(LIMITS, joints=tuple(replace(joint, speed=2.0, margin=0.25) for joint in LIMITS.joints))


@pytest.mark.parametrize(
    ("rule", "changes", "reaction"),
    [
        ("speed_limited", {"m_speeds": (2.5, 0.0)}, PASS),
        ("speed_limited", {"m_speeds": (0.0, 2.6)}, COMPLY),
        ("speed_limited", {"m_speeds": (4.0, 0.0)}, COMPLY),
        ("speed_limited", {"m_speeds": (-4.1, 0.0)}, RELEASE),
        ("inside_range", {"m_positions": (1.25, -1.25)}, PASS),
        ("inside_range", {"m_positions": (1.251, 0.0)}, COMPLY),
    ],
)
def test_limits_of_other_joints_count_as_they_are(rule: str, changes: dict, reaction: Reaction | None) -> None:
    trip = trip_of(rule, changes, WIDE)
    assert (trip.reaction if trip is not None else None) == reaction


@pytest.mark.parametrize("rule", [rule.__name__ for rule in rules.RULES])
def test_no_rule_trips_in_a_calm_cycle(rule: str) -> None:
    assert trip_of(rule, {}) is None


@pytest.mark.parametrize(
    ("rule", "changes", "words"),
    [
        ("positions_answered", {"m_missing": (0, 2_000_000)}, "no believable position of joint 2 for 2 ms$"),
        (
            "positions_answered",
            {"s_unsure": (0, 12_000_000)},
            r"positions of joint 2 come too late or not at all again and again \(12 ms lately\)",
        ),
        ("positions_answered", {"m_missing": (4_000_000, 2_000_000)}, "no believable position of joint 1 for 4 ms"),
        ("positions_answered", {"m_missing": (0, 225_000)}, r"no believable position of joint 2 for 0\.225 ms"),
        ("positions_answered", {"m_missing": (0, 29_000_000), "s_unsure": (0, 40_000_000)}, "no believable position"),
        ("on_time", {"n_time_ns": 40_000_000}, "the session stood still: 40 ms between two cycles of 2 ms"),
        ("on_time", {"n_time_ns": -3_000_000}, "the clock moved by -3 ms between two cycles"),
        (
            "on_time",
            {"n_computing_ns": PERIOD, "s_late": 28_000_000},
            "for 30 ms all cycles were late or took more than half of 2 ms",
        ),
        ("on_time", {"n_computing_ns": PERIOD, "s_late": 4_000_000}, "for 6 ms all cycles were late"),
        ("speed_limited", {"m_speeds": (0.0, -1.5)}, "joint 2 moves at -1.5 rad/s, its limit is 1 rad/s"),
        ("inside_range", {"m_positions": (0.0, 1.2)}, r"joint 2 is at 1.2 rad, outside \[-1, 1\] rad"),
        (
            "encoder_alive",
            {"s_active": (0.0, 4.0), "m_still": (0, 50_000_000)},
            "joint 2 stands still .* under 4 N.m for 50 ms",
        ),
        (
            "energy_bounded",
            {"s_energy": 0.75},
            "the arm gave whoever holds it 0.75 J more than it got back, the limit is 0.5 J",
        ),
        ("force_bounded", {"n_force": (0.0, 0.0, 90.0)}, "90 N at the wrist, the limit is 80 N"),
        ("cool", {"s_heat": (1.5, 0.0)}, "joint 1 has made more torque than the 5 N.m its motor bears"),
        ("unpinched", {"s_pinched": (0, 62_000_000)}, "joint 2 has pressed without moving for 62 ms"),
        ("calm", {"s_flips": ((), (1,) * 12)}, "the torque of joint 2 changed its sign 12 times in a second"),
        ("finite_command", {"n_asked": (0.0, float("nan"))}, "torque asked for at joint 2 is nan N.m"),
        ("encoder_steady", {"m_jumps": (0, 2), "m_jumped": (0.0, -0.31)}, "encoder of joint 2 jumped by -0.31 rad"),
        (
            "encoder_alive",
            {"m_halted": (0.4, 0.0), "m_still": (5_000_000, 0)},
            "joint 1 .* same for 5 ms, right after 0.4",
        ),
        (
            "torque_acts",
            {"s_pressed": (0, 160_000_000), "s_active": (0.0, 8.0)},
            "joint 2 has not followed 8 N.m for 160 ms",
        ),
        (
            "model_explains",
            {"s_disagreed": (0, 152_000_000)},
            r"for 152 ms joint 2 has moved as if more than 1\.5 N\.m acted",
        ),
        ("motion_explained", {"m_speeds": (0.0, 0.8)}, "joint 2 sped up by 0.8 rad/s, and neither"),
        ("force_bounded", {"n_force": (0.0,) * 3, "n_force_missing_ns": 60_000_000}, "not answered for 60 ms"),
        ("force_bounded", {"n_force": (0.0,) * 3, "n_force_missing_ns": 999_500_000}, "not answered for 1000 ms"),
        ("force_bounded", {"n_force": (0.0,) * 3, "n_force_missing_ns": 1_234_000_000}, "not answered for 1234 ms"),
        ("force_bounded", {"n_sensor": False}, "there is no force sensor"),
        ("module_agrees", {"n_module": Module.ABSENT}, "there is no safety module"),
        ("watched", {"n_watched": False, "n_watchdog_silent": True}, "the watchdog has fallen silent"),
        ("watched", {"n_watched": False}, "the watchdog has let the arm go, or is gone"),
        ("finite_command", {"n_asked": (0.0,)}, "1 and 2 torques for 2 joints"),
    ],
)
def test_a_trip_names_the_joint_the_value_and_the_limit(rule: str, changes: dict, words: str) -> None:
    trip = trip_of(rule, changes)
    assert trip is not None
    assert re.search(words, trip.words), trip.words
