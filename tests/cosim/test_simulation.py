"""The simulation as a user drives it: single steps, values, inputs and outputs of the system, the end, nothing left behind."""

import ctypes
import gc
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_fmus import small_fmu
from systems import chain, pair, spec, system

from fmus.errors import ComponentError, MisfitError
from orchestrator.cosim import Component, ComponentSpec, Connection, Port, RunSettings, StepEnd, System
from orchestrator.cosim.fmu import read_description
from orchestrator.cosim.fmu.unpacked import load_binary
from orchestrator.cosim.masters import MASTERS
from orchestrator.cosim.simulation import Simulation
from orchestrator.results.recorder import MemoryRecorder


def test_single_steps_give_the_time_and_values() -> None:
    with Simulation(system([spec("decay", "decay")], [], step=0.5)) as simulation:
        assert [simulation.step() for _ in range(3)] == [0.5, 1.0, 1.5]
        assert simulation.get("decay.x") == pytest.approx(np.exp(-1.5), rel=1e-14)
        assert simulation.step(0.25) == 1.75
        assert simulation.step() == 2.25
        assert simulation.get("decay.x") == pytest.approx(np.exp(-2.25), rel=1e-14)


@pytest.mark.parametrize("size", [0.0, -1.0, float("nan"), float("inf")])
def test_a_step_that_is_no_time_is_refused(size: float) -> None:
    with Simulation(pair()) as simulation, pytest.raises(MisfitError, match="expected a positive time"):
        simulation.step(size)


def test_inputs_and_outputs_of_the_system_reach_through() -> None:
    what = replace(
        system([spec("one", "gain", a=2.0, b=0.0), spec("two", "gain", a=3.0, b=0.0)], [], step=0.1),
        inputs={"both": ("one.u", "two.u")},
        outputs={"out": "two.y"},
    )
    with Simulation(what) as simulation:
        simulation.set("both", 5.0)
        simulation.step()
        assert [simulation.get("one.y"), simulation.get("out")] == [10.0, 15.0]
        assert simulation.get("one.u") == 5.0


def test_a_parameter_can_be_set_before_the_start() -> None:
    with Simulation(pair()) as simulation:
        simulation.set("mass.x0", 2.0)
        simulation.initialise()
        assert simulation.get("mass.x") == 2.0
        assert simulation.get("spring.f2") == -20.0


def test_a_driven_input_cannot_be_set() -> None:
    with Simulation(pair()) as simulation, pytest.raises(MisfitError, match="mass.fa is driven by spring.f2; take"):
        simulation.set("mass.fa", 1.0)


@pytest.mark.parametrize(
    ("address", "words"),
    [("x", "is no address"), ("none.x", "has no component 'none'"), ("mass.none", "FMU 'mass' has no variable 'none'")],
)
def test_an_unknown_address_is_named(address: str, words: str) -> None:
    with Simulation(pair()) as simulation:
        simulation.initialise()
        with pytest.raises(MisfitError, match=words):
            simulation.get(address)


def test_a_closed_simulation_says_so() -> None:
    simulation = Simulation(pair())
    simulation.close()
    simulation.close()
    with pytest.raises(MisfitError, match="the simulation of 'test' is closed"):
        simulation.step()


def test_without_a_stop_time_a_run_asks_for_one() -> None:
    with Simulation(pair()) as simulation, pytest.raises(MisfitError, match="give a stop time in s"):
        simulation.run()


def test_without_a_step_the_shortest_suggestion_is_taken() -> None:
    what = replace(pair(), run=RunSettings())
    with Simulation(what) as simulation:
        assert simulation.step_size == 0.01


def test_a_run_need_not_end_at_a_multiple_of_the_step() -> None:
    recorder = MemoryRecorder()
    with Simulation(system([spec("decay", "decay")], [], step=0.3)) as simulation:
        simulation.run(1.0, recorder)
        assert simulation.get("decay.x") == pytest.approx(np.exp(-1.0), rel=1e-14)
    np.testing.assert_allclose(recorder.result().time, [0.0, 0.3, 0.6, 0.9, 1.0], rtol=1e-12)


def test_steps_that_the_master_chooses_can_be_thinned_out() -> None:
    recorders = MemoryRecorder(), MemoryRecorder()
    for recorder, every in zip(recorders, (1, 3), strict=True):
        with Simulation(pair(master="adaptive", tolerance=1e-4), every=every, stop=0.3) as simulation:
            simulation.run(recorder=recorder)
    every_point, thinned = (recorder.result().time for recorder in recorders)
    last = [] if (len(every_point) - 1) % 3 == 0 else [0.3]
    np.testing.assert_array_equal(thinned, [*every_point[::3], *last])


def test_an_fmu_of_fixed_steps_refuses_an_odd_end() -> None:
    fixed = {'canHandleVariableCommunicationStepSize="true"': 'canHandleVariableCommunicationStepSize="false"'}
    path = small_fmu("decay", replace=fixed)
    what = system([ComponentSpec("decay", source=str(path), options={"interface": "CoSimulation"})], [], step=0.3)
    with Simulation(what) as simulation:
        simulation.run(0.9)
        with pytest.raises(MisfitError, match=r"decay takes steps of one size only, 0.3 s; .* would be 0.1 s"):
            simulation.run(1.0)


@pytest.mark.parametrize("master", MASTERS)
@pytest.mark.parametrize("interface", ["CoSimulation", "ModelExchange"])
def test_nothing_is_left_behind(master: str, interface: str) -> None:
    what = pair(step=0.01, master=master, tolerance=1e-4)
    what = replace(
        what, components={n: replace(c, options={"interface": interface}) for n, c in what.components.items()}
    )
    living = []
    for name in ("mass", "spring"):
        description = read_description(small_fmu(name))
        library = load_binary(description, description.interface(interface))
        living.append(ctypes.c_int.in_dll(library, "small_living"))
    gc.collect()
    before = [each.value for each in living], len(os.listdir("/proc/self/fd"))
    for _ in range(20):
        with Simulation(what) as simulation:
            simulation.run(0.05, MemoryRecorder())
    del simulation
    gc.collect()
    assert ([each.value for each in living], len(os.listdir("/proc/self/fd"))) == before


@pytest.mark.parametrize("engine", [True, False])
def test_an_fmu_is_terminated_only_where_a_run_can_end(engine: bool) -> None:
    wrong = {'name="fb" valueReference="1"': 'name="fb" valueReference="77"'}
    path = small_fmu("mass", replace=wrong)
    description = read_description(path)
    misplaced = ctypes.c_int.in_dll(load_binary(description, description.interface()), "small_misplaced")
    mass = ComponentSpec("mass", source=str(path), options={"interface": "CoSimulation"})
    one = system([mass], [], step=0.1)
    Simulation(one).close()
    with Simulation(one) as simulation:
        simulation.run(0.5)
    driven = system([mass, spec("decay", "decay")], [("decay.x", "mass.fb")], step=0.1)
    with (
        Simulation(driven, engine=engine) as simulation,
        pytest.raises(ComponentError, match="there is no variable 77"),
    ):
        simulation.run(0.5)
    assert misplaced.value == 0


def test_a_failure_while_loading_frees_what_was_loaded() -> None:
    description = read_description(small_fmu("mass"))
    living = ctypes.c_int.in_dll(load_binary(description, description.interface()), "small_living")
    gc.collect()
    before = living.value
    what = system(
        [spec("mass", "mass"), ComponentSpec("bad", source=str(small_fmu("spring", platform="win64")))], [], step=0.1
    )
    with pytest.raises(MisfitError, match="component 'bad': .* has no binary"):
        Simulation(what)
    gc.collect()
    assert living.value == before


class Clock(Component):
    """A user's own component: counts its steps; stops half way in a step once, and notes who called what."""

    def __init__(self, half: bool = False) -> None:
        self.ports = (Port("count", "output", type="Int32"), Port("u", "input", start=0.0))
        self.feedthrough = {"count": ()}
        self.half, self.steps, self.calls = half, 0, list[Any]()

    def initialise(self, time: float, stop: float | None, tolerance: float | None) -> None:
        self.calls.append(("initialise", time, stop, tolerance))

    def start(self) -> None:
        self.calls.append("start")

    def set(self, names: Any, values: Any) -> None: ...

    def get(self, names: Any) -> list[int]:
        return [self.steps]

    def step(self, time: float, size: float) -> StepEnd:
        self.steps += 1
        self.calls.append((time, size))
        if self.half and self.steps == 2:
            return StepEnd(time + 0.5 * size, early=True)
        return StepEnd(time + size)

    def terminate(self) -> None:
        self.calls.append("terminate")


def alone(component: Component, monkeypatch: pytest.MonkeyPatch, **run: Any) -> Simulation:
    from orchestrator.cosim import assembly

    monkeypatch.setattr(assembly, "describe", lambda specification, folder: component)
    return Simulation(System("one", {"clock": ComponentSpec("clock")}, run=RunSettings(**run)))


def test_a_component_lives_as_the_contract_says(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Clock()
    with alone(clock, monkeypatch, step=0.5, stop=1.0, tolerance=1e-3, start=0.0) as simulation:
        simulation.run()
    assert clock.calls == [("initialise", 0.0, 1.0, 1e-3), "start", (0.0, 0.5), (0.5, 0.5), "terminate"]


def test_a_step_that_ends_early_is_completed(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Clock(half=True)
    with alone(clock, monkeypatch, step=0.5) as simulation:
        simulation.run(1.5)
    assert clock.calls[2:-1] == [(0.0, 0.5), (0.5, 0.5), (0.75, 0.25), (1.0, 0.5)]


def test_a_component_that_gets_nowhere_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    class Stuck(Clock):
        def step(self, time: float, size: float) -> StepEnd:
            return StepEnd(time, early=True)

    words = "clock ends every step early and gets no further than t = 0 s"
    with alone(Stuck(), monkeypatch, step=0.5) as simulation, pytest.raises(ComponentError, match=words):
        simulation.run(1.0)


def test_conversions_are_applied_and_reported() -> None:
    first = spec("one", "decay")
    what = System(
        "units",
        {"one": first, "two": spec("two", "gain", a=1.0, b=0.0)},
        (Connection("one.x", "two.u", factor=1000.0, offset=1.0),),
        run=RunSettings(step=0.5),
        folder=Path("/"),
    )
    with Simulation(what) as simulation:
        simulation.run(1.0)
        assert simulation.get("two.y") == 1000.0 * simulation.get("one.x") + 1.0


def test_provenance_names_fmus_by_their_content() -> None:
    with Simulation(chain(count=1)) as simulation:
        provenance = simulation.provenance()
    assert provenance["components"]["mass0"]["sha256"] == read_description(small_fmu("mass")).digest
    assert provenance["master"] == "ordered"
