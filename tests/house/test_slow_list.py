"""The list of slow tests names tests that exist, and `make test` and `make test-all` leave out and run what they say."""

import re
from pathlib import Path

import pytest

from tests.slow import FIRST, SLOW, is_slow, turn

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("beginning", SLOW)
def test_each_entry_names_a_test_that_exists_and_what_guards_its_promise(beginning: str) -> None:
    file, _, name = beginning.partition("::")

    assert (ROOT / file).is_file()
    assert f"def {name.partition('[')[0]}" in (ROOT / file).read_text()
    assert is_slow(beginning) and SLOW[beginning]


def test_what_is_slow_runs_in_test_all_and_in_continuous_integration() -> None:
    makefile, pipeline = (ROOT / "Makefile").read_text(), (ROOT / ".ci" / "run").read_text()
    recipes = dict(re.findall(r"^([\w-]+): setup\n\t(.*)$", makefile, re.MULTILINE))

    assert '-m "not slow"' in recipes["test"]
    assert "-m" not in recipes["test-all"].replace("-m pytest", "")
    assert "-m slow" in recipes["test-slow"]
    assert [line for line in ("make check", "make test", "make bench-smoke") if line not in pipeline.splitlines()] == []
    assert "make test-slow" in pipeline


def test_the_files_that_take_longest_are_there_and_begin_first() -> None:
    assert all((ROOT / file).is_file() for file in FIRST)
    assert turn(f"{FIRST[1]}::test_one") < turn("tests/gp/test_fit.py::test_another")
