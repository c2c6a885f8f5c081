"""FMUs that crash, hang, are for other machines or give nonsense: the right verdict, the suite goes on, nothing is left."""

import os
import signal
import subprocess
import time
from dataclasses import replace
from pathlib import Path

import pytest
from cases_of_balls import MISFIT, case_file, decay_reference, fmu
from fault_table import FAULTS
from faulty import held, write_fmu
from odd_fmus import odd_fmu

from orchestrator.regress.case import Case
from orchestrator.regress.case_file import read_cases
from orchestrator.regress.collect import collect
from orchestrator.regress.outcome import exit_code
from orchestrator.regress.pool import Lane, run_cases

# y' = u = 1 from 0, so y = t.
RAMP = "time,y\n" + "\n".join(f"{k / 100!r},{k / 100!r}" for k in range(101)) + "\n"


def _case(folder: Path, path: Path, more: str = "") -> Case:
    (folder / "ramp.csv").write_text(RAMP)
    text = f'model = "{path.name}"\nreference = "ramp.csv"\n[run]\nstop = 1.0\nstep = 0.01\n{more}'
    return read_cases(case_file(folder, path.stem, text))[0]


@pytest.mark.parametrize(
    ("fault", "problem", "words"),
    [
        ("segmentation fault", "component", "FMU 'tank' crashed in step at t = 0.5 s: segmentation fault"),
        ("`abort()`", "component", "it said: solver: matrix is singular"),
        ("endless loop", "component", "patience_s in [limits] allows more"),
        ("`exit(0)`", "component", "ended its process in step at t = 0.5 s"),
        ("allocates and fills 10 GB", "component", "GiB of memory"),
        ("NaN output", "component", "nan"),
        ("status Error, with a message", "component", "the tank at 3 percent is empty"),
        ("instantiate returns NULL", "component", "could not be instantiated"),
        ("missing dependency library", "input", "which is not installed"),
        ("binary for another architecture", "input", "is built for aarch64"),
        ("none", "", ""),
    ],
)
def test_a_faulty_fmu_gets_the_right_verdict_in_words(fault: str, problem: str, words: str, tmp_path: Path) -> None:
    case = _case(tmp_path, write_fmu(tmp_path / "tank.fmu", FAULTS[fault]()))
    limits = replace(case.limits, memory_gib=0.5, patience_s=1.0 if fault == "endless loop" else 60.0)

    (outcome,) = run_cases([replace(case, limits=limits)])

    assert (outcome.verdict, outcome.problem) == ("error" if problem else "passed", problem), outcome.reason
    assert words in outcome.reason.lower() if fault == "NaN output" else words in outcome.reason


def test_a_suite_goes_on_after_crashes_and_leaves_nothing_behind(tmp_path: Path) -> None:
    crash, ball = write_fmu(tmp_path / "crash.fmu", FAULTS["segmentation fault"]()), fmu(tmp_path, "decay")
    decay_reference(tmp_path / "exact.csv")
    bad = [_case(tmp_path, crash)] * 2
    good = read_cases(
        case_file(tmp_path, "d", f'model = "{ball.name}"\nreference = "exact.csv"\nrun = {{ stop = 2.0, step = 0.01 }}')
    )
    before = held()

    outcomes = run_cases([bad[0], good[0], bad[1], good[0], good[0]], workers=2)

    assert [each.verdict for each in outcomes] == ["error", "passed", "error", "passed", "passed"]
    assert exit_code(outcomes) == 3
    assert held() == before


def test_a_case_that_passes_only_when_tried_again_has_failed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ODD_MARK", str(tmp_path / "mark"))
    case = _case(tmp_path, odd_fmu(tmp_path, "once"), "[limits]\nretries = 2\n")

    lane = Lane()
    outcome, after = lane.run(case), lane.run(case)
    lane.close()

    assert (outcome.verdict, outcome.flaky, outcome.attempts) == ("failed", True, 2)
    assert "flaky: attempt 1 of 2 did not pass" in outcome.reason and "crashed" in outcome.reason
    assert (after.verdict, after.attempts) == ("passed", 1)


def test_a_case_that_fails_each_time_says_how_often_it_was_tried(tmp_path: Path) -> None:
    case = _case(
        tmp_path, write_fmu(tmp_path / "t.fmu", FAULTS["instantiate returns NULL"]()), "[limits]\nretries = 1\n"
    )

    (outcome,) = run_cases([case])

    assert (outcome.verdict, outcome.flaky, outcome.attempts) == ("error", False, 2)


def test_a_run_that_never_pauses_is_stopped_by_the_limit_of_its_case(tmp_path: Path) -> None:
    case = _case(tmp_path, odd_fmu(tmp_path, "slow"), "[limits]\nseconds = 1.2\n")

    (outcome,) = run_cases([case])

    assert outcome.verdict == "error" and "took more than 1.2 s" in outcome.reason
    assert outcome.took_s < 10.0


def test_a_value_that_is_no_number_for_one_step_is_never_passed(tmp_path: Path) -> None:
    """The reference has a NaN in the same place, which many a tool takes for agreement."""
    case = _case(tmp_path, odd_fmu(tmp_path, "blink"))
    (tmp_path / "ramp.csv").write_text(RAMP.replace("0.5,0.5\n", "0.5,nan\n"))

    (outcome,) = run_cases([case])

    assert outcome.verdict in ("failed", "error")
    assert "nan" in outcome.reason.lower() or "no number" in outcome.reason


def test_a_file_that_is_no_fmu_and_a_case_that_is_no_toml_are_told_beside_the_others(tmp_path: Path) -> None:
    (tmp_path / "broken.fmu").write_bytes(b"this is no archive")
    (tmp_path / "odd.regress.toml").write_text("model = [")
    fmu(tmp_path, "decay")
    decay_reference(tmp_path / "decay_ref.csv")
    (tmp_path / "decay_ref.opt").write_text("StopTime, 2.0\nStepSize, 0.01\n")

    cases, wrong = collect([tmp_path])
    outcomes = [*wrong, *run_cases(cases)]

    assert {each.name: each.verdict for each in outcomes} == {
        "odd.regress.toml": "error",
        "broken": "error",
        "decay": "passed",
    }
    assert exit_code(outcomes) == 2


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_a_run_that_is_interrupted_leaves_no_process_behind(how: signal.Signals, tmp_path: Path) -> None:
    _case(tmp_path, odd_fmu(tmp_path, "slow"))
    host = subprocess.Popen(
        [MISFIT, "regress", ".", "--workers", "1"], cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    )
    worker = _eventually(lambda: _children(host.pid))
    assert worker

    host.send_signal(how)
    said = host.communicate(timeout=30)[0].decode()

    assert _eventually(lambda: not any(Path(f"/proc/{pid}").exists() for pid in worker))
    assert "Traceback" not in said
    assert host.returncode == (130 if how == signal.SIGINT else -signal.SIGKILL)


def test_what_an_fmu_has_started_ends_with_its_worker(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ODD_MARK", str(tmp_path / "mark"))
    case = _case(tmp_path, odd_fmu(tmp_path, "forks"))

    (outcome,) = run_cases([case])

    assert outcome.verdict == "passed", outcome.reason
    assert _eventually(lambda: not _marked(str(tmp_path / "mark")))


def _marked(mark: str) -> list[str]:
    """Other processes that have inherited a mark in their environment."""
    found = []
    for place in Path("/proc").glob("[0-9]*/environ"):
        try:
            text = place.read_bytes()
        except OSError:  # it has just ended, or is somebody else's
            continue
        if mark.encode() in text and place.parent.name != str(os.getpid()):
            found.append(place.parent.name)
    return found


def _children(pid: int) -> set[str]:
    """Processes that one has started, from any of its threads."""
    tasks = Path(f"/proc/{pid}/task")
    return {child for task in tasks.iterdir() for child in (task / "children").read_text().split()}


def _eventually(condition, seconds: float = 20.0):
    """Whether a condition holds within a time that even a busy machine keeps."""
    deadline = time.monotonic() + seconds
    while not (found := condition()) and time.monotonic() < deadline:
        time.sleep(0.05)
    return found


def test_links_that_lead_nowhere_and_pipes_stop_no_other_case(tmp_path: Path) -> None:
    """A folder is searched for cases: what cannot be read there is an error of its own, or no case at all."""
    (tmp_path / "loop.fmu").symlink_to("loop.fmu")
    (tmp_path / "gone.regress.toml").symlink_to("nowhere.toml")
    os.mkfifo(tmp_path / "pipe.fmu")

    cases, broken = collect([tmp_path])

    assert [case.name for case in cases] == ["loop"]
    assert [outcome.name for outcome in broken] == ["gone.regress.toml"] and "cannot be read" in broken[0].reason
