"""Masters: the order at which their error shrinks, algebraic loops, own steps, what stops a run."""

import math
from typing import Any

import numpy as np
import pytest
from small_fmus import small_fmu
from systems import PAIR_EXACT, pair, recorded, ring, spec, system

from fmus.errors import ComponentError, MisfitError
from orchestrator.cosim import Component, ComponentSpec, Connection, Port, RunSettings, StepEnd, System
from orchestrator.cosim.masters import MASTERS
from orchestrator.cosim.simulation import Simulation

FIXED = [name for name, kind in MASTERS.items() if not kind.adaptive]


def error_at_ten(master: str, step: float, **options: Any) -> float:
    with Simulation(pair(step=step, master=master, tolerance=1e-10, options=options)) as simulation:
        simulation.run(10.0)
        return abs(simulation.get("mass.x") - PAIR_EXACT)


@pytest.mark.parametrize("master", FIXED)
def test_the_error_shrinks_with_the_step_at_the_declared_order(master: str) -> None:
    steps = [0.002, 0.001, 0.0005] if MASTERS[master].order == 1 else [0.02, 0.01, 0.005]
    errors = [error_at_ten(master, step) for step in steps]
    slopes = np.diff(np.log(errors)) / np.diff(np.log(steps))
    # The next order of the error still shows at the first of these steps.
    assert slopes[-1] == pytest.approx(MASTERS[master].order, abs=0.1)


def test_extrapolated_inputs_gain_an_order() -> None:
    steps = [0.002, 0.001, 0.0005]
    errors = [error_at_ten("ordered", step, extrapolation=1) for step in steps]
    slopes = np.diff(np.log(errors)) / np.diff(np.log(steps))
    assert slopes[-1] == pytest.approx(2.0, abs=0.1)


def test_an_fmu_that_interpolates_its_inputs_gets_their_slopes() -> None:
    able = {
        'canHandleVariableCommunicationStepSize="true"': 'canInterpolateInputs="true" canHandleVariableCommunicationStepSize="true"'
    }
    mass = spec("mass", "mass")
    errors = []
    steps = [0.002, 0.001, 0.0005]
    for step in steps:
        what = pair(step=step, options={"extrapolation": 1})
        smooth = ComponentSpec("mass", source=str(small_fmu("mass", replace=able)), options=mass.options)
        with Simulation(what.with_component(smooth)) as simulation:
            simulation.run(10.0)
            errors.append(abs(simulation.get("mass.x") - PAIR_EXACT))
    slopes = np.diff(np.log(errors)) / np.diff(np.log(steps))
    assert slopes[-1] == pytest.approx(2.0, abs=0.1)
    # It does with the slope what another cannot do with the value in the middle.
    assert errors[-1] != error_at_ten("ordered", steps[-1], extrapolation=1)


def test_the_iterative_master_is_an_order_better_at_the_same_step() -> None:
    assert error_at_ten("iterative", 0.01) < 0.1 * error_at_ten("ordered", 0.01)


def test_the_adaptive_master_is_as_good_as_its_tolerance_asks() -> None:
    errors = []
    for tolerance in (1e-4, 1e-5, 1e-6):
        with Simulation(pair(master="adaptive", tolerance=tolerance)) as simulation:
            simulation.run(2.0)
            errors.append(abs(simulation.get("mass.x") - math.cos(2.0 * math.sqrt(10.0))))
    # The error of a step is of order two, so the error in the end follows the root of the tolerance.
    assert errors[0] / errors[1] == pytest.approx(math.sqrt(10.0), rel=0.3)
    assert errors[1] / errors[2] == pytest.approx(math.sqrt(10.0), rel=0.3)


def test_the_adaptive_master_meets_an_event_that_a_component_ends_its_step_at() -> None:
    from orchestrator.results.recorder import MemoryRecorder

    ball = spec("ball", "ball", 3)
    ball = ComponentSpec("ball", source=ball.source, options={**ball.options, "early_return": True})
    recorder = MemoryRecorder()
    with Simulation(system([ball], [], step=0.1, master="adaptive", tolerance=1e-3)) as simulation:
        simulation.run(1.0, recorder)
    bounce = math.sqrt(2.0 / 9.81)
    assert np.min(np.abs(recorder.result().time - bounce)) < 1e-7


def test_ordered_evaluation_gives_the_known_value_of_the_benchmark() -> None:
    with Simulation(pair(step=1e-4)) as simulation:
        simulation.run(10.0)
        assert simulation.get("mass.x") == pytest.approx(0.981116, abs=5e-7)


def test_ordered_outputs_belong_to_one_instant() -> None:
    result = recorded(pair(step=0.01), 1.0)
    np.testing.assert_array_equal(result["spring.f2"], -10.0 * result["mass.x"])


def test_jacobi_forces_are_one_step_late() -> None:
    result = recorded(pair(step=0.01, master="jacobi"), 1.0)
    np.testing.assert_array_equal(result["spring.f2"][1:], -10.0 * result["mass.x"][:-1])


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("master", ["ordered", "jacobi", "gauss_seidel", "iterative"])
def test_a_loop_of_two_halves_is_exactly_two(master: str, version: int) -> None:
    with Simulation(ring({}, {}, version=version, master=master)) as simulation:
        simulation.initialise()
        assert [simulation.get("g0.y"), simulation.get("g1.u")] == [2.0, 2.0]
        assert simulation.report.loops


def test_a_loop_of_gain_minus_three_is_a_quarter() -> None:
    with Simulation(ring({"a": -3.0, "b": 1.0}, {"a": 1.0, "b": 0.0})) as simulation:
        simulation.run(0.3)
        assert simulation.get("g0.y") == pytest.approx(0.25, rel=1e-15)


@pytest.mark.parametrize("master", ["ordered", "jacobi", "gauss_seidel"])
def test_a_loop_of_gain_minus_three_follows_its_input(master: str) -> None:
    # y = -3 u + b with u = y: b / 4 at every point; going around once a step would run away.
    parts = [spec("decay", "decay"), spec("one", "gain", a=-3.0), spec("two", "gain", a=1.0, b=0.0)]
    what = system(parts, [("one.y", "two.u"), ("two.y", "one.u"), ("one.y", "decay.u")], step=0.1, master=master)
    with Simulation(what) as simulation:
        for k in range(30):
            simulation.set("one.b", float(k))
            simulation.step()
            assert simulation.get("one.y") == pytest.approx(k / 4.0, rel=1e-13)


def test_a_loop_of_gain_one_is_an_error_that_names_it() -> None:
    words = "algebraic loop g.*g0.y.* has no unique solution at t = 0 s: its gain is 1;"
    with Simulation(ring({"a": 2.0}, {"a": 0.5})) as simulation, pytest.raises(ComponentError, match=words):
        simulation.initialise()


class Square(Component):
    """y = u^2 - 0.75, which offers no derivatives; its loop has the solutions 1.5 and -0.5."""

    def __init__(self, specification: ComponentSpec, start: float) -> None:
        self.ports = (Port("u", "input", start=start), Port("y", "output"))
        self.feedthrough = {"y": ("u",)}
        self.u = start

    def initialise(self, time: float, stop: float | None, tolerance: float | None) -> None: ...
    def start(self) -> None: ...
    def terminate(self) -> None: ...
    def set(self, names: Any, values: Any) -> None:
        (self.u,) = values

    def get(self, names: Any) -> list[float]:
        return [self.u * self.u - 0.75]

    def step(self, time: float, size: float) -> StepEnd:
        return StepEnd(time + size)


def looped(make: Any, monkeypatch: pytest.MonkeyPatch) -> Simulation:
    """One component whose output y drives its input u."""
    from orchestrator.cosim import assembly

    monkeypatch.setattr(assembly, "describe", lambda specification, folder: make(specification))
    return Simulation(System("loop", {"f": ComponentSpec("f")}, (Connection("f.y", "f.u"),), run=RunSettings(step=0.1)))


def test_a_nonlinear_loop_without_derivatives_is_solved_by_differences(monkeypatch: pytest.MonkeyPatch) -> None:
    with looped(lambda specification: Square(specification, 2.0), monkeypatch) as simulation:
        simulation.run(0.1)
        assert simulation.get("f.y") == pytest.approx(1.5, rel=1e-10)


def test_a_loop_without_a_solution_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    class Above(Square):
        def get(self, names: Any) -> list[float]:
            return [self.u * self.u + 1.0]

    words = "algebraic loop .* has no (unique )?solution"
    with (
        looped(lambda specification: Above(specification, 2.0), monkeypatch) as simulation,
        pytest.raises(ComponentError, match=words),
    ):
        simulation.initialise()


def test_a_slow_component_steps_when_the_others_have_arrived() -> None:
    slow = spec("slow", "decay")
    slow = ComponentSpec("slow", source=slow.source, options=slow.options, step=0.5)
    result = recorded(system([spec("fast", "decay"), slow], [], step=0.1), 1.0)
    np.testing.assert_allclose(result["fast.x"], np.exp(-result.time), rtol=1e-13)
    expected = np.exp(-np.repeat([0.0, 0.5, 1.0], [5, 5, 1]))
    np.testing.assert_allclose(result["slow.x"], expected, rtol=1e-13)


def test_a_fast_component_takes_several_steps() -> None:
    fast = spec("fast", "decay", longest=0.025)
    fast = ComponentSpec("fast", source=fast.source, options=fast.options, values=fast.values, step=0.025)
    result = recorded(system([fast], [], step=0.1), 1.0)
    np.testing.assert_allclose(result["fast.x"], np.exp(-result.time), rtol=1e-13)


def test_an_own_step_that_does_not_fit_is_refused() -> None:
    odd = spec("odd", "decay")
    odd = ComponentSpec("odd", source=odd.source, options=odd.options, step=0.03)
    with pytest.raises(
        MisfitError, match="odd: its step 0.03 s is neither a multiple nor a fraction of the communication step 0.1 s"
    ):
        Simulation(system([odd], [], step=0.1))


def test_smoothed_inputs_follow_with_their_time_constant() -> None:
    # A jump of the input from 0 to 1 reaches the integrator x' = u (- 1e-9 x) as 1 - exp(-t / tau).
    tau, h = 0.2, 0.001
    parts = [spec("source", "gain", a=0.0, b=0.0), spec("sink", "decay", k=1e-9)]
    what = system(parts, [("source.y", "sink.u")], step=h, options={"smoothing_s": tau})
    with Simulation(what) as simulation:
        simulation.step()
        begin = simulation.get("sink.x")
        simulation.set("source.b", 1.0)
        simulation.step()
        simulation.run(1.0 + 2 * h)
        end = simulation.get("sink.x")
    expected = 1.0 - tau * (1.0 - math.exp(-1.0 / tau))
    assert end - begin == pytest.approx(expected, abs=2 * h)


@pytest.mark.parametrize("engine", [True, False])
def test_a_value_that_is_no_number_stops_the_run_and_says_where(engine: bool) -> None:
    # k = -1000 grows by exp(100) a step: infinite in the eighth.
    what = system([spec("decay", "decay", k=-1000.0), spec("gain", "gain")], [("decay.x", "gain.u")], step=0.1)
    words = r"decay.x = inf at t = 0.8 s is not a finite number; last good state is t = 0.7 s"
    with Simulation(what, engine=engine) as simulation, pytest.raises(ComponentError, match=words):
        simulation.run(10.0)


@pytest.mark.parametrize("engine", [True, False])
def test_a_value_outside_its_range_stops_the_run(engine: bool, tmp_path: Any) -> None:
    narrow = small_fmu(
        "decay",
        replace={
            'name="x" valueReference="0" causality="output" variability="continuous" initial="calculated"><Real': 'name="x" valueReference="0" causality="output" variability="continuous" initial="calculated"><Real min="0.5" max="2"'
        },
    )
    what = system([ComponentSpec("decay", source=str(narrow), options={"interface": "CoSimulation"})], [], step=0.1)
    words = r"decay.x = 0.496585304 at t = 0.7 s is outside \[0.5, 2\]; last good state is t = 0.6 s"
    with Simulation(what, engine=engine) as simulation, pytest.raises(ComponentError, match=words):
        simulation.run(10.0)


def test_the_rows_until_a_failure_are_recorded() -> None:
    from orchestrator.results.recorder import MemoryRecorder

    what = system([spec("decay", "decay", k=-1000.0)], [], step=0.1)
    recorder = MemoryRecorder()
    with Simulation(what) as simulation, pytest.raises(ComponentError):
        simulation.run(10.0, recorder)
    np.testing.assert_allclose(recorder.result().time, 0.1 * np.arange(8), rtol=1e-12)


@pytest.mark.parametrize("engine", [True, False])
@pytest.mark.parametrize("version", [2, 3])
def test_a_refused_step_stops_the_run(engine: bool, version: int) -> None:
    what = system([spec("decay", "decay", version, longest=0.05)], [], step=0.1)
    words = r"FMU 'decay' refused the step at t = 0 s \(step 0.1 s\): status Discard; .*; it says: the step does not suit me \(7\)"
    with Simulation(what, engine=engine) as simulation, pytest.raises(ComponentError, match=words):
        simulation.run(1.0)


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("step", [0.5, 0.8])
def test_a_component_can_end_the_run(version: int, step: float) -> None:
    from orchestrator.results.recorder import MemoryRecorder

    recorder = MemoryRecorder()
    with Simulation(system([spec("stair", "stair", version)], [], step=step)) as simulation:
        assert not simulation.run(20.0, recorder)
        assert simulation.ended == "stair ended the run at t = 10 s"
    # Rows go as far as steps were complete.
    assert recorder.result().time[-1] == (10.0 if step == 0.5 else pytest.approx(9.6))


def test_a_step_that_does_not_settle_is_an_error_with_the_value_that_moves() -> None:
    words = r"the step from t = 0 s \(step 0.1 s\) did not settle in 1 turns: .* still moves by .*; take a smaller step"
    what = pair(step=0.1, master="iterative", options={"turns": 1})
    with Simulation(what) as simulation, pytest.raises(ComponentError, match=words):
        simulation.step()


def test_a_tolerance_that_no_step_meets_is_an_error() -> None:
    words = r"the error stays above the tolerance 1e-12 at t = 0 s although the step has shrunk to"
    what = pair(step=0.1, master="adaptive", tolerance=1e-12, options={"smallest_step": 1e-3})
    with Simulation(what) as simulation, pytest.raises(ComponentError, match=words):
        simulation.run(1.0)


def test_a_master_with_rollback_refuses_components_that_cannot_go_back(monkeypatch: pytest.MonkeyPatch) -> None:
    from orchestrator.cosim import assembly

    monkeypatch.setattr(assembly, "describe", lambda specification, folder: Square(specification, 2.0))
    what = System("one", {"f": ComponentSpec("f")}, run=RunSettings(step=0.1, master="iterative"))
    with pytest.raises(MisfitError, match="master 'iterative' goes back in time, but f cannot save the state"):
        Simulation(what)


@pytest.mark.parametrize("master", MASTERS)
def test_an_unknown_option_is_refused(master: str) -> None:
    with pytest.raises(MisfitError, match=f"master '{master}' has no option 'magic'; it has"):
        Simulation(pair(master=master, options={"magic": 1}))


def test_an_unknown_master_is_refused() -> None:
    with pytest.raises(MisfitError, match="there is no master 'grand'; choose from ordered, jacobi"):
        Simulation(pair(master="grand"))
