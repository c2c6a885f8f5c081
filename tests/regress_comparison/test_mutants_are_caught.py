"""Mutation operators change what they say, and `misfit regress` catches a handful; the whole is a benchmark."""

import re

import pytest

from tests.benchmarks.regress.mutants.campaign import Campaign, Fate
from tests.benchmarks.regress.mutants.choose import OWN, Mutant, all_mutants, chosen_mutants, source_of
from tests.benchmarks.regress.mutants.operators import ALL_ROWS, changes_of
from tests.benchmarks.regress.mutants.report import Found, report
from tests.benchmarks.regress.mutants.subjects import SUBJECTS
from tests.benchmarks.regress.mutants.workshop import Workshop

MODEL = """model M "a - b is text, not code"
  parameter SI.Length d = 2.5 "Length, 3 m";
  parameter SI.Area a[2] = {1, 2};
  SI.Length x(start=0.3, fixed=true) "Level";
equation
  // y = x - 1
  y = if x > 1 then a[1]*x - d else max(0, x^2);
  z = delay(x, T, 0.2);
  annotation (Documentation(info="<html>a + b</html>"));
end M;
"""


def mutated(row: str) -> set[str]:
    """The changed lines of a row, without blanks at their ends."""
    changes = [change for change in changes_of(MODEL, ["y"]) if change.row == row]
    return {change.apply(MODEL).splitlines()[change.line].strip() for change in changes}


def test_operators_change_code_and_nothing_else() -> None:
    original = MODEL.splitlines()

    for change in changes_of(MODEL, ["y"]):
        lines = change.apply(MODEL).splitlines()
        assert [k for k in range(len(lines)) if lines[k] != original[k]] == [change.line]
        assert re.match(r"\s*(parameter|SI|y|z)", original[change.line])


@pytest.mark.parametrize(
    ("row", "line"),
    [
        ("parameter", 'parameter SI.Length d = (-2.5) "Length, 3 m";'),
        ("parameter", "parameter SI.Area a[2] = {2, 1};"),
        ("unit", 'parameter SI.Length d = 2500 "Length, 3 m";'),
        ("sign", "y = if x > 1 then a[1]*x + d else max(0, x^2);"),
        ("term", "y = if x > 1 then a[1]*x else max(0, x^2);"),
        ("term", "y = if x > 1 then a[1]*x - d else max(0, x);"),
        ("relation", "y = if x >= 1 then a[1]*x - d else max(0, x^2);"),
        ("relation", "y = if false then a[1]*x - d else max(0, x^2);"),
        ("limit", "y = if x > 1 then a[1]*x - d else (x^2);"),
        ("delay", "z = x;"),
        ("frame", "y = if x > 1 then a[2]*x - d else max(0, x^2);"),
        ("initial value", 'SI.Length x(start=0.35, fixed=true) "Level";'),
        ("signal", "y = -(if x > 1 then a[1]*x - d else max(0, x^2));"),
    ],
)
def test_each_row_has_its_mutants(row: str, line: str) -> None:
    assert line in mutated(row)


def test_every_row_finds_places_in_the_models() -> None:
    found = {mutant.change.row for subject in SUBJECTS.values() for mutant in all_mutants(subject)}

    assert found == set(ALL_ROWS)


@pytest.mark.parametrize("name", SUBJECTS)
def test_the_same_mutants_are_chosen_each_time(name: str) -> None:
    chosen = chosen_mutants(SUBJECTS[name], 3)

    assert [mutant.name for mutant in chosen] == [mutant.name for mutant in chosen_mutants(SUBJECTS[name], 3)]
    assert len({mutant.name for mutant in chosen}) == len(chosen)


def pick(file: str, row: str, text: str) -> Mutant:
    """The mutant of the tanks with this change in one of its lines."""
    tanks = SUBJECTS["LeakyTanks"]
    for mutant in all_mutants(tanks):
        line = mutant.change.apply(source_of(tanks, mutant.file)).splitlines()[mutant.change.line]
        if mutant.file == file and mutant.change.row == row and text in line:
            return mutant
    raise LookupError(text)


def test_changes_of_the_tanks_are_caught_and_what_no_tolerance_sees_is_not(tmp_path) -> None:
    mutants = {
        "killed": pick("Plants/TwoTanks.mo", "parameter", "A1 = (0.01575)"),
        "equivalent": pick("Plants/TwoTanks.mo", "parameter", "hSmall = (0.000105)"),
        "invalid": pick("Plants/TwoTanks.mo", "term", "sqrt(2*g)*level1/sqrt(sqrt(level1 + hSmall^2))"),
    }
    campaign = Campaign(SUBJECTS["LeakyTanks"], tmp_path / "tanks", Workshop.open(tmp_path / "workshop"))
    campaign.prepare()

    campaign.run(list(mutants.values()))

    assert {state: campaign.fates[mutant.name].state for state, mutant in mutants.items()} == {
        state: state for state in mutants
    }
    killed = campaign.fates[mutants["killed"].name]
    # 5 % more area raises the level slower by about as much.
    assert killed.verdict == "failed" and killed.reason.startswith("h1: is off by") and killed.effect > 10
    again = Campaign(campaign.subject, campaign.folder, campaign.workshop)
    assert again.fates == campaign.fates


def fate(state: str, verdict: str = "failed", effect: float | None = 5.0) -> Fate:
    return Fate(f"m-{state}", "ServoDrive", "sign", OWN, 1, "+ became -", "x", state, effect, verdict, "why")


def test_the_score_counts_only_what_exceeds_the_tolerance() -> None:
    fates = (*[fate("killed")] * 99, fate("survived", "passed"), fate("equivalent", "passed", 0.5), fate("invalid"))
    rebuilds = {"ServoDrive": {f"gcc-O0-{k}": {"verdict": "passed", "reason": ""} for k in range(200)}}

    found = Found(fates * 2, 204, rebuilds)

    assert found.score == 0.99 and found.meets_targets
    assert "198 caught and 2 not (99.0 %)" in report(found) and "0 false alarms on 200 rebuilds" in found.summary
    assert not Found((*fates, fate("survived", "passed")) * 2, 206, rebuilds).meets_targets
    assert not Found(fates, 102, rebuilds).meets_targets


def test_a_difference_seen_below_the_tolerance_and_a_failed_rebuild_are_reported() -> None:
    rebuilds = {"ServoDrive": {"clang-O2-1e-06-1": {"verdict": "failed", "reason": "phi: is off"}}}

    page = report(Found((fate("equivalent", "failed", 0.9),), 1, rebuilds))

    assert "1 of them called different" in page and "ServoDrive clang-O2-1e-06-1: phi: is off" in page
