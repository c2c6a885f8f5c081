"""Whole simulations in a process of their own: the same bits, every row until a crash, nothing left behind."""

import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from faulty import faulty_fmu, held, left_behind
from small_fmus import small_fmu

from fmus.errors import ComponentError, MisfitError
from orchestrator.cosim import ComponentSpec, Connection, System
from orchestrator.cosim.isolate.process import ChildLimits
from orchestrator.cosim.isolate.simulation import IsolatedSimulation
from orchestrator.cosim.run import RunOptions, run_system
from orchestrator.cosim.simulation import Simulation
from orchestrator.cosim.system import RunSettings
from orchestrator.results import MemoryRecorder


def _pair(**isolate: bool) -> System:
    parts = {
        name: ComponentSpec(name, source=str(small_fmu(name)), isolate=isolate.get(name)) for name in ("mass", "spring")
    }
    links = (("mass.x", "spring.x2"), ("mass.v", "spring.v2"), ("spring.f2", "mass.fa"))
    return System("pair", parts, tuple(Connection(*ends) for ends in links), run=RunSettings(stop=0.2, step=1e-3))


def _tank(folder: Path, fault: str, step: float = 0.01) -> System:
    spec = ComponentSpec("tank", source=faulty_fmu(folder, fault).name)
    return System("tank", {"tank": spec}, run=RunSettings(stop=1.0, step=step), folder=folder)


def _values(system: System, isolate: bool) -> np.ndarray:
    recorder = MemoryRecorder()
    run_system(system, recorder, RunOptions(isolate=isolate))
    result = recorder.result()
    return np.column_stack([result.time, *(result[name] for name in result.names)])


def test_one_component_or_all_apart_give_the_same_bits() -> None:
    here = _values(_pair(), isolate=False)
    assert np.array_equal(_values(_pair(), isolate=True), here)
    assert np.array_equal(_values(_pair(spring=True), isolate=False), here)


def test_every_row_before_a_crash_in_the_middle_of_a_block_is_kept(tmp_path: Path) -> None:
    recorder = MemoryRecorder()
    with pytest.raises(ComponentError, match="FMU 'tank' crashed in step at t = 0.5"):
        run_system(_tank(tmp_path, "segfault", step=1e-5), recorder, RunOptions(isolate=True))
    result = recorder.result()
    assert len(result.time) == 50_001
    assert result.time == pytest.approx(np.arange(50_001) * 1e-5, abs=1e-12)
    assert "crashed in step" in result.failure


def test_the_host_goes_on_with_another_run_after_a_crash(tmp_path: Path) -> None:
    before = held()
    for fault in ("segfault", "none", "abort", "none"):
        recorder = MemoryRecorder()
        if fault == "none":
            run_system(_tank(tmp_path, fault), recorder, RunOptions(isolate=True))
            assert recorder.result()["tank.y"][-1] == pytest.approx(1.0)
        else:
            with pytest.raises(ComponentError):
                run_system(_tank(tmp_path, fault), recorder, RunOptions(isolate=True))
    assert not left_behind(before)


def test_single_steps_and_values_pass_through() -> None:
    with Simulation(_pair()) as here, IsolatedSimulation(_pair()) as there:
        for simulation in (here, there):
            simulation.set("mass.m", 2.0)
            simulation.step()
            simulation.step(5e-4)
        assert there.time == here.time == 1.5e-3
        assert there.get("mass.x") == here.get("mass.x")
        assert there.columns == here.columns and there.report == here.report
        with pytest.raises(MisfitError, match="nowhere"):
            there.get("nowhere.x")
        assert there.get("mass.v") == here.get("mass.v")  # an error of the caller ends nothing


def test_what_does_not_fit_is_the_same_error_as_in_the_host() -> None:
    wrong = replace(_pair(), connections=(Connection("mass.x", "spring.v2"),))
    words = []
    for isolate in (True, False):
        with pytest.raises(MisfitError) as caught:
            _values(wrong, isolate)
        words.append((type(caught.value), str(caught.value)))
    assert words[0] == words[1]


def test_silence_while_the_host_is_slow_is_no_fault_of_the_fmu(tmp_path: Path) -> None:
    """The recorder takes longer for a block than the FMU may take for a call."""

    class Slow(MemoryRecorder):
        def rows(self, times: np.ndarray, values: np.ndarray) -> None:
            super().rows(times, values)
            deadline = os.times().elapsed + 1.5
            while os.times().elapsed < deadline:
                pass

    recorder = Slow()
    run_system(_tank(tmp_path, "none"), recorder, RunOptions(isolate=True, limits=ChildLimits(1.0, 4.0)))
    assert len(recorder.result().time) == 101


def test_the_child_ends_when_its_host_is_killed(tmp_path: Path) -> None:
    root = Path(__file__).parents[2]
    fmu = faulty_fmu(tmp_path, "hang")
    command = [sys.executable, "-m", "orchestrator.cli", "run", str(fmu), "--isolate"]
    host = subprocess.Popen(command, cwd=root, env={**os.environ, "PYTHONPATH": str(root)})
    children: list[str] = []
    while host.poll() is None and not children:
        children = Path(f"/proc/{host.pid}/task/{host.pid}/children").read_text().split()
    host.send_signal(signal.SIGKILL)
    host.wait(timeout=60)
    child = Path(f"/proc/{children[0]}")
    # It looks every second whether its host is there, also in the endless loop of the FMU.
    deadline = os.times().elapsed + 60.0
    while child.exists() and "Z" not in _state(child) and os.times().elapsed < deadline:
        pass
    assert not child.exists() or "Z" in _state(child)


def _state(process: Path) -> str:
    try:
        return (process / "stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return "Z"
