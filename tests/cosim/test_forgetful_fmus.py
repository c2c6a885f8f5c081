"""Parameters that an FMU sets back when a run is set up, as FMUs of 20-sim do, have the values that were asked for all the same."""

import numpy as np
import pytest
from small_fmus import small_fmu

from orchestrator.cosim import ComponentSpec, RunSettings, Simulation, System
from orchestrator.cosim.system import Value


@pytest.mark.parametrize("name", ["decay", "forgetful"])
def test_a_system_runs_with_the_value_that_it_gives(name: str) -> None:
    options = {"interface": "CoSimulation"}
    spec = ComponentSpec("fmu", source=str(small_fmu(name)), options=options, values={"k": Value(2.0)})
    with Simulation(System("one", {"fmu": spec}, run=RunSettings(step=0.1))) as simulation:
        simulation.run(1.0)
        assert simulation.get("fmu.x") == pytest.approx(np.exp(-2.0), rel=1e-12)
