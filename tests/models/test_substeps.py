"""How many integration steps a sample needs."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from fmus.symbolic.system import SymbolicSystem, Variable
from orchestrator.models.compiled import CompiledModel
from orchestrator.models.symbolic import enough_substeps

# Fourth-order Runge-Kutta is stable along the negative real axis down to this (Hairer and Wanner, Solving ODEs II, IV.2).
STABLE = 2.785


def decay() -> CompiledModel:
    """dx/dt = r (u - x): stiff against steps longer than 1/r."""
    t, x, u, d, r = (ca.SX.sym(name, n) for name, n in zip("txudr", (1, 1, 1, 0, 1), strict=True))
    nothing = ca.SX(0, 1)
    system = SymbolicSystem(
        name="Decay",
        description="",
        inputs=(Variable("u"),),
        states=(Variable("x", start=0.0),),
        algebraics=(),
        parameters=(Variable("r", "1/s", start=1.0),),
        dependents=(),
        outputs=("x",),
        rhs=ca.Function("rhs", [t, x, u, d, r], [r * (u - x), nothing]),
        history=ca.Function("history", [t, u, r], [nothing, nothing]),
        dependent=ca.Function("dependent", [r], [nothing]),
        initial=ca.Function("initial", [r], [ca.SX(0)]),
    )
    return CompiledModel(system, ["x"])


@pytest.mark.parametrize("rate", [1.0, 500.0, 5000.0])
def test_substeps_keep_a_stiff_state_stable_and_are_no_more_than_that_takes_to_settle(rate: float) -> None:
    time = np.linspace(0, 10, 1001)
    inputs = np.sin(time)[:, None]

    count = enough_substeps(decay(), time, inputs, np.array([rate]), np.zeros(1), 1e-2)

    width = rate * 0.01
    assert width / count < STABLE
    # A hundredth is reached well before eight steps for each time constant.
    assert count <= max(1, 8 * width)


def test_run_that_overflows_with_one_step_asks_for_more() -> None:
    time = np.linspace(0, 20, 2001)
    model = decay()
    with np.errstate(all="ignore"), pytest.raises(Exception, match="left the finite numbers"):
        model.run(time, np.sin(time)[:, None], np.array([2000.0]), np.zeros(1))

    assert enough_substeps(model, time, np.sin(time)[:, None], np.array([2000.0]), np.zeros(1), 1e-5) >= 8


def test_a_run_far_from_the_measurement_takes_fewer_steps_and_still_errs_by_little_of_that_distance() -> None:
    time = np.linspace(0, 10, 1001)
    inputs, rate, start = np.sign(np.sin(time))[:, None], np.array([50.0]), np.zeros(1)
    model = decay()
    exact = model.run(time, inputs, rate, start, substeps=64).outputs
    measured = exact + 0.1

    close = enough_substeps(model, time, inputs, rate, start, 1e-5, 1e-4)
    enough = enough_substeps(model, time, inputs, rate, start, 1e-5, 1e-4, measured)

    error = model.run(time, inputs, rate, start, substeps=enough).outputs - exact
    assert enough < close
    assert np.sqrt(np.mean(error**2)) < 0.01 * 0.1


def test_steps_are_as_short_as_a_contact_needs_and_no_shorter_elsewhere() -> None:
    """A ball on a stiff floor: |v| is the same after each bounce, at steps too long for one of them to see the floor."""
    t, x, u, d, p = (ca.SX.sym(name, n) for name, n in zip("txudp", (1, 2, 0, 0, 1), strict=True))
    nothing = ca.SX(0, 1)
    depth = 0.5 * (ca.sqrt(x[0] ** 2 + 1e-12) - x[0])
    system = SymbolicSystem(
        name="Ball",
        description="",
        inputs=(),
        states=(Variable("x", start=0.01), Variable("v", start=-1.0)),
        algebraics=(),
        parameters=(Variable("k", "N/m", start=1e5),),
        dependents=(),
        outputs=("x", "v"),
        rhs=ca.Function("rhs", [t, x, u, d, p], [ca.vertcat(x[1], p * depth), nothing]),
        history=ca.Function("history", [t, u, p], [nothing, nothing]),
        dependent=ca.Function("dependent", [p], [nothing]),
        initial=ca.Function("initial", [p], [ca.DM([0.01, -1.0])]),
    )
    time, parameters, start = np.linspace(0, 0.1, 26), np.array([1e5]), np.array([0.01, -1.0])
    speeds = []
    for contacts in (False, True):
        model = CompiledModel(replace(system, contacts=contacts), ["x", "v"])
        run = model.run(time, np.zeros((26, 0)), parameters, start, sensitivities=True)
        speeds.append(run.outputs[-1, 1])
        assert not contacts or enough_substeps(model, time, np.zeros((26, 0)), parameters, start, 1e-5) == 1

    assert abs(speeds[0] - 1.0) > 0.02
    assert speeds[1] == pytest.approx(1.0, abs=1e-5)
    assert run.sensitivities is not None
    # What comes in faster goes out faster.
    assert run.sensitivities[-1, 1, 1] == pytest.approx(-1.0, abs=0.02)


def test_step_that_overflows_is_halved_until_it_does_not() -> None:
    """x' = -x^9 has the solution (x0^-8 + 8 t)^(-1/8); steps of 40 ms from 2 overflow."""
    t, x, u, d, p = (ca.SX.sym(name, n) for name, n in zip("txudp", (1, 1, 0, 0, 0), strict=True))
    nothing = ca.SX(0, 1)
    system = SymbolicSystem(
        name="Fall",
        description="",
        inputs=(),
        states=(Variable("x", start=2.0),),
        algebraics=(),
        parameters=(),
        dependents=(),
        outputs=("x",),
        rhs=ca.Function("rhs", [t, x, u, d, p], [-(x**9), nothing]),
        history=ca.Function("history", [t, u, p], [nothing, nothing]),
        dependent=ca.Function("dependent", [p], [nothing]),
        initial=ca.Function("initial", [p], [ca.DM([2.0])]),
        contacts=True,
    )
    time = np.linspace(0, 0.4, 11)

    run = CompiledModel(system, ["x"]).run(time, np.zeros((11, 0)), np.zeros(0), np.array([2.0]))

    assert run.outputs[:, 0] == pytest.approx((2.0**-8 + 8 * time) ** -0.125, rel=1e-6)
