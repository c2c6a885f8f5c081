"""From a recorded session to a named effect without handwork: set, nominal model and block come from one command."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from fmus.errors import MisfitError
from hil.control.controllers import Asked
from hil.recording.identify import CLASS, MODEL, write_identification
from hil.recording.recorder import Recorder
from hil.session.loop import Loop, Wishes
from hil.session.recorded import ROBOT, SETTINGS, pilot_of, recorded_pilot
from hil.settings import default_settings
from hil.virtual.plant import FreeJoints
from orchestrator.measurements import load_measurements
from tests.hil.bench import Bench, ExactTimer

INERTIA, DAMPING = 0.05, 0.3


def record(folder: Path, seconds: float, *, arm: bool = True) -> Path:
    """A session in which a program beside it moves the elbow; time is virtual."""
    settings = replace(default_settings(rate_hz=100.0), gravity=False, controller="asked")
    bench = Bench(settings=settings)
    assert isinstance(bench.plant, FreeJoints) and (bench.plant.inertia, bench.plant.damping) == (INERTIA, DAMPING)
    robot = bench.started()
    bench.plant.angles = np.array([-0.3, 0.2, 1.5])
    bench.robot.advance(bench.bus.time_ns)
    pilot = pilot_of(robot, settings)
    assert isinstance(pilot.controller, Asked)
    recorder = Recorder(folder)
    bench.wire.tap = recorder.frame
    (folder / SETTINGS).write_text(json.dumps(settings.to_json()))
    (folder / ROBOT).write_text(json.dumps(robot.to_json()))
    began = bench.bus.time_ns

    def asked() -> tuple[float, float, float]:
        t = (bench.bus.time_ns - began) * 1e-9
        return 0.0, 0.0, 0.3 * np.sin(2 * np.pi * (0.5 + 0.05 * t) * t)

    def wishes() -> Wishes:
        return Wishes(arm=arm and not pilot.is_armed, over=bench.bus.time_ns - began > seconds * 1e9)

    summary = Loop(bench.wire, pilot, ExactTimer(bench), recorder, asked=asked).run(wishes)
    recorder.finish()
    bench.wire.close()
    assert summary.faults == []
    return folder


def test_a_session_becomes_a_measurement_set_that_obeys_the_robots_own_equation(tmp_path: Path) -> None:
    recording = record(tmp_path / "session", 8.0)
    out = tmp_path / "set"
    found = write_identification(recording, recorded_pilot(recording), out)
    assert found.joint == 3 and found.rows > 700
    table = pq.read_table(out / "joint.parquet")
    time, torque, angle = (table[name].to_numpy() for name in ("time", "torque", "phi"))
    # J w' + d w = tau, integrated twice by the trapezoidal rule over 20 cycles: neither speeds nor accelerations are needed
    impulse = np.concatenate([[0.0], np.cumsum(0.5 * (torque[1:] + torque[:-1]) * np.diff(time))])
    speed = np.gradient(angle, time)
    left = INERTIA * (speed - speed[0]) + DAMPING * (angle - angle[0])
    assert np.sqrt(np.mean(np.square(left - impulse))) < 0.03 * np.std(impulse)
    trials = load_measurements(out)
    assert {trial.subset for trial in trials.trials} == {"learning", "held_out"}
    assert f"model {CLASS}" in (out / MODEL).read_text()


def test_a_recording_of_an_arm_that_was_never_armed_says_so(tmp_path: Path) -> None:
    recording = record(tmp_path / "session", 0.3, arm=False)
    with pytest.raises(MisfitError, match="cycles of an armed arm; 50 or more"):
        write_identification(recording, recorded_pilot(recording), tmp_path / "set")


def test_a_joint_that_stood_still_is_no_measurement(tmp_path: Path) -> None:
    """A held arm gave 482 rows of a joint that "moved by 0 rad", and advice to go on."""
    recording = record(tmp_path / "session", 2.0)
    with pytest.raises(MisfitError, match=r"joint 1 moved by 0 rad, within its encoder's steps"):
        write_identification(recording, recorded_pilot(recording), tmp_path / "set", joint=1)
    assert not (tmp_path / "set").exists()
