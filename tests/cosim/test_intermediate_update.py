"""Intermediate update of FMI 3.0: an FMU that asks for its inputs within a step gets them along their lines."""

from pathlib import Path

import pytest
from fmi3_sources import fmi3_of
from systems import spec, system

from fmus.errors import ComponentError, MisfitError
from orchestrator.cosim import ComponentSpec, Simulation, System, Value

DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="asking" instantiationToken="{asking}">
 <CoSimulation modelIdentifier="asking" providesIntermediateUpdate="true" canHandleVariableCommunicationStepSize="true"/>
 <ModelVariables>
  <Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>
  <Float64 name="u" valueReference="1" causality="input" start="0"/>
  <Float64 name="y" valueReference="2" causality="output"/>
  <Float64 name="asked" valueReference="3" causality="output"/>
 </ModelVariables>
 <ModelStructure><Output valueReference="2" dependencies=""/><Output valueReference="3" dependencies=""/></ModelStructure>
</fmiModelDescription>"""


@pytest.fixture(scope="module")
def asking(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The FMU."""
    return fmi3_of("asking", DESCRIPTION, tmp_path_factory.mktemp("asking"))


def two(asking: Path, **options: object) -> System:
    """The first integrates 2, so the second, driven by 2 t, (2 t)^2."""
    parts = [ComponentSpec(name, source=str(asking), options=options) for name in ("first", "second")]
    made = system(parts, [("first.y", "second.u")], step=0.1, options={"extrapolation": 1})
    return made.with_values({"first.u": Value(2.0**0.5)})


def test_inputs_go_on_along_their_lines_within_a_step(asking: Path) -> None:
    exact = 4.0 / 3.0 * (1.0 - 0.1**3)  # in the first step there is no line yet
    found = {}
    for asks in (True, False):
        with Simulation(two(asking, intermediate_update=asks), stop=1.0) as run:
            run.run(1.0)
            assert run.get("second.asked") == 200 * asks
            found[asks] = abs(run.get("second.y") - exact)
    # Twenty trapezes in a step, against the value in its middle: 0.9 (0.1 / 20)^2 f'' / 12 and 0.9 0.1^2 f'' / 24 with f'' = 8.
    assert found[True] == pytest.approx(1.5e-5, rel=0.01) and found[False] == pytest.approx(3.0e-3, rel=0.01)


def test_a_value_that_the_fmu_refuses_within_a_step_ends_the_run(asking: Path) -> None:
    with (
        Simulation(two(asking, intermediate_update=True), stop=2.0) as run,
        pytest.raises(ComponentError, match="refused fmi3SetFloat64 of 'u' = 3.0"),
    ):
        run.run(2.0)


def test_an_fmu_that_never_asks_is_told() -> None:
    gain = spec("gain", "gain", version=3)
    with pytest.raises(MisfitError, match="intermediate_update: .* never asks for inputs within a step"):
        Simulation(
            system([ComponentSpec("gain", source=gain.source, options={"intermediate_update": True})], [], step=0.1)
        )
