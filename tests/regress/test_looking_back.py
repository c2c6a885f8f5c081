"""History, trend, bisection and coverage."""

import json
import math
import shutil
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from cases_of_balls import case_file, fmu, misfit
from hypothesis import given
from hypothesis import strategies as st
from odd_fmus import odd_fmu, plain_fmu

from fmus.errors import MisfitError
from orchestrator.regress.bisect import bisect, numbered, versions_in
from orchestrator.regress.case import Case, Reference
from orchestrator.regress.case_file import read_cases
from orchestrator.regress.comparison import SignalVerdict
from orchestrator.regress.coverage import cover
from orchestrator.regress.execute import execute
from orchestrator.regress.history import append, read, trend_of, trend_page
from orchestrator.regress.outcome import Outcome
from orchestrator.regress.suggest import suggestions


def _outcome(exceed: float) -> Outcome:
    verdict = SignalVerdict("h", exceed <= 1.0, "as it was", exceed=exceed, would_have_passed=exceed)
    return Outcome(
        "ball", "ball.regress.toml", "passed" if exceed <= 1.0 else "failed", signals=(verdict,), seconds=0.1
    )


def test_a_history_only_grows_and_shows_a_drift_before_it_fails(tmp_path: Path) -> None:
    for day, exceed in enumerate((0.1, 0.4, 0.8), 1):
        append(tmp_path, [_outcome(exceed)], datetime(2026, 5, day, tzinfo=UTC))
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    append(tmp_path, [_outcome(math.inf)], datetime(2026, 5, 4, tzinfo=UTC))

    earlier = trend_of(read(tmp_path)[:-2])
    trend = trend_of(read(tmp_path))

    assert all((tmp_path / name).read_bytes() == content for name, content in before.items())
    assert [line.exceed for line in trend.lines] == [(0.1, 0.4, 0.8, math.inf)]
    assert trend.verdicts["ball"] == ("passed",) * 3 + ("failed",)
    assert [line.signal for line in earlier.drifting] == ["h"] and not trend.drifting
    assert json.loads(json.dumps(trend.to_json(), allow_nan=False))["signals"][0]["exceed"][-1] == "inf"
    assert "1 case over 4 runs" in trend_page(trend, str(tmp_path))
    assert pq.read_table(next(tmp_path.glob("*.parquet"))).num_rows == 2


def test_a_run_is_never_written_over(tmp_path: Path) -> None:
    now = datetime(2026, 5, 1, tzinfo=UTC)
    append(tmp_path, [_outcome(0.1)], now)

    with pytest.raises(MisfitError, match="never changed"):
        append(tmp_path, [_outcome(0.2)], now)


@given(st.lists(st.tuples(*[st.integers(0, 30)] * 3), unique=True, min_size=1))
def test_versions_sort_by_their_numbers(versions: list[tuple[int, int, int]]) -> None:
    names = ["ball-{}.{}.{}".format(*each) for each in versions]

    assert sorted(names, key=numbered) == ["ball-{}.{}.{}".format(*each) for each in sorted(versions)]


@given(st.integers(2, 40), st.data())
def test_bisection_finds_the_first_version_that_differs_in_a_logarithm_of_runs(count: int, data: st.DataObject) -> None:
    first = data.draw(st.integers(0, count))
    versions = [Path(f"ball-{k}.fmu") for k in range(count)]
    case = Case("ball", Path("ball.regress.toml"), "ball.fmu", reference=Reference("file", "ball_ref.csv"))

    def run(case: Case) -> Outcome:
        place = int(Path(case.model).stem.partition("-")[2])
        return Outcome("ball", "", "failed" if place >= first else "passed", "off")

    found = bisect(case, versions, run)

    assert found.first == (versions[first] if first < count else None)
    assert found.before == (versions[first - 1] if 0 < first < count else None)
    assert len(found.outcomes) <= 2 + count.bit_length()


def test_the_command_names_the_version_and_the_signal(tmp_path: Path) -> None:
    good, bad = plain_fmu(tmp_path), odd_fmu(tmp_path, "biased")
    versions = tmp_path / "versions"
    versions.mkdir()
    for minor in (8, 9, 10, 11):
        shutil.copy(bad if minor >= 10 else good, versions / f"tank-1.{minor}.fmu")
    case_file(
        tmp_path,
        "tank",
        'model = "none.fmu"\nrun = { stop = 0.9, step = 0.01 }\nreference = "none"\nchecks = { determinism = true }',
    )

    done = misfit("bisect", "versions", "tank.regress.toml", "--json", "b.json", folder=tmp_path)

    found = json.loads((tmp_path / "b.json").read_text())
    assert done.returncode == 1
    assert (found["first"], found["before"], found["signals"]) == ("tank-1.10.fmu", "tank-1.9.fmu", ["y"])
    assert "tank-1.10.fmu is the first that differs" in done.stdout
    assert versions_in(versions)[0].name == "tank-1.8.fmu"


def test_a_branch_that_no_case_takes_is_named_and_a_case_that_takes_it_is_proposed(tmp_path: Path) -> None:
    """A ball from 1 m meets the ground after sqrt(2/9.81) s = 0.4515 s; a run of 0.3 s never sees it."""
    fmu(tmp_path, "ball")
    (short,) = read_cases(case_file(tmp_path, "short", 'model = "ball.fmu"\nrun = { stop = 0.3, step = 0.01 }'))
    (longer,) = read_cases(case_file(tmp_path, "long", 'model = "ball.fmu"\nrun = { stop = 0.6, step = 0.01 }'))

    def run(cases: list[Case]) -> list[Outcome]:
        return [execute(case, want="coverage") for case in cases]

    (before,), (both,) = cover([short], run([short])), cover([short, longer], run([short, longer]))
    proposed = suggestions(before, run)

    assert "branch 1-" in before.goals and "branch 1-" not in both.goals
    assert before.states["h"] == pytest.approx((1.0 - 0.5 * 9.81 * 0.3**2, 1.0))
    assert {goal for each in proposed for goal in each.goals} >= {"branch 1-", "parameter g", "parameter e"}
    written = case_file(
        tmp_path, "more", 'model = "ball.fmu"\nrun = { step = 0.01 }\n' + "\n".join(p.text for p in proposed)
    )
    (after,) = cover(more := [short, *read_cases(written)], run(more))
    assert not after.goals


def test_suggested_inputs_stay_within_what_the_model_declares(tmp_path: Path) -> None:
    path = fmu(
        tmp_path,
        "decay",
        replace={
            'causality="input" variability="continuous"><Real start="0"/>': 'causality="input" variability="continuous"><Real start="0" min="-0.5" max="0.25"/>'
        },
    )
    case = Case("decay", tmp_path / "d.regress.toml", path.name, stop=2.0, step=0.01)

    (model,) = cover([case], [execute(case, want="coverage")])
    proposed = suggestions(model, lambda cases: [execute(each, want="coverage") for each in cases])

    driven = [wave for each in proposed for wave in each.inputs.values()]
    assert driven and all(-0.5 <= wave["to"] <= 0.25 for wave in driven)
    assert replace(model, inputs={"u": (0.0, 0.25)}).goals < model.goals
