"""The report of the benchmark: written whole, from nothing, from failures, and from answers."""

import re
from pathlib import Path

import pytest

from tests.benchmarks.diagnosis.cases import TIME_IS_UP, Done
from tests.benchmarks.diagnosis.report import About, write_report
from tests.benchmarks.diagnosis.test_scoring import answer, row_of, truth

RIGHT = row_of("right", truth("viscous_friction"), answer("viscous_friction"))
WRONG = row_of("wrong", truth("cogging", wanted_enr=3.0), answer("tremor"))
FAILED = row_of("failed", truth(family="N0"), {"failed": "a traceback\nValueError: no"})
NAMED = {"LASSO": {"effects": ["viscous_friction"], "ranking": ["viscous_friction"]}}


def written(done: list[Done], folder: Path) -> str:
    about = About("tiny", 20, 7, "abcdef", 2, 240.0, 60.0, 12.0)
    page = folder / "diagnosis.md"

    write_report(done, about, page, folder / "scores.json")

    text = page.read_text()
    for picture in re.findall(r"\]\((.+?)\)", text):
        assert (folder / picture).stat().st_size > 1000
    return text


@pytest.mark.parametrize("done", [[], [Done("late", None, why=TIME_IS_UP)]])
def test_run_without_a_case_is_reported_as_such(done: list[Done], tmp_path: Path) -> None:
    text = written(done, tmp_path)

    assert "0 of 7 cases" in text
    assert "0 of 0 targets are met" in text


def test_missed_targets_failures_and_unmade_cases_are_told(tmp_path: Path) -> None:
    done = [
        Done("right", RIGHT, NAMED),
        Done("wrong", WRONG, NAMED),
        Done("failed", FAILED),
        Done("unmade", None, why="it left all bounds"),
    ]

    text = written(done, tmp_path)

    assert "* false alarm, nominal exactly (N0): 1/1 = 100 % (21-100), target at most 5 / 3 %" in text
    assert "| name | 1/1 = 100 % (21-100) | 85 / 93 % | aim met, not certain |" in text
    assert "* failed: ValueError: no" in text
    assert "* unmade: it left all bounds" in text
    assert "make bench-diagnosis SIZE=tiny SEED=20 WORKERS=2 BUDGET=60" in text
    assert text.count(".png") == 3
