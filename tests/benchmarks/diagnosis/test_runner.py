"""The runner of the benchmark: what crashes, hangs or is cut short, the order of cases, and recommended experiments."""

import os
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from orchestrator.measurements import load_measurements
from tests.benchmarks.diagnosis.child import Ended, run_child
from tests.benchmarks.diagnosis.earlier import commits, folders_of, keep_commit
from tests.benchmarks.diagnosis.suite import suite
from tests.benchmarks.diagnosis.truth.experiment import Advice, experiment_plan, write_with_experiment
from tests.benchmarks.diagnosis.truth.families import FAMILIES, Wish, draw_case
from tests.benchmarks.diagnosis.truth.library import EFFECTS
from tests.benchmarks.diagnosis.truth.machines import MACHINES
from tests.benchmarks.diagnosis.truth.run import run_trial
from tests.benchmarks.diagnosis.truth.write import write_case
from tests.benchmarks.diagnosis.workers import side_by_side


def halved(number: int) -> float:
    if number == 3:
        os._exit(7)  # as a crash of native code would
    return 12 / number


def lost(number: int, error: Exception) -> float:
    return -float(number)


def test_job_that_kills_its_process_and_one_that_raises_cost_no_other() -> None:
    found = list(side_by_side(halved, lost, [0, 1, 2, 3, 4], 1))

    assert found == [-0.0, 12.0, 6.0, -3.0, 3.0]


@pytest.mark.parametrize("busy", ["while True: pass", "import time; time.sleep(60)"])
def test_child_that_takes_too_long_is_stopped(busy: str, tmp_path: Path) -> None:
    ended = run_child([sys.executable, "-c", busy], 1.0, tmp_path / "log.txt")

    assert ended.code is None
    assert ended.cpu_s < 3


def test_commands_end_with_the_runner_that_was_killed(tmp_path: Path) -> None:
    said = tmp_path / "pid.txt"
    command = f"import os, time; open({str(said)!r}, 'w').write(str(os.getpid())); time.sleep(60)"
    program = (
        "from tests.benchmarks.diagnosis.workers import side_by_side\n"
        f"import sys; sys.path.insert(0, {str(Path(__file__).parent)!r})\n"
        "from test_runner import in_a_child\n"
        f"list(side_by_side(in_a_child, print, [{command!r}], 1))\n"
    )
    with subprocess.Popen([sys.executable, "-c", program]) as runner:
        _wait_until(lambda: said.exists() and bool(said.read_text()), 120.0)
        runner.kill()

    _wait_until(lambda: not Path(f"/proc/{said.read_text()}").exists(), 30.0)


def in_a_child(script: str) -> Ended:
    with tempfile.TemporaryDirectory() as folder:
        return run_child([sys.executable, "-c", script], 60.0, Path(folder) / "log.txt")


def _wait_until(is_so: Callable[[], bool], limit_s: float) -> None:
    end = time.monotonic() + limit_s
    while not is_so():
        assert time.monotonic() < end
        time.sleep(0.1)


def test_child_reports_what_it_said_how_it_ended_and_what_it_used(tmp_path: Path) -> None:
    script = "import sys; x = bytes(range(256)) * 400_000; print('said'); sys.exit(3)"

    ended = run_child([sys.executable, "-c", script], 60.0, tmp_path / "log.txt")

    assert (ended.code, ended.said) == (3, "said")
    assert ended.peak_mb > 100  # the string alone has 102 million bytes
    assert 0 < ended.cpu_s < 60


@pytest.mark.parametrize("size", ["medium", "full"])
def test_half_of_a_run_holds_about_half_of_every_family_machine_and_cell(size: str) -> None:
    wishes = suite(size)
    for key in (
        lambda wish: (wish.family, wish.enr is None),
        lambda wish: wish.machine,
        lambda wish: (wish.enr, wish.seconds),
    ):
        whole, half = Counter(map(key, wishes)), Counter(map(key, wishes[: len(wishes) // 2]))
        for kind, n in whole.items():
            assert abs(half[kind] - n / 2) <= max(2, 0.05 * n)
    assert len({wish.name for wish in wishes}) == len(wishes)
    assert {wish.family for wish in wishes} >= set(FAMILIES) - {"T"}


def test_finished_cases_of_another_commit_are_kept_and_told_apart(tmp_path: Path) -> None:
    old, new = tmp_path / "old", tmp_path / "new"
    keep_commit(old, "aaa1111")
    keep_commit(new, "bbb2222")
    done, begun, untouched = (Wish("N0", "drive", k, 3) for k in range(3))
    for kind, wish in (("results", done), ("baselines", done), ("results", begun)):
        (old / kind).mkdir(exist_ok=True)
        (old / kind / f"{wish.name}.json").write_text("{}")

    folders = folders_of([done, begun, untouched], new, [old])

    assert [folders[wish.name] for wish in (done, begun, untouched)] == [old, new, new]
    assert commits(list(folders.values()), new) == "bbb2222 (2 cases; 1 of aaa1111)"
    assert commits([new], new) == "bbb2222"


def test_no_effect_of_a_library_is_drawn_much_more_often_than_another() -> None:
    """Those of one machine only come up less; those of all machines share the rest."""
    drawn = Counter(wish.effects[0] for wish in suite("medium") if wish.family == "S")

    everywhere = set.intersection(*(set(EFFECTS[name]) for name in MACHINES if name != "tanks"))
    counts = [drawn[name] for name in everywhere]
    assert max(counts) - min(counts) <= 2
    assert set(drawn) == {name for library in EFFECTS.values() for name in library}


def test_recommended_inputs_act_on_the_true_machine_from_rest_where_the_first_trial_began(tmp_path: Path) -> None:
    """A constant torque on a free drive: q = q0 + torque t^2 / (2 J), whatever friction is not there."""
    case = draw_case(Wish("N0", "drive", 0, 3, noise="lo", seconds=2.0))
    table = tmp_path / "next.csv"
    table.write_text("time,torque\n0,0.01\n1.5,0.01\n")
    first = run_trial(case.machine, case.plans[0]).q[0, 0]

    write_with_experiment(case, tmp_path / "case", Advice(table, repeat=False))

    again = load_measurements(tmp_path / "case")
    extra = np.genfromtxt(tmp_path / "case" / "trial_07.csv", delimiter=",", names=True)
    expected = first + 0.01 * extra["time"] ** 2 / (2 * MACHINES["drive"].values["J"])
    assert [t.subset for t in again.trials] == [*["learning"] * 4, *["held_out"] * 2, "learning"]
    assert extra["time"][-1] == pytest.approx(1.5, abs=0.005)
    np.testing.assert_allclose(extra["phi"], expected, atol=8 * case.recorder.output_noise)


def test_case_with_an_experiment_is_otherwise_the_case(tmp_path: Path) -> None:
    case = draw_case(Wish("S", "pendulum", 0, 3, noise="mid", seconds=2.0))
    write_case(case, tmp_path / "case")

    write_with_experiment(case, tmp_path / "again", Advice(tmp_path / "none.csv", repeat=True))

    for number in range(1, 7):
        name = f"trial_{number:02d}.csv"
        assert (tmp_path / "case" / name).read_bytes() == (tmp_path / "again" / name).read_bytes()
    first, repeated = (
        np.genfromtxt(tmp_path / "again" / f"trial_{number:02d}.csv", delimiter=",", names=True)["theta"]
        for number in (1, 7)
    )
    assert 0 < np.std(first - repeated) < 3 * case.recorder.output_noise


def test_pendulum_is_let_go_at_rest_as_far_from_its_middle_as_advised(tmp_path: Path) -> None:
    case = draw_case(Wish("N0", "pendulum", 0, 3, noise="mid", seconds=2.0))
    table = tmp_path / "next.csv"
    table.write_text("time\n0\n1\n")
    learned = [run_trial(case.machine, plan).q[:, 0] for plan in case.plans[:4]]
    middle = np.concatenate(learned).mean()

    plan = experiment_plan(case, Advice(table, repeat=False, start_scale=0.5, start_offset=0.2))

    assert plan.q0[0] - middle == pytest.approx(0.5 * (learned[0][0] - middle) + 0.2)
    assert run_trial(case.machine, replace(plan)).v[0, 0] == 0.0
