"""A robot without its safety module or its force sensor is not armed, unless the bench file says in so many words that it may."""

from dataclasses import fields, replace
from pathlib import Path

import pytest

from fmus.errors import MisfitError
from hil.robots.absent import MODULE, SENSOR, absent, refusals, unchecked, warning
from hil.safety.limits import JointLimits, Limits
from hil.session.recorded import pilot_of
from hil.settings import Settings, default_settings, read_settings, virtual_settings
from hil.terminal import gaps
from tests.hil.bench import SETTINGS, Bench

NODES = {MODULE: 10, SENSOR: 8}


def bench_without(name: str, settings: Settings = SETTINGS) -> Bench:
    bench = Bench(settings=settings)
    next(node for node in bench.robot.nodes if node.number == NODES[name]).powered = False
    return bench


@pytest.mark.parametrize("name", NODES)
def test_a_robot_that_lacks_a_safeguard_is_refused_with_the_reason(name: str) -> None:
    robot = bench_without(name).started()
    assert absent(robot) == [name]
    [words] = refusals(robot, ())
    assert words.startswith(f"no {name} answers") and "= true in [robot]" in words
    assert refusals(robot, (name,)) == []


@pytest.mark.parametrize("name", NODES)
@pytest.mark.parametrize("is_waived", [False, True])
def test_the_safety_core_does_not_arm_it_either(name: str, is_waived: bool) -> None:
    settings = replace(SETTINGS, waived=(name,) if is_waived else ())
    bench = bench_without(name, settings)
    if name == MODULE:  # nobody else switches the motors on
        for motor in bench.robot.motors:
            motor.values["MODE"] = 2
    pilot = pilot_of(bench.started(), settings)
    bench.plant.angles[:] = [-0.3, 0.2, 1.5]
    bench.robot.advance(bench.bus.time_ns)
    bench.run(pilot, 100)
    assert pilot.is_armed is is_waived
    assert is_waived or f"there is no {name}" in str(pilot.refused)


@pytest.mark.parametrize("name", NODES)
def test_a_safeguard_that_falls_silent_between_start_up_and_arming_leaves_the_arm_unarmed(name: str) -> None:
    bench = Bench()
    pilot = bench.pilot()
    next(node for node in bench.robot.nodes if node.number == NODES[name]).powered = False
    bench.run(pilot, 50)
    assert not pilot.is_armed
    assert not any(motor.torque for motor in bench.robot.motors)
    assert "not answer" in str(pilot.refused)


def test_a_bench_file_that_waives_a_safeguard_halves_the_limits_and_says_so_everywhere(tmp_path: Path) -> None:
    path = tmp_path / "bench.toml"
    path.write_text('[bus]\ninterface = "virtual"\n')
    whole = read_settings(path)
    path.write_text('[bus]\ninterface = "virtual"\n[robot]\nwithout_safety_module = true\n')
    half = read_settings(path)
    assert half.waived == (MODULE,)
    assert [joint.torque for joint in half.limits.joints] == [0.5 * joint.torque for joint in whole.limits.joints]
    assert [joint.speed for joint in half.limits.joints] == [0.5 * joint.speed for joint in whole.limits.joints]
    assert (half.limits.power, half.limits.energy) == (0.5 * whole.limits.power, 0.5 * whole.limits.energy)
    assert warning(half.waived) == "WITHOUT SAFETY MODULE: limits are halved"
    assert warning(whole.waived) == ""
    gap = {"cycles": 1, "torque_frames": 1, "signs": 1, "limit": 25}
    document = {"largest_gap_ms": gap, "round_trip_us": {"p50": 1, "max": 2}, "without": [MODULE]}
    assert "without safety module, with halved limits" in gaps(document)


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ("[controller]\ndamping = [2, -2, 1]", r"damping = -2"),
        ("[controller]\nstiffness = [nan, 1, 1]", "stiffness = nan"),
        ("[controller]\nstiffness = [1, inf, 1]", "stiffness = inf"),
        ("[robot]\nproof_torque = [-4, 4, 3]", "proof_torque = -4"),
        ("[robot]\nshoulder = nan", "shoulder = nan"),
        ("[robot]\nshoulder = 43", r"shoulder = 43 rad is outside .*; is it in degrees[?]"),
        ("[robot]\nshoulder = true", "shoulder = True; a number in rad was expected"),
        ("[[joints]]\nlow = -60\nhigh = 30", r"joint 1: low = -60 rad is outside .*; is it in degrees[?]"),
        ("[robot]\ngravity = 'no'", "gravity = 'no'; true or false"),
        ("[robot]\nwithout_safety_module = 1", "without_safety_module = 1; true or false"),
        ("[limits]\nramp_s = 1e-9", "ramp_s = 1e-09 s; 0.05 s or more"),
        ("[limits]\ndamping = -0.5", "limit damping = -0.5"),
        ("[[joints]]\n[[joints]]\n[[joints]]\n[[joints]]", "joint = 4; a robot with 3 joints"),
        ("[[joints]]\njoint = 2\n[[joints]]\njoint = 2", "two tables for joint 2"),
        ("[[joints]]\n[[joints]]\njoint = 1", "two tables for joint 1"),
        ("[limits]\nstall_s = 25", r"stall_s = 25 s is outside \[0, 0.2\] s; times are in seconds"),
        ("[limits]\nmissing_comply_s = 5\nmissing_release_s = 29", "missing_comply_s = 5 s is outside"),
        ("[limits]\nforce_missing_s = 50", "force_missing_s = 50 s is outside"),
        ("[limits]\nbandwidth = 1e-6", "bandwidth = 1e-06 rad/s is outside"),
        ("[limits]\npowr = 3", r"\[limits\] has 'powr', which is not known; there are power, energy"),
        ("[limits]\nreach = 1e9", "reach = 1e[+]09 m is outside"),
        ("[limits]\ndamping = 1e6", "damping = 1e[+]06 N.m.s/rad is outside"),
        ("[limits]\noscillation = 2.5", "oscillation = 2.5; a whole number"),
        ("[limits]\nramp_s = true", "ramp_s = True; a number in s was expected"),
        ("[controller]\nstiffness = [1e9, 40, 20]", "stiffness = 1e[+]09 N.m/rad is outside"),
        ("[robot]\nproof_torque = [400, 4, 3]", "proof_torque = 400 N.m of joint 1 is above its torque, 20 N.m"),
        (
            "[robot]\nforce_axes = [[0.02, 0, 0], [0, 0.02, 0], [0, 0, 0.02]]",
            "force_axes make a force 0.02 to 0.02 times",
        ),
        ("[[joints]]\ntorque = true", "torque = True; a number in N.m was expected"),
        ("[[joints]]\njoint = true", "joint = True; a robot with 3 joints"),
        ("[[joints]]\nmargin = 10", "margin = 10 rad is outside"),
        ("[[joints]]\nbreakaway = inf", "breakaway = inf N.m is not below torque = 20 N.m"),
        (
            "[robot]\nwithout_safety_module = true\n[[joints]]\ntorque = 6\nbreakaway = 4",
            "breakaway = 4 N.m is not below torque = 3",
        ),
        ("[joints]\ntorque = 2", r"one table \[\[joints\]\] for each joint"),
        ("[[joints]]\ntorque = nan", r"\[\[joints\]\] of joint 1: limit torque = nan"),
    ],
)
def test_a_bench_file_that_would_drive_the_arm_is_refused_with_file_and_key(
    tmp_path: Path, lines: str, words: str
) -> None:
    path = tmp_path / "bench.toml"
    path.write_text(f'[bus]\ninterface = "virtual"\n{lines}\n')
    with pytest.raises(MisfitError, match=rf"bench\.toml.*{words}") as caught:
        read_settings(path)
    assert str(caught.value).count("bench.toml") == 1


@pytest.mark.parametrize("lines", ["limits = 3", "robot = [1]", "controller = 'hold'", "bus = 'can0'", "learning = 1"])
def test_what_is_no_table_is_refused_by_its_name(tmp_path: Path, lines: str) -> None:
    path = tmp_path / "bench.toml"
    path.write_text(lines + "\n")
    with pytest.raises(MisfitError, match=f"bench.toml: .* a table .{lines.split()[0]}. was expected"):
        read_settings(path)


@pytest.mark.parametrize("rate_hz", [10.0, 100.0, 1000.0])
@pytest.mark.parametrize("kind", ["proficio", "cia402"])
def test_what_holds_without_a_word_in_the_file_may_also_be_said_in_it(
    tmp_path: Path, kind: str, rate_hz: float
) -> None:
    path = tmp_path / "bench.toml"
    usual = default_settings(robot=kind, rate_hz=rate_hz).limits
    said = "".join(f"{f.name} = {getattr(usual, f.name)!r}\n" for f in fields(Limits)[2:])
    path.write_text(f"[robot]\nkind = '{kind}'\n[limits]\n{said}")
    assert read_settings(path, rate_hz).limits == usual


def test_a_robot_of_which_nobody_knows_what_moves_it_is_said_to_go_unchecked() -> None:
    joint = JointLimits(5.0, 10.0, 1.0, -1.0, 1.0)
    assert unchecked(Limits((replace(joint, breakaway=2.0), joint))).startswith("NOT NOTICED at joint 2:")
    assert not unchecked(Limits((replace(joint, breakaway=2.0),)))


def test_virtual_drives_have_torque_left_to_show_that_it_acts_though_their_limits_are_halved() -> None:
    assert not unchecked(virtual_settings(robot="cia402").limits)
