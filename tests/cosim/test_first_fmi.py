"""FMUs of FMI 1.0 for co-simulation run: values of all types, steps as FMPy makes them, their own words in errors."""

import subprocess
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fmpy import simulate_fmu
from systems import recorded, spec, system

from fmus.errors import ComponentError, MisfitError
from fmus.runtime.compiler import find_compiler
from orchestrator.cosim import ComponentSpec, Connection, Simulation, System
from orchestrator.cosim.container import container_of
from orchestrator.cosim.load import load_system

SOURCE = Path(__file__).parent / "fmus" / "first.c"
DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="1.0" modelName="first" modelIdentifier="first" guid="{first}" numberOfContinuousStates="1"
 numberOfEventIndicators="0">
 <ModelVariables>
  <ScalarVariable name="u" valueReference="0" causality="input"><Real start="0"/></ScalarVariable>
  <ScalarVariable name="x" valueReference="1" causality="output"><Real start="1"/></ScalarVariable>
  <ScalarVariable name="n_in" valueReference="0" causality="input" variability="discrete"><Integer start="0"/></ScalarVariable>
  <ScalarVariable name="n" valueReference="0" causality="output" variability="discrete"><Integer/></ScalarVariable>
  <ScalarVariable name="on_in" valueReference="0" causality="input" variability="discrete"><Boolean start="false"/></ScalarVariable>
  <ScalarVariable name="on" valueReference="0" causality="output" variability="discrete"><Boolean/></ScalarVariable>
  <ScalarVariable name="words" valueReference="0" causality="input" variability="discrete"><String start=""/></ScalarVariable>
 </ModelVariables>
 IMPLEMENTATION
</fmiModelDescription>"""
STEPPING = '<Implementation><CoSimulation_StandAlone><Capabilities canHandleVariableCommunicationStepSize="true"/></CoSimulation_StandAlone></Implementation>'


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The FMU."""
    folder = tmp_path_factory.mktemp("first")
    subprocess.run([*find_compiler(), "-shared", "-fPIC", "-O1", "-o", "first.so", str(SOURCE)], cwd=folder, check=True)
    with zipfile.ZipFile(folder / "first.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", DESCRIPTION.replace("IMPLEMENTATION", STEPPING))
        archive.write(folder / "first.so", "binaries/linux64/first.so")
    return folder / "first.fmu"


def coupled(first: Path) -> System:
    """dx/dt = -x by way of a gain."""
    what = system([ComponentSpec("one", source=str(first)), spec("gain", "gain", a=-1.0, b=0.0)], [], step=0.01)
    return replace(what, connections=(Connection("one.x", "gain.u"), Connection("gain.y", "one.u")))


def test_its_steps_are_those_of_fmpy(first: Path) -> None:
    here = recorded(load_system(first), 1.0, step=0.1, stop=1.0)
    there = simulate_fmu(str(first), stop_time=1.0, output_interval=0.1, output=["x"])

    np.testing.assert_array_equal(here["first.x"], there["x"])


def test_values_of_all_types_come_back(first: Path) -> None:
    with Simulation(load_system(first), step=0.1, stop=1.0) as run:
        run.set("first.n_in", 7)
        run.set("first.on_in", True)
        run.set("first.words", "äö")
        run.set("first.u", 2.0)
        run.run(0.5)

        assert (run.get("first.n"), run.get("first.on"), run.get("first.words")) == (7, True, "äö")
        assert run.get("first.x") == pytest.approx(2.0, rel=1e-12)


def test_engine_and_python_agree_about_it(first: Path) -> None:
    quick, slow = (recorded(coupled(first), 1.0, engine=engine) for engine in (True, False))

    np.testing.assert_array_equal(quick["one.x"], slow["one.x"])
    assert quick["one.x"][-1] == pytest.approx(0.99**100, rel=1e-12)


def test_refused_step_says_what_the_fmu_says(first: Path) -> None:
    with (
        Simulation(load_system(first), step=0.1, stop=1.0) as run,
        pytest.raises(ComponentError, match="FMU 'first' refused the step at t = 0 s.*it says: u = -6 is below -5"),
    ):
        run.set("first.u", -6.0)
        run.run(0.5)


def test_it_is_refused_inside_one_fmu_by_name(first: Path, tmp_path: Path) -> None:
    with pytest.raises(
        MisfitError, match=r"component 'one': first.fmu is of FMI 1.0; one FMU can hold those of FMI 2.0"
    ):
        container_of(coupled(first), "coupled", tmp_path)
