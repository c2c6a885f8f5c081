"""A session of trials goes on where another one was broken off: with the trial's own number, into a folder of its own."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from click.testing import CliRunner

from fmus.errors import MisfitError
from hil.cli import hil
from hil.session.recorded import replay_session
from hil.settings import Settings, settings_of_json, virtual_settings
from hil.trials.controller import Trials
from hil.trials.phases import Phase
from hil.trials.protocol import Protocol, Trial
from hil.trials_cli import said_of
from tests.hil import bench
from tests.hil.trial_session import run_trials, some_trials

THREE = Protocol(trials=tuple(Trial((0.7, 1.3), (0.1 * k,) * 6) for k in range(3)), confirm=False)


def beginning_with(first: int) -> Settings:
    return replace(virtual_settings(), protocol=THREE, first_trial=first)


@pytest.mark.parametrize("first", [1, 2, 3])
def test_a_session_runs_the_trials_from_its_first_to_the_last(first: int) -> None:
    controller, ran = beginning_with(first).make_controller(), []
    assert isinstance(controller, Trials)
    course = controller.course
    for k in range(4000):
        course.advance(0.01 * k, np.array([0.0, 0.1, 1.0]), confirm=False)
        if course.phase is Phase.STIMULATE and course.trial not in ran:
            ran.append(course.trial)
            assert course.activations(course.began + 1.0) == pytest.approx(THREE.trials[course.trial - 1].activations)
    assert ran == list(range(first, 4))
    assert course.phase is Phase.DONE


@pytest.mark.parametrize("first", [0, 4, -1])
def test_a_trial_that_the_protocol_does_not_have_is_refused(first: int) -> None:
    with pytest.raises(MisfitError, match=f"there is no trial {first} to begin with; the protocol has 1 to 3"):
        beginning_with(first)


def test_a_recording_of_before_begins_with_its_first_trial() -> None:
    document = beginning_with(2).to_json()
    assert settings_of_json(json.dumps(document)).first_trial == 2
    del document["first_trial"]
    assert settings_of_json(json.dumps(document)).first_trial == 1


def test_files_bear_the_numbers_of_the_protocol_and_the_session_replays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    protocol = some_trials(2)
    monkeypatch.setattr(bench, "SETTINGS", replace(bench.SETTINGS, protocol=protocol, first_trial=2))
    session = run_trials(tmp_path / "rest", protocol, rate_hz=100.0)
    assert session.summary.faults == []
    assert sorted(path.name for path in session.folder.glob("trial_*")) == ["trial_02.parquet"]
    alpha = np.asarray(pq.read_table(session.folder / "trial_02.parquet")["alpha_1"]).max()
    assert alpha == pytest.approx(protocol.trials[1].activations[0], rel=0.02)
    assert replay_session(session.folder).first_different is None
    assert settings_of_json((session.folder / "settings.json").read_text()).first_trial == 2


@pytest.mark.parametrize(
    ("options", "count", "first"),
    [([], 21, 1), (["--first", "7"], 21, 7), (["--first", "7", "--trials", "2"], 8, 7), (["--first", "21"], 21, 21)],
)
def test_options_choose_the_trials(
    options: list[str], count: int, first: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[Settings] = []

    def run(settings: Settings, *_: object, **__: object) -> dict[str, Any]:
        seen.append(settings)
        return {"cycles": 1, "rate_hz": 100.0, "missed": 0, "answers_late": 0, "frames_lost": 0, "faults": []}

    monkeypatch.setattr("hil.session.session.run_session", run)
    (tmp_path / "bench.toml").write_text('[bus]\ninterface = "virtual"\nchannel = "nowhere"\n')
    (tmp_path / "protocol.toml").write_text("confirm = false\n" + STUDY)
    where = [str(tmp_path / "protocol.toml"), "--bench", str(tmp_path / "bench.toml"), "--out", str(tmp_path / "out")]
    result = CliRunner().invoke(hil, ["record", *where, *options])
    assert result.exit_code == 0, result.output
    (settings,) = seen
    assert settings.protocol is not None
    assert (len(settings.protocol.trials), settings.first_trial) == (count, first)
    assert f"0 of {count - first + 1} trials recorded" in result.output


STUDY = "[study]\npostures = [[0.7, 1.3], [0.8, 1.2], [0.6, 1.4], [0.7, 1.2], [0.7, 1.4], [0.8, 1.3], [0.6, 1.2]]\n"


def test_a_protocol_that_ends_before_is_said_to(tmp_path: Path) -> None:
    (tmp_path / "bench.toml").write_text('[bus]\ninterface = "virtual"\nchannel = "nowhere"\n')
    options = ["--bench", str(tmp_path / "bench.toml"), "--first", "22", "--out", str(tmp_path / "out")]
    result = CliRunner().invoke(hil, ["record", "study", *options])
    assert isinstance(result.exception, MisfitError)
    assert str(result.exception) == "there is no trial 22 to begin with; the protocol has 1 to 21"
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("wanted", "recorded", "words"),
    [
        (range(1, 22), [1, 2, 3], "3 of 21 trials recorded in {}; the others: --first 4 and another --out; to go on"),
        (range(4, 22), [], "0 of 18 trials recorded in {}; the others: --first 4 and another --out"),
        (range(4, 6), [4, 5], "2 of 2 trials recorded in {}; to go on: misfit compare arm {}"),
    ],
)
def test_a_session_that_was_broken_off_says_which_trial_is_next(
    tmp_path: Path, wanted: range, recorded: list[int], words: str
) -> None:
    for number in recorded:
        (tmp_path / f"trial_{number:02d}.parquet").touch()
    document = {"cycles": 9, "rate_hz": 500.0, "missed": 0, "answers_late": 0, "frames_lost": 0, "faults": []}
    assert words.format(tmp_path, tmp_path) in said_of(document, wanted, tmp_path, True)
