"""Studies: every combination is run once, an interrupted study goes on, a crash costs one run."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from faulty import faulty_fmu
from small_fmus import small_fmu

from fmus.errors import MisfitError
from orchestrator.cosim import ComponentSpec, Connection, System
from orchestrator.cosim.run import RunOptions
from orchestrator.cosim.sweep import Study, cases_of, parse_values
from orchestrator.cosim.system import RunSettings

HERE = RunOptions(isolate=False)
GRID = {"mass.m": ["1 kg", "4000 g"], "spring.k": ["4", "9", "16"]}


def _pair() -> System:
    """A mass on a spring, released at 1 m: x = cos(sqrt(k/m) t)."""
    components = {name: ComponentSpec(name, source=str(small_fmu(name))) for name in ("mass", "spring")}
    links = (("mass.x", "spring.x2"), ("mass.v", "spring.v2"), ("spring.f2", "mass.fa"))
    settings = RunSettings(stop=1.0, step=1e-3)
    return System("pair", components, tuple(Connection(*ends) for ends in links), run=settings)


def test_a_study_is_one_data_set_with_every_combination(tmp_path: Path) -> None:
    outcome = Study(_pair(), cases_of(GRID), HERE, tmp_path / "study").run(workers=2)
    assert [run.failure for run in outcome.runs] == [""] * 6
    table = pq.read_table(tmp_path / "study").to_pandas()
    assert len(table) == 6 * 1001 and set(table["run"]) == set(range(6))
    ends = table[np.isclose(table["time"], 1.0)].set_index("run").sort_index()
    masses, stiffness = np.repeat([1.0, 4.0], 3), np.tile([4.0, 9.0, 16.0], 2)
    # Coupling in steps of 1 ms is first order: x is off by about k h t / (4 m) of its size.
    assert ends["mass.x"].to_numpy() == pytest.approx(np.cos(np.sqrt(stiffness / masses)), abs=5e-3)
    assert ends["spring.k"].tolist() == stiffness.tolist()
    index = pq.read_table(tmp_path / "study/_runs.parquet").to_pylist()
    assert [row["mass.x.last"] for row in index] == ends["mass.x"].tolist()


def test_a_study_that_is_done_is_not_done_again_and_another_is_refused(tmp_path: Path) -> None:
    study = Study(_pair(), cases_of(GRID), HERE, tmp_path)
    first = study.run()
    second = study.run()
    assert second.done_before == 6 and second.runs == first.runs
    with pytest.raises(MisfitError, match="holds another study"):
        replace(study, cases=cases_of({"mass.m": ["1"]})).run()
    with pytest.raises(MisfitError, match="holds another study"):
        replace(study, options=RunOptions(isolate=False, stop=2.0)).run()


KILLED = """
import os, sys
sys.path.insert(0, {tests!r})
from pathlib import Path
from test_sweep import GRID, HERE, _pair
from orchestrator.cosim.sweep import Study, cases_of
def stop(done, total):
    if done == 3:
        os.kill(os.getpid(), 9)
Study(_pair(), cases_of(GRID), HERE, Path({folder!r})).run(progress=stop)
"""


def test_a_killed_study_goes_on_where_it_was(tmp_path: Path) -> None:
    root = Path(__file__).parents[2]
    script = KILLED.format(tests=str(Path(__file__).parent), folder=str(tmp_path))
    done = subprocess.run(
        [sys.executable, "-c", script], env={**os.environ, "PYTHONPATH": str(root)}, cwd=root, check=False
    )
    assert done.returncode == -9
    outcome = Study(_pair(), cases_of(GRID), HERE, tmp_path).run()
    assert outcome.done_before == 3 and not outcome.failed
    assert pq.read_table(tmp_path).num_rows == 6 * 1001


def test_a_crash_of_a_trusted_fmu_costs_one_run(tmp_path: Path) -> None:
    fmus = {"tank": [str(faulty_fmu(tmp_path, fault)) for fault in ("none", "segfault", "none")]}
    fmus["tank"][2] = str(faulty_fmu(tmp_path, "open_file"))
    system = System(
        "tank", {"tank": ComponentSpec("tank", source=fmus["tank"][0])}, run=RunSettings(stop=1.0, step=0.01)
    )
    outcome = Study(system, cases_of({}, fmus=fmus), HERE, tmp_path / "study").run(workers=2)
    assert [run.failure == "" for run in outcome.runs] == [True, False, True]
    assert "FMU 'tank' crashed in step at t = 0.5 s: segmentation fault" in outcome.failed[0].failure
    rows = pq.read_table(tmp_path / "study").to_pandas().groupby("run").size()
    assert rows.tolist() == [101, 51, 101]


def test_a_cluster_gives_the_same_data_set(tmp_path: Path) -> None:
    from distributed import LocalCluster

    here, there = tmp_path / "here", tmp_path / "there"
    Study(_pair(), cases_of(GRID), HERE, here).run()
    with LocalCluster(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None) as cluster:
        outcome = Study(_pair(), cases_of(GRID), HERE, there).run(scheduler=cluster.scheduler_address)
    assert not outcome.failed
    assert pq.read_table(here).equals(pq.read_table(there))


def test_an_unusable_folder_or_value_is_refused(tmp_path: Path) -> None:
    (tmp_path / "letter.txt").write_text("mine")
    with pytest.raises(MisfitError, match="exists and is no study"):
        Study(_pair(), cases_of(GRID), HERE, tmp_path).run()
    for text, words in {
        "1,,2": "an empty place",
        "linspace(1,2,0)": "a count of 1",
        "linspace(1,2)": "cannot be read",
        "logspace(-1,2,3)": "positive ends",
    }.items():
        with pytest.raises(MisfitError, match=words):
            parse_values(text)
    with pytest.raises(MisfitError, match="2000000 runs; the limit is 1000000"):
        cases_of({"a.b": ["0"] * 2000, "c.d": ["0"] * 1000})


def test_a_wrong_value_fails_its_run_with_words(tmp_path: Path) -> None:
    outcome = Study(_pair(), cases_of({"mass.m": ["1", "1 N"]}), HERE, tmp_path).run()
    assert [bool(run.failure) for run in outcome.runs] == [False, True]
    assert "mass.m" in outcome.failed[0].failure


def test_what_does_not_fit_at_all_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    study = Study(_pair(), cases_of({}, seeds=[1, 2]), HERE, tmp_path / "study")
    with pytest.raises(MisfitError, match="no component of 'pair' has a parameter called seed"):
        study.run()
    with pytest.raises(MisfitError, match="mass has no variable 'q'"):
        replace(study, cases=cases_of({"mass.q": ["1", "2"]})).run()
    assert not (tmp_path / "study").exists()
