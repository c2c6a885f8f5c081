"""Checks of whole models: each passes on a model that has the property and fails on one that lacks it."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from cases_of_balls import case_file, fmu
from odd_fmus import odd_fmu, plain_fmu

from orchestrator.cosim.fmu import read_description
from orchestrator.regress.case_file import read_cases
from orchestrator.regress.execute import execute
from orchestrator.regress.outcome import WholeVerdict
from orchestrator.regress.release import interface_change


def _found(folder: Path, text: str) -> dict[str, WholeVerdict]:
    (case,) = read_cases(case_file(folder, "whole", text))
    outcome = execute(case)
    json.dumps(outcome.to_json(), allow_nan=False)
    assert outcome.verdict != "error", outcome.reason
    return {each.check: each for each in outcome.wholes}


def test_a_sound_fmu_passes_every_check(tmp_path: Path) -> None:
    fmu(tmp_path, "ball")

    found = _found(
        tmp_path,
        """
        model = "ball.fmu"
        reference = "none"
        run = { stop = 2.0, step = 0.01 }
        [checks]
        determinism = true
        save_restore = true
        convergence = { within = 0.5 }
        release = "ball.fmu"
        speed = { fmu = "ball.fmu", at_most = 5.0, runs = 3 }
        """,
    )

    assert {name: each.passed for name, each in found.items()} == dict.fromkeys(
        ("determinism", "save_restore", "convergence", "release", "speed"), True
    ), found
    assert found["release"].figures["level"] == "patch"
    assert 0.2 < found["speed"].figures["time_ratio"] < 5.0


def test_a_random_output_is_no_deterministic_one(tmp_path: Path) -> None:
    odd_fmu(tmp_path, "random")

    found = _found(
        tmp_path,
        'model = "random.fmu"\nrun = { stop = 0.9, step = 0.01 }\nreference = "none"\nchecks = { determinism = true }',
    )

    assert not found["determinism"].passed
    assert "y parts at 0.5" in found["determinism"].reason


def test_a_library_that_remembers_earlier_runs_is_no_deterministic_one(tmp_path: Path) -> None:
    odd_fmu(tmp_path, "static")

    found = _found(
        tmp_path,
        'model = "static.fmu"\nrun = { stop = 0.9, step = 0.01 }\nreference = "none"\nchecks = { determinism = true }',
    )

    assert "the second run in one process differs" in found["determinism"].reason


def test_an_fmu_that_forgets_part_of_its_state_does_not_come_back_to_it(tmp_path: Path) -> None:
    odd_fmu(tmp_path, "forgetful")

    found = _found(
        tmp_path,
        'model = "forgetful.fmu"\nrun = { stop = 0.9, step = 0.01 }\nreference = "none"\nchecks = { save_restore = true }',
    )

    assert not found["save_restore"].passed
    assert "y parts at" in found["save_restore"].reason


def test_an_fmu_without_states_to_save_says_so(tmp_path: Path) -> None:
    plain_fmu(tmp_path)

    found = _found(
        tmp_path,
        'model = "none.fmu"\nrun = { stop = 0.9, step = 0.01 }\nreference = "none"\nchecks = { save_restore = true }',
    )

    assert found["save_restore"].reason == "none cannot save the state"


def test_the_order_of_a_held_sine_is_one(tmp_path: Path) -> None:
    """An input that is held over each step makes an error in proportion to the step."""
    fmu(tmp_path, "decay")

    found = _found(
        tmp_path,
        """
        model = "decay.fmu"
        reference = "none"
        run = { stop = 2.0, step = 0.02, interface = "CoSimulation" }
        inputs = { u = { kind = "sine", amplitude = 1.0, frequency = 1.0 } }
        checks = { convergence = { halvings = 3, within = 1e-4 } }
        """,
    )

    assert found["convergence"].figures["x"]["order"] == pytest.approx(1.0, abs=0.1)
    assert not found["convergence"].passed and "at most 0.0001 is allowed" in found["convergence"].reason


@pytest.mark.parametrize(
    ("change", "level", "words"),
    [
        ({}, "patch", ""),
        ({'name="k"': 'name="rate"'}, "major", "k"),
        ({'<Real start="1"/>': '<Real start="2"/>'}, "minor", "k: 1 before, 2 now"),
        (
            {'name="u" valueReference="2" causality="input"': 'name="u" valueReference="2" causality="local"'},
            "major",
            "u",
        ),
        ({'unit="s"': ""}, "major", "longest: one side has no unit"),
    ],
)
def test_a_change_of_the_interface_asks_for_a_version(
    change: dict[str, str], level: str, words: str, tmp_path: Path
) -> None:
    old = read_description(fmu(tmp_path, "decay", to="old"))
    new = read_description(fmu(tmp_path, "decay", to="new", replace=change))

    found = interface_change(old, new)

    assert found.level == level
    assert words in " ".join((*found.breaking, *found.compatible))


def test_conformance_is_what_validate_finds(tmp_path: Path) -> None:
    path = fmu(tmp_path, "decay")
    (case,) = read_cases(
        case_file(tmp_path, "c", 'model = "decay.fmu"\nreference = "none"\n[checks]\nconformance = true\n')
    )
    findings = {each.check: each for each in execute(case).wholes}["conformance"]
    accepting = replace(case, checks={"conformance": {"accept": ("",)}})

    assert path.exists()
    assert {each.check: each.passed for each in execute(accepting).wholes} == {"conformance": True}
    assert findings.passed == (not findings.figures["findings"])
