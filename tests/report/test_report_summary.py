"""The top of a report says how much the error fell, in words and numbers that can be checked by hand."""

from dataclasses import replace

import numpy as np
import pytest
from builders import comparison, diagnosis, entries

from orchestrator.arm_drawing import Replay
from orchestrator.report.html import comparison_report, discovery_report
from orchestrator.report.summary import (
    before_after,
    comparison_facts,
    comparison_plain,
    diagnosis_facts,
    diagnosis_plain,
)


def test_diagnosis_begins_with_the_error_before_and_after() -> None:
    found = diagnosis()
    floor = 0.001
    by_hand = [
        np.sqrt(np.mean([(error / floor) ** 2 for error in errors.values()]))
        for errors in (found.held_out.rmse_before, found.held_out.rmse_after)
    ]

    assert before_after(found) == pytest.approx(by_hand)
    assert [(fact.name, fact.value, fact.mood) for fact in diagnosis_facts(found)] == [
        ("Error as given", "40.2 times", "bad"),
        ("Error with the effects", "0.992 times", "good"),
        ("Removed", "97 %", ""),
        ("Chance", "p = 0.004", ""),
    ]
    assert "It lacks coulomb friction at joint1 and payload at wrist; with them added it is off by 0.992 times" in (
        diagnosis_plain(found)
    )


def test_nothing_is_said_of_effects_that_were_not_named() -> None:
    found = diagnosis("unknown")

    assert "It lacks" not in diagnosis_plain(found)
    assert "Error with the effects" not in [fact.name for fact in diagnosis_facts(found)]


def test_nothing_is_said_of_trials_that_were_not_held_out() -> None:
    found = diagnosis("cannot_tell", n_held_out=0, n=100)

    assert diagnosis_plain(found) == ""
    assert [fact.name for fact in diagnosis_facts(found)] == ["Chance"]


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


def test_everyone_reads_the_verdict_before_the_first_table() -> None:
    found = diagnosis(n=60)
    page = discovery_report(found, entries(found), moving())
    places = [page.index(f'class="{name}"') for name in ("verdict", "plain", "facts")]

    assert places == sorted(places)
    assert places[-1] < page.index('alt="Error on held-out trials') < page.index("replayed") < page.index("<table>")
