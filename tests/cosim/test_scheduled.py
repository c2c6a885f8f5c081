"""FMUs for scheduled execution: clocks tick when they are due, in the order of time and priority."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from fmi3_sources import fmi3_of
from systems import spec, system

from fmus.errors import ComponentError, MisfitError
from orchestrator.cosim import ComponentSpec, Connection, Simulation, System
from orchestrator.cosim.container import container_of

DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="clocks" instantiationToken="{clocks}">
 <ScheduledExecution modelIdentifier="clocks"/>
 <ModelVariables>
  <Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>
  <Clock name="often" valueReference="1" causality="input" intervalVariability="constant" intervalCounter="1" resolution="10" priority="2"/>
  <Clock name="later" valueReference="2" causality="input" intervalVariability="countdown" priority="1"/>
  <Clock name="told" valueReference="3" causality="input" intervalVariability="triggered" priority="0"/>
  <Float64 name="log" valueReference="4" causality="output" variability="discrete"/>
  <Float64 name="u" valueReference="5" causality="input" variability="discrete" start="0"/>
  <Float64 name="sum" valueReference="6" causality="output" variability="discrete"/>
  <Float64 name="last" valueReference="7" causality="output" variability="discrete"/>
 </ModelVariables>
 <ModelStructure>
  <Output valueReference="4" dependencies=""/><Output valueReference="6" dependencies=""/><Output valueReference="7" dependencies=""/>
 </ModelStructure>
</fmiModelDescription>"""


@pytest.fixture(scope="module")
def clocks(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The FMU."""
    return fmi3_of("clocks", DESCRIPTION, tmp_path_factory.mktemp("clocks"))


def ticking(clocks: Path, ticks: Mapping[str, Any], step: float = 0.02) -> System:
    parts = [ComponentSpec("c", source=str(clocks), options={"ticks": dict(ticks)}), spec("gain", "gain", a=0.0, b=2.0)]
    what = system(parts, [("gain.y", "c.u")], step=step)
    return what


@pytest.mark.parametrize("step", [0.01, 0.02, 0.7])
def test_ticks_come_in_the_order_of_time_and_priority_whatever_the_step(step: float, clocks: Path) -> None:
    # 1 at 0, 0.1, ... 0.7; 2 at 0.25, 0.05 s after the third of these; 3 at 0.1, before 1, and at 0.65.
    with Simulation(ticking(clocks, {"told": [0.65, 0.1]}, step), stop=0.7) as run:
        run.run(0.7)

        assert run.get("c.log") == 13112111131.0
        assert run.get("c.last") == pytest.approx(0.7, rel=1e-12)


def test_a_partition_uses_the_inputs_of_the_instant(clocks: Path) -> None:
    with Simulation(ticking(clocks, {"told": [0.1, 0.2, 0.3]}), stop=0.4) as run:
        run.run(0.4)

        assert run.get("c.sum") == 6.0


def test_saying_which_clock_ticks_is_checked(clocks: Path) -> None:
    for ticks, words in (
        ({"often": [1.0]}, "ticks of 'often': there is no input clock to be triggered of that name; there are 'told'"),
        ({"told": 3}, "ticks of 'told' = 3; expected a list of times in s"),
    ):
        with pytest.raises(MisfitError, match=words):
            Simulation(ticking(clocks, ticks))


def test_a_partition_that_fails_is_named(clocks: Path) -> None:
    what = system([ComponentSpec("c", source=str(clocks), options={"ticks": {"told": [0.1]}})], [], step=0.05)
    with Simulation(what, stop=1.0) as run:
        run.set("c.u", -1.0)

        with pytest.raises(
            ComponentError, match="refused fmi3ActivateModelPartition of 'told' at t = 0.1 s.*below zero"
        ):
            run.run(1.0)


def test_clocks_cannot_be_connected_to_numbers_nor_scheduled_in_one_fmu(clocks: Path, tmp_path: Path) -> None:
    what = ticking(clocks, {})
    wrong = System("wrong", what.components, (Connection("gain.y", "c.told"),), run=what.run, folder=what.folder)

    with pytest.raises(MisfitError, match="Float64 does not fit a clock, told"):
        Simulation(wrong)
    with pytest.raises(MisfitError, match="component 'c': clocks.fmu offers scheduled execution only"):
        container_of(what, "coupled", tmp_path)
