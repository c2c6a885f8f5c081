"""No communication point passes the stop time, and each step begins where the last one ended, both to the last bit."""

from pathlib import Path

import pytest
from faulty import faulty_fmu

from orchestrator.cosim import ComponentSpec, System
from orchestrator.cosim.simulation import Simulation
from orchestrator.cosim.system import RunSettings
from orchestrator.results import MemoryRecorder


@pytest.mark.parametrize("engine", [True, False])
@pytest.mark.parametrize("master", ["ordered", "jacobi", "gauss_seidel"])
@pytest.mark.parametrize(
    ("stop", "step"), [(10.0, 0.05), (0.3, 0.1), (2.1, 0.7), (1.0, 0.3), (8.1, 0.9), (0.7, 0.1), (4.35, 0.29)]
)
def test_a_strict_fmu_reaches_its_stop_time_exactly(
    tmp_path: Path, stop: float, step: float, master: str, engine: bool
) -> None:
    """The FMU refuses each step of which beginning plus size, in double precision, exceed the stop time it was told."""
    part = ComponentSpec("tank", source=faulty_fmu(tmp_path, "past_stop").name)
    system = System("tank", {"tank": part}, run=RunSettings(stop=stop, step=step, master=master), folder=tmp_path)
    recorder = MemoryRecorder()
    with Simulation(system, engine=engine) as simulation:
        assert simulation.run(recorder=recorder)
    result = recorder.result()
    assert result.time[-1] == stop
    assert result["tank.y"][-1] == pytest.approx(stop, rel=1e-12)


@pytest.mark.parametrize("engine", [True, False])
@pytest.mark.parametrize(("step", "own"), [(0.01, None), (0.1, 0.02), (0.01, 0.05)])
def test_a_step_begins_where_the_last_one_ended(tmp_path: Path, step: float, own: float | None, engine: bool) -> None:
    """The FMU refuses others. One that counts its own steps up to there took two at once, or none, before."""
    part = ComponentSpec("tank", source=faulty_fmu(tmp_path, "apart").name, step=own)
    system = System("tank", {"tank": part}, run=RunSettings(stop=7.0, step=step), folder=tmp_path)
    with Simulation(system, engine=engine) as simulation:
        assert simulation.run()
