"""Isolated runs of the same FMUs share a process, one after the other; others never do."""

import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from faulty import children, faulty_fmu, held
from small_fmus import small_fmu

from fmus.errors import ComponentError
from orchestrator.cosim import ComponentSpec, System
from orchestrator.cosim.isolate.process import MOST_WAITING, _waiting, end_waiting
from orchestrator.cosim.run import RunOptions, run_system
from orchestrator.cosim.system import RunSettings, Value
from orchestrator.results import MemoryRecorder


@pytest.fixture(autouse=True)
def others() -> Iterator[set[str]]:
    """Children of other tests in this process; none of them waits for a run."""
    yield held()
    end_waiting()


def decay(rate: float = 1.0) -> System:
    return System(
        "decay",
        {"d": ComponentSpec("d", source=str(small_fmu("decay")), values={"k": Value(rate)})},
        run=RunSettings(stop=1.0, step=0.01),
    )


def values(system: System, isolate: bool = True) -> np.ndarray:
    recorder = MemoryRecorder()
    run_system(system, recorder, RunOptions(isolate=isolate))
    return recorder.result()["d.x"]


def test_runs_of_the_same_fmu_share_a_process_and_give_the_same_bits(others: set[str]) -> None:
    first = values(decay())
    process = children() - others
    assert np.array_equal(values(decay()), first)
    assert np.array_equal(values(decay(2.0)), values(decay(2.0), isolate=False))  # nothing is left of the run before
    assert np.array_equal(values(decay()), first)
    assert (children() - others) == process and len(process) == 1


def test_another_fmu_gets_a_process_of_its_own(others: set[str], tmp_path: Path) -> None:
    values(decay())
    tank = System(
        "t", {"d": ComponentSpec("d", source=str(faulty_fmu(tmp_path, "none")))}, run=RunSettings(stop=1.0, step=0.1)
    )
    run_system(tank, MemoryRecorder(), RunOptions(isolate=True))
    assert len({key for key, _ in _waiting}) == len(_waiting) == 2 and len(children() - others) == 2


def test_a_process_in_which_something_failed_is_not_used_again(others: set[str], tmp_path: Path) -> None:
    for fault in ("nan", "segfault", "error"):
        system = System(
            "t", {"d": ComponentSpec("d", source=str(faulty_fmu(tmp_path, fault)))}, run=RunSettings(stop=1.0, step=0.1)
        )
        with pytest.raises(ComponentError):
            run_system(system, MemoryRecorder(), RunOptions(isolate=True))
    assert not _waiting and (children() - others) == set()


def test_no_more_than_a_few_wait(others: set[str], tmp_path: Path) -> None:
    for k in range(MOST_WAITING + 2):
        path = faulty_fmu(tmp_path, "none")
        with path.open("ab") as file:  # another content each time
            file.write(bytes(k))
        system = System("t", {"d": ComponentSpec("d", source=str(path))}, run=RunSettings(stop=1.0, step=0.1))
        run_system(system, MemoryRecorder(), RunOptions(isolate=True))
    assert len(children() - others) <= MOST_WAITING


def test_an_isolated_run_costs_little_more_than_one_in_this_process() -> None:
    values(decay())
    before = os.times()
    for _ in range(20):
        values(decay())
    after = os.times()
    assert (after.user + after.system - before.user - before.system) / 20 < 0.05
