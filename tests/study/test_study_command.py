"""`misfit study caregivers` as people run it, with one caregiver."""

import json
import re
import subprocess
from pathlib import Path

import pytest

from orchestrator.study.muscles import MUSCLES
from tests.in_process import misfit_here as misfit

SMALL = ("study", "caregivers", "--caregivers", "1", "--seeds", "1", "--draws", "2", "--workers", "1")


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> tuple[subprocess.CompletedProcess[str], Path]:
    folder = tmp_path_factory.mktemp("study")
    return misfit(*SMALL, "--json", folder / "s.json", "--html", folder / "s.html"), folder


def test_study_writes_the_documented_json(done: tuple[subprocess.CompletedProcess[str], Path]) -> None:
    result, folder = done
    assert result.returncode == 0, result.stderr
    document = json.loads((folder / "s.json").read_text())

    assert document["schema"] == "misfit.study/1"
    assert document["draws"] == 2
    assert document["corrections"]["n"] == 84
    assert {"slope", "r2"} <= set(document["corrections"])
    assert set(document["improvement"]) == set(MUSCLES)
    assert set(document["improvement"]["biceps"]) == {"50", "84"}
    assert {"mean", "se"} <= set(document["improvement"]["biceps"]["50"])
    assert document["published"]["improvement"]["posterior deltoid"] == 43.0
    assert document["seconds"] > 0.0


def test_all_corrections_are_no_draw_so_they_have_no_standard_error(
    done: tuple[subprocess.CompletedProcess[str], Path],
) -> None:
    improvement = json.loads((done[1] / "s.json").read_text())["improvement"]

    assert all(sizes["84"]["se"] == 0.0 < sizes["50"]["se"] for sizes in improvement.values())


def test_both_figures_and_what_was_not_met_are_in_the_report(
    done: tuple[subprocess.CompletedProcess[str], Path],
) -> None:
    result, folder = done
    page, bars = (folder / "s.html").read_text(), json.loads((folder / "s.json").read_text())["bars"]

    assert page.count("<img") == 2
    assert 'src="http' not in page
    assert page.count("NOT met") == sum(not bar["met"] for bar in bars)
    assert re.search("published", result.stdout)


def test_no_draws_are_refused_in_one_line() -> None:
    refused = misfit("study", "caregivers", "--draws", "1")

    assert refused.returncode == 2
    assert "--draws" in refused.stderr
    assert "Traceback" not in refused.stderr


def test_a_scheduler_that_does_not_answer_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("orchestrator.cluster.ANSWER_S", 0.2)
    refused = misfit(*SMALL, "--scheduler", "tcp://127.0.0.1:1")

    assert refused.returncode == 2
    assert "tcp://127.0.0.1:1" in refused.stderr
    assert "Traceback" not in refused.stderr
