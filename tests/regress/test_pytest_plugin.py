"""`pytest models/`: the same cases as `misfit regress models/`, with -n, -k and --lf, and fixtures for tests of one's own."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from cases_of_balls import case_file, decay_reference, fmu

OWN = """
import numpy as np
import pytest

from fmus.errors import MisfitError


def test_decay_falls_as_it_should(misfit_run, misfit_compare):
    result = misfit_run("decay.fmu", stop=2.0, step=0.01, parameters={"k": 1.0})
    np.testing.assert_allclose(result["x"].values, np.exp(-result["x"].time), rtol=1e-9)
    misfit_compare(result, "exact.csv", absolute=1e-6, relative=0.0)
    some = misfit_run("decay.fmu", stop=1.0, step=0.01, inputs={"u": 2.0}, signals=["x", "u", "k"])
    assert set(some) == {"x", "u", "k"}
    assert (some["k"].values == 1.0).all() and (some["u"].values == 2.0).all()
    np.testing.assert_allclose(some["x"].values, 2.0 - np.exp(-some["x"].time))


def test_a_faster_decay_is_told_apart(misfit_run, misfit_compare):
    result = misfit_run("decay.fmu", stop=2.0, step=0.01, parameters={"k": 1.2})
    with pytest.raises(pytest.fail.Exception, match="is off by"):
        misfit_compare(result, "exact.csv")


def test_a_model_that_is_not_there_is_an_error(misfit_run):
    with pytest.raises(MisfitError, match="does not exist"):
        misfit_run("gone.fmu", stop=1.0)
"""
SEVERAL = """
model = "decay.fmu"
reference = "exact.csv"
run = { stop = 2.0, step = 0.01 }
[[case]]
name = "usual"
[[case]]
name = "fast"
tags = ["slow machine"]
parameters = { k = 1.2 }
[[case]]
name = "also usual"
"""


@pytest.fixture
def models(tmp_path: Path) -> Path:
    fmu(tmp_path, "decay")
    decay_reference(tmp_path / "exact.csv")
    case_file(tmp_path, "decay", SEVERAL)
    (tmp_path / "test_own.py").write_text(OWN)
    return tmp_path


def _pytest(folder: Path, *arguments: str) -> tuple[int, str]:
    # What coverage or xdist of the outer run put into the environment is not meant for this one.
    kept = {key: value for key, value in os.environ.items() if not key.startswith(("PYTEST", "COV"))}
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-rA", *arguments, "."],
        cwd=folder,
        env=kept,
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    return done.returncode, done.stdout


def test_cases_and_own_tests_run_on_two_processes(models: Path) -> None:
    code, text = _pytest(models, "-n", "2")

    assert code == 1
    assert "1 failed, 5 passed" in text
    assert "decay/fast failed" in text and "x: is off by" in text


def test_the_last_failure_alone_runs_again_and_a_word_chooses(models: Path) -> None:
    _pytest(models, "-k", "usual or fast")
    again, text = _pytest(models, "--lf")
    chosen, words = _pytest(models, "-k", "usual")

    assert again == 1 and "1 failed" in text and "passed" not in text.splitlines()[-1]
    assert chosen == 0 and "2 passed" in words


def test_a_case_file_that_is_wrong_is_an_error_of_collection(tmp_path: Path) -> None:
    case_file(tmp_path, "odd", "modle = 3")

    code, text = _pytest(tmp_path)

    assert code == 2
    assert "did you mean 'model'?" in text and "Traceback" not in text
