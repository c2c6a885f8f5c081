"""The top of a report says how much the error fell, in words and numbers that can be checked by hand."""

from dataclasses import replace

import numpy as np
import pytest
from builders import comparison, diagnosis, entries

from orchestrator.report.arm_drawing import Replay
from orchestrator.report.html import comparison_report, discovery_report
from orchestrator.report.summary import comparison_facts, comparison_plain

pytestmark = pytest.mark.usefixtures("blank_pictures")


def test_comparison_names_the_signal_that_is_worst_against_its_own_noise() -> None:
    found = comparison(n=100)
    quiet = {"q1": 1e-5, "q2": 1e-3}

    assert comparison_facts(replace(found, noise_floor=quiet))[1].name == "Worst signal: q1"
    assert "held out the model misses" in comparison_plain(found)


def test_model_that_ran_away_has_words_too() -> None:
    found = comparison(n=100, n_held_out=0)
    lost = replace(found, learning=replace(found.learning, over_floor=np.inf))

    assert comparison_plain(lost) == "On the trials the model leaves the measurement altogether."


def moving() -> Replay:
    time = np.linspace(0, 1, 11)
    return Replay(time, np.column_stack([time, time]), np.column_stack([time, -time]))


def test_a_report_runs_the_script_of_its_replay_and_no_other() -> None:
    found = comparison(n=60, signals=("q1",), n_learning=1, n_held_out=1)
    plain, with_replay = comparison_report(found), comparison_report(found, moving())

    assert "<script" not in plain and "script-src" not in plain
    assert with_replay.count("<script") == 1
    assert "script-src &#39;sha256-" in with_replay or "script-src 'sha256-" in with_replay
    assert "unsafe-eval" not in with_replay


def test_everyone_reads_the_answer_before_the_first_table_of_the_report() -> None:
    found = diagnosis(n=60)
    page = discovery_report(found, entries(found), moving())

    assert (
        page.index("<h2>Coulomb friction at joint1")
        < page.index("Why do you think so?")
        < page.index("<h2>What is missing")
    )
    assert page.index("Why do you think so?") < page.index('alt="Error on held-out trials') < page.index("replayed")
