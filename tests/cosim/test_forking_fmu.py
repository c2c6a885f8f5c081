"""An FMU that calls fork() and returns in both processes: the run goes on once."""

from pathlib import Path

import numpy as np
import pytest
from faulty import faulty_fmu

from orchestrator.cosim import ComponentSpec, System
from orchestrator.cosim.run import RunOptions, run_system
from orchestrator.cosim.system import RunSettings
from orchestrator.results import MemoryRecorder


@pytest.mark.parametrize("isolate", [True, False])
@pytest.mark.parametrize("master", ["ordered", "gauss_seidel"])
def test_an_fmu_that_forks_gives_each_row_once(tmp_path: Path, isolate: bool, master: str) -> None:
    """It forks in each of the 20 calls from 0.5 s on."""
    system = System(
        "tank",
        {"tank": ComponentSpec("tank", source=faulty_fmu(tmp_path, "fork").name)},
        run=RunSettings(stop=0.52, step=1e-3, master=master),
        folder=tmp_path,
    )
    recorder = MemoryRecorder()
    run_system(system, recorder, RunOptions(isolate=isolate))
    assert np.allclose(recorder.result().time, np.arange(521) * 1e-3, rtol=0.0, atol=1e-12)
    assert recorder.result()["tank.y"][-1] == pytest.approx(0.52)
