"""The loop in C gives the same bits as the masters in Python, in every respect that a user can see."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from systems import chain, pair, recorded, spec, system

from orchestrator.cosim import ComponentSpec, Connection, System
from orchestrator.cosim.progress import Progress
from orchestrator.cosim.run import RunOptions, run_system
from orchestrator.cosim.simulation import Simulation
from orchestrator.results import read_result, recorder_for
from orchestrator.results.recorder import MemoryRecorder


def gains(version: int = 2, **run: Any) -> System:
    """A chain with conversions: values that pass unchanged, -0 among them, and scaled ones."""
    first, second = spec("first", "decay", version), spec("second", "gain", version, a=-0.0, b=-0.0)
    third = spec("third", "gain", version, a=2.0, b=0.0)
    links = [Connection("first.x", "second.u", factor=1.7, offset=0.3), Connection("second.y", "third.u")]
    plain = system([first, second, third], [], step=0.01, **run)
    return System("test", plain.components, tuple(links), run=plain.run, folder=plain.folder)


def rates(version: int = 2, **run: Any) -> System:
    """Components with steps of their own, longer and shorter."""
    parts = [spec("slow", "decay", version), spec("fast", "decay", version, k=2.0), spec("gain", "gain", version)]
    steps = {"slow": 0.05, "fast": 0.0025, "gain": None}
    parts = [
        ComponentSpec(p.name, source=p.source, values=p.values, options=p.options, step=steps[p.name]) for p in parts
    ]
    return system(parts, [("slow.x", "gain.u"), ("gain.y", "fast.u"), ("fast.x", "slow.u")], step=0.01, **run)


def types(version: int = 2, **run: Any) -> System:
    """Values of every type that passes from an FMU to the next."""
    values = {"int32_in": -(2**31), "boolean_in": True, "enumeration_in": 2}
    more = {
        "float32_in": 0.1,
        "int8_in": -128,
        "uint8_in": 255,
        "int16_in": -(2**15),
        "uint16_in": 2**16 - 1,
        "uint32_in": 2**32 - 1,
    }
    parts = [
        spec("decay", "decay", version),
        spec("one", "feedthrough", version, **values, **(more if version == 3 else {})),
    ]
    parts.append(spec("two", "feedthrough", version))
    names = ["float64", *(name.removesuffix("_in") for name in (*values, *(more if version == 3 else ())))]
    links = [("decay.x", "one.float64_in"), *((f"one.{name}_out", f"two.{name}_in") for name in names)]
    return system(parts, links, step=0.01, **run)


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("master", ["ordered", "jacobi", "gauss_seidel"])
@pytest.mark.parametrize("make", [pair, chain, gains, rates, types])
def test_engine_and_python_give_the_same_bits(make: Callable[..., System], master: str, version: int) -> None:
    what = make(version, master=master)
    # 64-bit integers only Python carries.
    record = ["two.*float*", "two.*int8*", "two.*int16*", "two.*int32*", "two.bool*", "two.enum*"]
    record = record if make is types and version == 3 else None
    with Simulation(what, record=record) as simulation:
        simulation.initialise()
        assert simulation.report.engine == ""
    fast, slow = recorded(what, 1.0, record=record), recorded(what, 1.0, engine=False, record=record)
    np.testing.assert_array_equal(fast.time, slow.time)
    assert fast.names == slow.names
    for name in fast.names:
        assert fast[name].tobytes() == slow[name].tobytes(), name


@pytest.mark.parametrize("engine", [True, False])
def test_a_run_in_parts_is_the_run_as_a_whole(engine: bool) -> None:
    whole = recorded(pair(), 1.0, engine=engine)
    recorder = MemoryRecorder()
    with Simulation(pair(), engine=engine) as simulation:
        for until in (0.1, 0.1005, 0.3, 1.0):
            simulation.run(until, recorder)
    parts = recorder.result()
    # The point in between is one more, and shifts those after it by half a step.
    assert len(parts.time) == len(whole.time) + 1
    assert parts["mass.x"][-1] == pytest.approx(whole["mass.x"][-1], abs=2e-3)
    with Simulation(pair(), engine=engine) as simulation:
        recorder = MemoryRecorder()
        for until in (0.1, 0.25, 1.0):
            simulation.run(until, recorder)
    np.testing.assert_array_equal(recorder.result()["mass.x"], whole["mass.x"])


@pytest.mark.parametrize("engine", [True, False])
def test_every_nth_point_and_the_last_are_recorded(engine: bool) -> None:
    result = recorded(pair(step=0.01), 0.25, engine=engine, every=10)
    np.testing.assert_allclose(result.time, [0.0, 0.1, 0.2, 0.25], rtol=1e-12)


@pytest.mark.parametrize("engine", [True, False])
def test_chosen_columns_are_recorded_inputs_among_them(engine: bool) -> None:
    result = recorded(pair(), 0.01, engine=engine, record=["mass.*a", "spring.f2"])
    assert list(result.names) == ["mass.fa", "spring.f2"]
    np.testing.assert_array_equal(result["mass.fa"], result["spring.f2"])


def test_more_rows_than_the_buffer_holds_arrive_in_order() -> None:
    result = recorded(pair(step=1e-3), 20.0)
    np.testing.assert_array_equal(result.time, 1e-3 * np.arange(20001))


def test_single_steps_and_runs_can_be_mixed() -> None:
    with Simulation(pair()) as simulation:
        for _ in range(500):
            simulation.step()
        simulation.run(1.0)
        mixed = simulation.get("mass.x")
    assert mixed == recorded(pair(), 1.0)["mass.x"][-1]


def test_an_input_that_is_set_counts_from_the_next_step_on() -> None:
    parts = [spec("mass", "mass")]
    with Simulation(system(parts, [], step=0.1)) as simulation:
        simulation.run(1.0)
        simulation.set("mass.fa", 2.0)
        simulation.run(2.0)
        assert simulation.get("mass.x") == pytest.approx(1.0 + 0.5 * 2.0, rel=1e-12)


@pytest.mark.parametrize("engine", [True, False])
def test_the_word_tells_who_was_called_when(engine: bool) -> None:
    from fmus.errors import ComponentError

    progress = Progress()
    what = system([spec("fine", "decay"), spec("bad", "decay", k=-1000.0)], [], step=0.1)
    with Simulation(what, engine=engine, progress=progress) as simulation:
        before = progress.word.calls
        with pytest.raises(ComponentError):
            simulation.run(10.0)
        assert progress.word.last_good == pytest.approx(0.7)
        # Two steps and two reads for each of eight points.
        assert progress.word.calls - before > 8 * 4
        assert (progress.word.component, progress.word.call) == (-1, 0)


def test_a_wish_to_stop_ends_the_run_at_a_communication_point() -> None:
    progress = Progress()
    with Simulation(pair(), progress=progress) as simulation:
        simulation.run(0.1)
        progress.word.stop = 1
        assert not simulation.run(1.0)
        assert simulation.time == pytest.approx(0.1)


def controlled(version: int = 2, **run: Any) -> System:
    """A mass held by a controller in Python, which has no FMU to be called in C."""
    gains: dict[str, Any] = {"a": [[0.5]], "b": [[1.0]], "c": [[-3.0]], "d": [[-1.5]]}
    control = ComponentSpec("control", kind="controller", options={**gains, "sample_time": 0.01})
    links = [("mass.x", "control.u"), ("control.y", "mass.fa"), ("mass.v", "gain.u")]
    return system([spec("mass", "mass", version), control, spec("gain", "gain", version)], links, step=0.01, **run)


def looping(version: int = 2, **run: Any) -> System:
    """An algebraic loop, driven from outside, that drives an FMU."""
    parts = [spec("decay", "decay", version), spec("one", "gain", version, a=-3.0), spec("two", "gain", version, a=1.0)]
    links = [("one.y", "two.u"), ("two.y", "one.u"), ("two.y", "decay.u")]
    return system(parts, links, step=0.01, **run)


def mixed(version: int = 2, **run: Any) -> System:
    """One side by model exchange, the other by co-simulation."""
    what = pair(version, **run)
    return what.with_component(replace(what.component("mass"), options={"interface": "ModelExchange"}))


def equations(version: int = 2, **run: Any) -> System:
    """Both sides as one system of equations, with the discrete output of a third."""
    what = pair(version, **run)
    stair = spec("stair", "stair", version)
    parts = [replace(each, options={"interface": "ModelExchange"}) for each in (*what.components.values(), stair)]
    return replace(what, components={each.name: each for each in parts})


def texts(version: int = 2, **run: Any) -> System:
    """Texts between FMUs, and at FMI 3 64-bit integers and bytes, beside real numbers."""
    kinds = ["string", "float64", *(["int64", "uint64", "binary"] if version == 3 else [])]
    parts = [spec("decay", "decay", version), spec("one", "feedthrough", version), spec("two", "feedthrough", version)]
    links = [("decay.x", "one.float64_in"), *((f"one.{kind}_out", f"two.{kind}_in") for kind in kinds)]
    return system(parts, links, step=0.01, **run)


def shaped(version: int = 2, **run: Any) -> System:
    """Inputs along a line."""
    return pair(version, options={"extrapolation": 1} if run.get("master") == "ordered" else {}, **run)


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("master", ["ordered", "jacobi", "gauss_seidel"])
@pytest.mark.parametrize(
    ("make", "left"),
    [
        (controlled, "control"),
        (looping, "the algebraic loop one."),
        (mixed, "integration of mass"),
        (equations, "integration of stair"),
        (texts, "two.string_in"),
        (shaped, "inputs of spring that are not held"),
    ],
)
def test_engine_and_python_in_turn_give_the_same_bits(
    make: Callable[..., System], left: str, master: str, version: int
) -> None:
    what = make(version, master=master)
    with Simulation(what) as simulation:
        simulation.initialise()
        if make is not shaped or master == "ordered":
            assert left in simulation.report.engine
    fast, slow = recorded(what, 1.0), recorded(what, 1.0, engine=False)
    assert fast.names == slow.names
    np.testing.assert_array_equal(fast.time, slow.time)
    for name in fast.names:
        assert fast[name].tobytes() == slow[name].tobytes(), name


def test_texts_arrive_in_a_run_of_engine_and_python() -> None:
    with Simulation(texts()) as simulation:
        simulation.run(0.1)
        simulation.set("one.string_in", "new")
        simulation.run(0.2)
        assert simulation.get("two.string_out") == "new"


def test_a_component_in_python_can_end_the_run_of_the_engine() -> None:
    stair = spec("stair", "stair")
    stair = replace(stair, options={"interface": "ModelExchange"})
    with Simulation(system([spec("decay", "decay"), stair], [], step=0.3)) as simulation:
        assert not simulation.run(20.0)
        assert simulation.ended == "stair ended the run at t = 10 s"
        assert simulation.time == pytest.approx(9.9)


@pytest.mark.parametrize("what", [lambda: pair(master="iterative"), lambda: pair(master="adaptive")])
def test_masters_that_go_back_run_in_python(what: Callable[[], System]) -> None:
    with Simulation(what()) as simulation:
        simulation.run(0.2)
        assert simulation.report.engine == f"master {simulation.system.run.master} runs in Python"


def test_without_a_compiler_the_master_in_python_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    from orchestrator.cosim.engine import table

    monkeypatch.setattr(table, "native_library", lambda: None)
    with Simulation(pair()) as simulation:
        simulation.run(0.1)
        assert simulation.report.engine == "there is no C compiler"


def test_64_bit_inputs_that_nothing_drives_are_recorded_at_every_point(tmp_path: Path) -> None:
    given = {"int64_in": 5, "uint64_in": 2**64 - 1}
    made = system([spec("one", "feedthrough", 3, **given)], [], step=0.1)
    recorder = recorder_for(tmp_path / "x.csv")
    run_system(made, recorder, RunOptions(stop=0.3, record=("one.*int64_*",), isolate=False))

    result = read_result(tmp_path / "x.csv")

    assert {name.partition("nt64_")[0] for name in result.names} == {"one.i", "one.ui"}
    for name in result.names:
        np.testing.assert_array_equal(result[name], np.full(4, 5.0 if "uint" not in name else 2.0**64), name)
