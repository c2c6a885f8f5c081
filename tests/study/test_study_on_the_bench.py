"""The study with corrections that a bench session measured on a virtual robot, through the bus."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from hil.emulation.anatomy import anatomy
from hil.emulation.muscles import Muscles
from hil.trials.protocol import read_protocol
from orchestrator.cli.study import study
from orchestrator.study.muscles import PHYSIOLOGICAL, perfect, torques
from orchestrator.study.recorded import recorded_corrections
from tests.hil.trial_session import run_trials


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A trial on a virtual robot whose arm hides nothing, without time."""
    folder = tmp_path_factory.mktemp("bench") / "session"
    whole = read_protocol("study")
    one = whole.trials[1]
    short = replace(whole, trials=(one,), rest=one.posture, settle_s=0.1, announce_s=0.5, confirm=False)
    run_trials(folder, short, 250.0, body="arm")
    return folder


def test_the_study_judges_the_muscles_that_the_bench_emulates() -> None:
    """Torques in closed form are those of the muscle FMU that a session asks."""
    muscles, rng = Muscles(anatomy()), np.random.default_rng(0)
    for _ in range(20):
        q, w = rng.uniform([0.0, 0.5], [1.5, 2.2]), rng.uniform(-1.0, 1.0, 2)
        alpha = rng.uniform(size=6)
        passive, active = torques(np.array([[*q, *w]]), PHYSIOLOGICAL)
        assert passive[0] + alpha @ active[0] == pytest.approx(muscles.torques(alpha, q, w), abs=1e-9)


def test_corrections_through_the_bus_hold_the_emulated_arm(session: Path) -> None:
    seen = recorded_corrections([str(session)])
    assert len(seen) == 4
    assert seen.activation.max() <= 0.25
    # Less what motion took, the pushes are those that hold the muscles at the measured states.
    off = seen.steady - perfect(seen.state, seen.activation, PHYSIOLOGICAL)
    size = np.linalg.norm(perfect(seen.state, seen.activation, PHYSIOLOGICAL), axis=1)
    assert np.sqrt(np.mean(off**2)) < 0.1 * np.sqrt(np.mean(size**2))


def test_the_study_learns_from_a_recorded_session(session: Path, tmp_path: Path) -> None:
    file = tmp_path / "study.json"
    done = CliRunner().invoke(study, ["caregivers", "--recorded", str(session), "--json", str(file)])
    assert done.exit_code == 0, done.output
    assert "4 corrections of 1 recorded sessions" in done.output
    found = json.loads(file.read_text())
    assert found["corrections"] == 4
    assert set(found["ways"]) >= {"joint", "compensated", "refitted"}
    assert all(np.isfinite(way["strong_four"]) for way in found["ways"].values())


def test_a_folder_that_is_no_session_is_refused_in_one_line() -> None:
    done = CliRunner().invoke(study, ["caregivers", "--recorded", "tests/cases/pendulum"])
    assert done.exit_code != 0
    assert "has no column" in str(done.exception)
