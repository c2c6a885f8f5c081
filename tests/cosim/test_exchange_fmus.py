"""Model exchange FMUs: accuracy, events of all kinds, several as one system of equations."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from systems import PAIR_EXACT, pair, recorded, ring, spec, system

from fmus.errors import ComponentError
from orchestrator.cosim import ComponentSpec, System
from orchestrator.cosim.simulation import Simulation


def exchange(name: str, model: str, version: int = 2, **values: Any) -> ComponentSpec:
    """A component of a small FMU, run by model exchange."""
    return replace(spec(name, model, version, **values), options={"interface": "ModelExchange"})


def all_exchanged(what: System) -> System:
    """The same system with every component run by model exchange."""
    specs = {name: replace(each, options={"interface": "ModelExchange"}) for name, each in what.components.items()}
    return replace(what, components=specs)


@pytest.mark.parametrize("version", [2, 3])
def test_a_decay_is_integrated_to_its_tolerance(version: int) -> None:
    for tolerance in (1e-4, 1e-8):
        with Simulation(
            system([exchange("decay", "decay", version, k=2.0)], [], step=0.5, tolerance=tolerance)
        ) as simulation:
            simulation.run(2.0)
            assert simulation.get("decay.x") == pytest.approx(math.exp(-4.0), abs=10 * tolerance)


def test_a_stiff_decay_takes_the_implicit_method() -> None:
    # x' = -1e6 x + 1e6 at rest within microseconds; an explicit method would need 3e5 steps for each second.
    with Simulation(system([exchange("decay", "decay", k=1e6)], [], step=1.0)) as simulation:
        simulation.set("decay.u", 1e6)
        simulation.run(100.0)
        assert simulation.get("decay.x") == pytest.approx(1.0, abs=1e-5)


@pytest.mark.parametrize("version", [2, 3])
def test_a_ball_bounces_as_in_closed_form(version: int) -> None:
    result = recorded(system([exchange("ball", "ball", version)], [], step=0.01, tolerance=1e-9), 3.0)
    exact = recorded(system([spec("ball", "ball", version)], [], step=0.01), 3.0)
    # At a speed of 4.4 m/s an error of time of 1e-8 s is one of height of 5e-8 m.
    np.testing.assert_allclose(result["ball.h"], exact["ball.h"], atol=1e-6)
    assert result["ball.h"][-1] == 0.0


@pytest.mark.parametrize("version", [2, 3])
def test_stairs_go_up_at_the_second_and_end_at_ten(version: int) -> None:
    what = system([exchange("stair", "stair", version)], [], step=0.25)
    result = recorded(what, 12.0)
    assert result.time[-1] == 10.0
    np.testing.assert_array_equal(result["stair.counter"], np.minimum(1 + np.floor(result.time), 10))


@pytest.mark.parametrize("version", [2, 3])
def test_coupled_equations_have_no_coupling_error(version: int) -> None:
    what = all_exchanged(pair(version, step=0.1, tolerance=1e-10))
    with Simulation(what) as simulation:
        assert simulation.report.together == ("mass, spring",)
        simulation.run(10.0)
        assert simulation.get("mass.x") == pytest.approx(PAIR_EXACT, abs=1e-8)
        assert simulation.get("spring.f2") == pytest.approx(-10.0 * PAIR_EXACT, abs=1e-7)


def test_the_communication_step_does_not_change_coupled_equations() -> None:
    ends = []
    for step in (0.5, 0.05):
        with Simulation(all_exchanged(pair(step=step, tolerance=1e-10))) as simulation:
            simulation.run(5.0)
            ends.append(simulation.get("mass.x"))
    assert ends[0] == pytest.approx(ends[1], abs=1e-8)


def test_equations_and_cosimulation_mix() -> None:
    what = pair(step=1e-3)
    mixed = {**what.components, "mass": replace(what.components["mass"], options={"interface": "ModelExchange"})}
    with Simulation(replace(what, components=mixed)) as simulation:
        assert simulation.report.together == ()
        simulation.run(1.0)
        # An exact step for constant forces on one side, an accurate integrator on the other.
        assert simulation.get("mass.x") == pytest.approx(recorded(what, 1.0)["mass.x"][-1], abs=1e-6)


def test_equations_in_an_algebraic_loop_are_coupled_at_communication_points() -> None:
    with Simulation(all_exchanged(ring({}, {}))) as simulation:
        assert simulation.report.together == ()
        simulation.run(0.3)
        assert simulation.get("g0.y") == 2.0


@pytest.mark.parametrize("master", ["iterative", "adaptive"])
def test_equations_go_back_in_time(master: str) -> None:
    what = pair(step=0.01, master=master, tolerance=1e-7)
    mixed = {**what.components, "mass": replace(what.components["mass"], options={"interface": "ModelExchange"})}
    with Simulation(replace(what, components=mixed)) as simulation:
        simulation.run(1.0)
        assert simulation.get("mass.x") == pytest.approx(math.cos(math.sqrt(10.0)), abs=2e-3)


def test_an_input_that_jumps_takes_effect_at_once() -> None:
    with Simulation(system([exchange("decay", "decay", k=1.0)], [], step=0.5, tolerance=1e-9)) as simulation:
        simulation.run(1.0)
        simulation.set("decay.u", 1.0)
        simulation.run(2.0)
        expected = 1.0 + (math.exp(-1.0) - 1.0) * math.exp(-1.0)
        assert simulation.get("decay.x") == pytest.approx(expected, abs=1e-8)


def test_a_solution_that_runs_away_is_an_error_with_state_and_time() -> None:
    what = system([exchange("decay", "decay", k=-1e5)], [], step=0.01)
    words = r"(FMU 'decay' cannot be integrated on from t = .* s: .* 'x'|decay.x = inf at t = )"
    with Simulation(what) as simulation, pytest.raises(ComponentError, match=words):
        simulation.run(1.0)
