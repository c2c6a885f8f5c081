"""A virtual robot's own joints with a burden: they move as the equations say, and a session with them finds it out."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from fmus.errors import MisfitError
from hil.cli import hil
from hil.component import RobotComponent, open_robot
from hil.emulation.anatomy import anatomy
from hil.emulation.muscles import Muscles
from hil.recording.identify import DIAGNOSIS
from hil.recording.recorder import Recorder
from hil.session.loop import Loop, Wishes
from hil.session.recorded import ROBOT, SETTINGS, pilot_of
from hil.settings import default_settings
from hil.trials.protocol import protocol_of_json, read_protocol
from hil.virtual.body import Body, Burden
from hil.virtual.made import REACH, LoadedJoints, Made
from orchestrator.cosim.system import ComponentSpec
from tests.hil.bench import Bench, ExactTimer

START = np.array([-0.3, 0.2, 1.5])


def moved(burden: Burden, torque: float, seconds: float) -> LoadedJoints:
    plant = LoadedJoints(np.zeros(3), burden)
    for _ in range(round(seconds / 1e-3)):
        plant.step(np.array([0.0, 0.0, torque]), 1e-3)
    return plant


def test_a_payload_adds_its_mass_times_the_square_of_its_distance() -> None:
    plant = moved(Burden(payload=2.0, friction=1e-3), 0.5, 0.2)
    inertia = 0.05 + 2.0 * REACH[2] ** 2
    assert plant.angles[2] == pytest.approx(0.5 * 0.5 / inertia * 0.2**2, rel=1e-3)


def test_a_delayed_torque_moves_the_joint_as_one_that_came_later() -> None:
    late, early = moved(Burden(delay=0.03), 0.5, 0.5), moved(Burden(), 0.5, 0.47)
    assert late.angles == pytest.approx(early.angles, abs=1e-9)
    assert moved(Burden(delay=0.03), 0.5, 0.03).angles == pytest.approx(np.zeros(3), abs=1e-12)


def test_dry_friction_holds_a_joint_and_takes_its_share_of_a_torque_that_moves_it() -> None:
    assert moved(Burden(dry=0.2), 0.19, 1.0).angles[2] == 0.0
    # In the end (0.5 - 0.2)/0.3 rad/s.
    assert moved(Burden(dry=0.2), 0.5, 3.0).speeds[2] == pytest.approx(1.0, rel=1e-3)


def test_noise_is_that_of_the_encoders_and_not_of_the_joints() -> None:
    plant = LoadedJoints(START, Burden(noise=1e-3))
    shown = np.array([plant.shown() for _ in range(2000)])
    assert np.array_equal(plant.angles, START)
    assert np.std(shown - START) == pytest.approx(1e-3, rel=0.05)
    robot = Made(body=Body(burden=Burden(noise=1e-2))).robot()
    first = robot.motors[2].angle
    robot.advance(1)
    assert robot.motors[2].angle != first


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"mass": 1.0}, "has no 'mass'; there are friction, dry, payload, delay, noise"),
        ({"payload": -1.0}, "payload = -1.0"),
        ({"delay": float("nan")}, "delay = nan"),
        ({"friction": 0.0}, "without any friction never come to rest"),
    ],
)
def test_a_burden_that_no_joint_has_is_refused(given: dict, words: str) -> None:
    with pytest.raises(MisfitError, match=words):
        Burden.of(given)


def test_a_body_comes_back_from_the_line_that_a_virtual_robot_is_told() -> None:
    for body in (Body(burden=Burden(payload=1.0)), Body("arm", {"x": 1.0})):
        assert Body.from_json(body.to_json()) == body


def test_a_system_file_gives_its_virtual_robot_a_body(tmp_path: Path) -> None:
    options = {"virtual": True, "body": {"payload": 1.5, "delay": 0.02}}
    spec = ComponentSpec("robot", "robot", source="", isolate=False, options=options)
    component = open_robot(spec, tmp_path)
    assert isinstance(component, RobotComponent)
    assert component.body == Body(burden=Burden(payload=1.5, delay=0.02))
    with pytest.raises(MisfitError, match="body is a table of a virtual robot"):
        open_robot(replace(spec, options={"virtual": True, "body": 3}), tmp_path)


def recorded(folder: Path, burden: Burden, seconds: float = 8.0) -> Path:
    """A session in virtual time in which a program beside it moves the elbow."""
    settings = replace(default_settings(rate_hz=100.0), gravity=False, controller="asked")
    bench = Bench(settings=settings)
    bench.plant = bench.robot.plant = LoadedJoints(bench.plant.angles, burden)
    robot = bench.started()
    bench.plant.angles = START.copy()
    bench.robot.advance(bench.bus.time_ns)
    pilot, recorder = pilot_of(robot, settings), Recorder(folder)
    bench.wire.tap = recorder.frame
    (folder / SETTINGS).write_text(json.dumps(settings.to_json()))
    (folder / ROBOT).write_text(json.dumps(robot.to_json()))
    began = bench.bus.time_ns

    def asked() -> tuple[float, float, float]:
        t = (bench.bus.time_ns - began) * 1e-9
        return 0.0, 0.0, 0.3 * np.sin(2 * np.pi * (0.5 + 0.05 * t) * t)

    def wishes() -> Wishes:
        return Wishes(arm=not pilot.is_armed, over=bench.bus.time_ns - began > seconds * 1e9)

    summary = Loop(bench.wire, pilot, ExactTimer(bench), recorder, asked=asked).run(wishes)
    recorder.finish()
    bench.wire.close()
    assert summary.faults == []
    return folder


@pytest.mark.parametrize(
    ("burden", "effect", "parameter", "value"),
    [
        (Burden(payload=0.3), "rotor_inertia", "J[1]", 0.3 * REACH[2] ** 2),
        (Burden(delay=0.013, noise=3e-4), "stimulation_delay", "T", 0.013),
    ],
)
def test_a_session_finds_out_what_its_virtual_robot_was_given(
    burden: Burden, effect: str, parameter: str, value: float, tmp_path: Path
) -> None:
    recording, out = recorded(tmp_path / "session", burden), tmp_path / "set"
    found = CliRunner().invoke(
        hil, ["identify", str(recording), "--out", str(out), "--no-block", "--discover", "--quiet"]
    )
    assert found.exit_code == 0, found.output
    named = {each["id"]: each for each in json.loads((out / DIAGNOSIS).read_text())["effects"]}
    assert set(named) == {effect, "viscous_friction"}
    sizes = {name: part["value"] for name, part in named[effect]["parameters"].items()}
    # Torques are held from cycle to cycle of 10 ms: taken for straight lines, the delay would be 5 ms more.
    assert sizes[parameter] == pytest.approx(value, rel=2e-3)


def test_a_weak_muscle_pulls_with_its_share_and_the_others_as_ever() -> None:
    body = anatomy()
    muscles, q, w = Muscles(body), np.array([0.7, 1.3]), np.array([0.1, -0.2])
    alpha, strength = np.full(6, 0.2), np.array([1.0, 1.0, 0.6, 1.0, 1.0, 1.0])
    missing = muscles.torques(alpha, q, w) - muscles.torques(alpha, q, w, strength)
    assert missing == pytest.approx(0.4 * muscles.forces(alpha, q, w)[2] * body.arms[:, 2])


def test_a_protocol_says_the_strength_of_muscles_and_its_recording_keeps_it(tmp_path: Path) -> None:
    path = tmp_path / "weak.toml"
    trial = "[[trials]]\nposture = [0.3, 1.0]\nactivations = [0.1, 0, 0.2, 0, 0, 0.1]\n"
    path.write_text("strength = [1, 1, 0.6, 1, 1, 1]\n" + trial)
    found = read_protocol(str(path))
    assert found.strength == (1.0, 1.0, 0.6, 1.0, 1.0, 1.0)
    assert protocol_of_json(json.loads(json.dumps(found.to_json()))) == found
    path.write_text("strength = [1, 1]\n" + trial)
    with pytest.raises(MisfitError, match="six shares between 0 and 2"):
        read_protocol(str(path))
