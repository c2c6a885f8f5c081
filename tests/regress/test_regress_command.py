"""`misfit regress`: verdicts, exit codes, files."""

import json
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import numpy as np
from cases_of_balls import case_file, decay_reference, fmu, misfit
from junit_rules import junit_problems

from orchestrator.regress.case_file import read_cases
from orchestrator.regress.collect import collect
from orchestrator.regress.comparison import Signal
from orchestrator.regress.execute import execute
from orchestrator.regress.junit import annotations, junit
from orchestrator.regress.outcome import Outcome, exit_code
from orchestrator.regress.update import update_references

DECAY = 'model = "decay.fmu"\nreference = "exact.csv"\n[run]\nstop = 2.0\nstep = 0.01\n'


def _team(folder: Path) -> None:
    """A case that passes, one that fails, one that cannot be run."""
    fmu(folder, "decay")
    decay_reference(folder / "exact.csv")
    case_file(folder, "good", DECAY)
    case_file(folder, "bad", DECAY + "[parameters]\nk = 1.1\n")
    case_file(folder, "broken", DECAY + "[parameters]\nkk = 1.1\n")


def test_a_command_judges_every_case_and_writes_what_ci_reads(tmp_path: Path) -> None:
    _team(tmp_path)

    done = misfit(
        "--json", "r.json", "--junit", "r.xml", "--html", "r.html", "--github", "--workers", 1, folder=tmp_path
    )

    document = json.loads((tmp_path / "r.json").read_text())
    assert done.returncode == 1
    assert document["schema"] == "misfit.regress/1"
    assert {case["name"]: case["verdict"] for case in document["cases"]} == {
        "good": "passed",
        "bad": "failed",
        "broken": "error",
    }
    found = next(case for case in document["cases"] if case["name"] == "bad")["signals"]["x"]
    # exp(-t) - exp(-1.1 t) is largest where 1.1 exp(-1.1 t) = exp(-t), at t = 10 ln 1.1.
    assert abs(found["worst_time"] - 10 * np.log(1.1)) < 0.01
    assert junit_problems((tmp_path / "r.xml").read_text()) == []
    assert "::error file=bad.regress.toml" in done.stderr
    assert "did you mean" in done.stdout and "Traceback" not in done.stdout + done.stderr
    page = (tmp_path / "r.html").read_text()
    assert "2 of 3 cases did not pass" in page and page.count("<img") == 1


def test_a_path_that_holds_no_cases_is_wrong_usage(tmp_path: Path) -> None:
    done = misfit(folder=tmp_path)

    assert done.returncode == 2
    assert "holds no cases" in done.stderr


def test_exit_codes_put_a_difference_before_a_component_before_a_wrong_case() -> None:
    passed, failed = Outcome("a", "f", "passed"), Outcome("b", "f", "failed", "off")
    crashed = Outcome("c", "f", "error", "crashed", "component")
    wrong = Outcome("d", "f", "error", "no file", "input")

    assert [exit_code(each) for each in ([passed], [passed, wrong], [crashed, wrong], [crashed, failed])] == [
        0,
        2,
        3,
        1,
    ]


def test_an_update_writes_the_result_and_says_what_changed(tmp_path: Path) -> None:
    _team(tmp_path)
    (case,) = read_cases(tmp_path / "bad.regress.toml")
    before = execute(case, want="signals")

    (after,), lines = update_references([case], [before])

    assert before.verdict == "failed" and after.verdict == "passed"
    assert any("is off by" in line for line in lines)
    assert execute(case).verdict == "passed"
    (good,) = read_cases(tmp_path / "good.regress.toml")
    assert execute(good).verdict == "failed"


def test_an_update_never_writes_what_is_no_number_or_what_two_cases_share(tmp_path: Path) -> None:
    _team(tmp_path)
    (case,) = read_cases(tmp_path / "bad.regress.toml")
    outcome = execute(case, want="signals")
    old = (tmp_path / "exact.csv").read_bytes()
    kept = outcome.signals_kept["x"]
    damaged = replace(outcome, signals_kept={"x": Signal("x", kept.time, np.full(len(kept.time), np.nan))})

    (still,), lines = update_references([case], [damaged])
    (shared, _), more = update_references(
        [case, replace(case, name="other")], [outcome, Outcome("other", "f", "passed")]
    )

    assert still.verdict == shared.verdict == "failed"
    assert "values that are no numbers" in lines[0] and "2 cases have the reference" in more[0]
    assert (tmp_path / "exact.csv").read_bytes() == old


def test_a_case_without_a_reference_gets_one_beside_its_file(tmp_path: Path) -> None:
    fmu(tmp_path, "decay")
    path = case_file(tmp_path, "new", 'model = "decay.fmu"\n[run]\nstop = 1.0\n')
    (case,) = read_cases(path)

    assert "does not exist" in execute(case).reason
    update_references([case], [execute(case, want="signals")])

    (again,) = read_cases(path)
    assert execute(again).verdict == "passed"
    np.testing.assert_allclose(execute(again, want="signals").signals_kept["x"].values[-1], np.exp(-1.0), rtol=1e-9)


def test_an_update_gives_a_reference_to_a_case_that_had_none_and_leaves_laws_alone(tmp_path: Path) -> None:
    fmu(tmp_path, "decay")
    text = 'model = "decay.fmu"\n[run]\nstop = 1.0\n[checks]\ndeterminism = true\n'
    (case,) = read_cases(case_file(tmp_path, "new", text))
    law = "[[signals.x]]\n[[signals.x]]\ncheck = 'bounds'\nlower = 0.9\n"
    (lawful,) = read_cases(case_file(tmp_path, "law", text + law))

    _, lines = update_references([case, lawful], [execute(each, want="signals") for each in (case, lawful)])

    assert execute(case).verdict == "passed" and (tmp_path / "new_ref.csv").exists()
    assert not (tmp_path / "law_ref.csv").exists()
    assert any("a reference does not mend bounds" in line for line in lines)


def test_an_output_that_only_one_side_has_is_a_difference(tmp_path: Path) -> None:
    _team(tmp_path)
    (case,) = read_cases(tmp_path / "good.regress.toml")
    rows = (tmp_path / "exact.csv").read_text().splitlines()
    (tmp_path / "exact.csv").write_text("\n".join([f"{rows[0]},z", *(f"{row},0.0" for row in rows[1:])]))
    lacking = execute(case)
    (tmp_path / "exact.csv").write_text("\n".join(row.replace("x", "z") for row in rows))
    extra = execute(case)

    assert "the model has no variable 'z'" in lacking.reason
    assert any("has no signal 'x'" in each.reason for each in extra.signals)


def test_results_of_the_cross_check_habit_are_cases(tmp_path: Path) -> None:
    path = fmu(tmp_path, "decay")
    (tmp_path / "decay_ref.opt").write_text("StartTime, 0.0\nStopTime, 2.0\nStepSize, 0.01\nRelTol, 1e-5\n")
    (tmp_path / "decay_in.csv").write_text('"time","u"\n0.0,0.0\n2.0,0.0\n')
    decay_reference(tmp_path / "decay_ref.csv")

    (case,), _ = collect([path])

    assert (case.stop, case.step, case.solver_tolerance) == (2.0, 0.01, 1e-5)
    assert execute(case).verdict == "passed"


def test_the_schema_refuses_what_is_no_junit() -> None:
    good = junit([Outcome("a", "f", "passed")])

    assert junit_problems(good) == []
    assert junit_problems(good.replace('classname="f"', "")) and junit_problems(good.replace('tests="1"', 'tests="2"'))


def test_junit_and_annotations_stand_any_text() -> None:
    nasty = Outcome("a<b>&\x00\x1b", "m,odels/ä:1.toml", "failed", 'is "off"\n% by \ud800 <2>')

    text = junit([nasty])

    assert junit_problems(text) == []
    assert ET.fromstring(text).find("testsuite/testcase/failure") is not None
    (line,) = annotations([nasty], Path())
    assert "\n" not in line and line.startswith("::error file=m%2Codels/ä%3A1.toml")


def test_a_reference_with_thousands_of_columns_that_are_gone_is_told_shortly(tmp_path: Path) -> None:
    """A line for each is for the JSON; what a missing name may have been called is looked for a few times, since that takes long."""
    fmu(tmp_path, "decay")
    gone = [f"v{k}" for k in range(3000)]
    rows = [["time", "x", *gone], *([str(t), "1", *["0"] * len(gone)] for t in (0.0, 0.1))]
    (tmp_path / "wide.csv").write_text("\n".join(",".join(row) for row in rows))
    case_file(tmp_path, "wide", 'model = "decay.fmu"\nreference = "wide.csv"\n[run]\nstop = 0.1\nstep = 0.1\n')

    done = misfit("--json", "all.json", folder=tmp_path)

    assert done.returncode == 1 and len(done.stdout.splitlines()) < 30 and "more; --json F has them all" in done.stdout
    (case,) = json.loads((tmp_path / "all.json").read_text())["cases"]
    reasons = {name: each["reason"] for name, each in case["signals"].items()}
    assert all(f"no variable '{name}'" in reasons[name] for name in gone)
    assert sum("there are" in reasons[name] for name in gone) == 20
