"""Compiled free runs: closed forms, delays, sensitivities against finite differences."""

import casadi as ca
import numpy as np
import pytest

from fmus.catalogue import ModelicaModel, find_modelica_model
from fmus.errors import ComponentError, ModelicaError
from fmus.symbolic.system import SymbolicSystem, Variable
from orchestrator.models.compiled import CompiledModel
from orchestrator.models.patch import Attachment, check_attached, patched_model

TIME = np.linspace(0, 1, 501)


def lag(delay: float = 0.0) -> SymbolicSystem:
    """tau dx/dt = u(t - delay) - x, y = 2 x + u."""
    t, x, u, d, p = (ca.SX.sym(name) for name in "txudp")
    both = ca.vertcat(p, ca.SX.sym("delay"))
    return SymbolicSystem(
        name="Lag",
        description="",
        inputs=(Variable("u"),),
        states=(Variable("x", start=0.0),),
        algebraics=(Variable("y"),),
        parameters=(Variable("tau", "s", start=0.1), Variable("delay", "s", start=delay)),
        dependents=(),
        outputs=("y",),
        rhs=ca.Function("rhs", [t, x, u, d, both], [(d - x) / p, 2 * x + u]),
        history=ca.Function("history", [t, u, both], [u, both[1]]),
        dependent=ca.Function("dependent", [both], [ca.SX(0, 1)]),
        initial=ca.Function("initial", [both], [ca.SX(0)]),
    )


@pytest.mark.parametrize("delay", [0.0, 0.0007, 0.1, 0.7])
def test_delayed_ramp_through_a_lag_follows_its_closed_form(delay: float) -> None:
    model = CompiledModel(lag(delay), ["y"])

    y = model.run(TIME, TIME[:, None], model.parameters, np.zeros(1), substeps=2).outputs[:, 0]

    late = np.maximum(TIME - delay, 0)
    expected = 2 * (late - 0.1 * (1 - np.exp(-late / 0.1))) + TIME
    # The kink inside a step of 1 ms costs the fourth-order method about step^2.
    assert np.abs(y - expected).max() < 2e-6


def test_sensitivities_equal_central_differences_including_the_delay() -> None:
    model = CompiledModel(lag(0.1003), ["y"], ["tau", "delay"])
    inputs = np.sin(9 * TIME)[:, None]

    def run(tau: float, delay: float, start: float) -> np.ndarray:
        return model.run(TIME, inputs, model.with_values([tau, delay]), np.array([start])).outputs[:, 0]

    slopes = model.run(
        TIME, inputs, model.with_values([0.1, 0.1003]), np.array([0.2]), sensitivities=True
    ).sensitivities
    assert slopes is not None
    e = 1e-6
    for k, step in enumerate([(0, 0, e), (e, 0, 0), (0, e, 0)]):
        up = run(0.1 + step[0], 0.1003 + step[1], 0.2 + step[2])
        down = run(0.1 - step[0], 0.1003 - step[1], 0.2 - step[2])
        # Inputs are piecewise linear, so the slope in the delay jumps at kinks: compare away from single samples.
        assert np.quantile(np.abs((up - down) / (2 * e) - slopes[:, 0, k]), 0.9) < 1e-3 * np.abs(slopes[:, 0, k]).max()


def test_error_shrinks_with_the_fourth_power_of_the_step() -> None:
    model = CompiledModel(find_modelica_model("arm").compile(), ["q1", "q2"])
    inputs = np.tile([0.3, 0.3, 0.3, 0.3, 0.3, 0.3, 1.0, -1.0, 0, 0], (51, 1))
    time, start = np.linspace(0, 1, 51), np.array([0.8, 1.2, 1.0, -1.0])
    runs = [model.run(time, inputs, model.parameters, start, substeps=n).outputs for n in (4, 8, 64)]

    coarse, fine = (np.abs(run - runs[2]).max() for run in runs[:2])

    assert 3.0 < np.log2(coarse / fine) < 5.0


def test_run_that_leaves_the_finite_numbers_names_the_time() -> None:
    model = CompiledModel(lag(), ["y"])
    with pytest.raises(ComponentError, match=r"Lag left the finite numbers at t = 0\.\d+ s"):
        model.run(TIME, np.ones((len(TIME), 1)), np.array([-1e-3, 0.0]), np.zeros(1))


def test_effect_that_the_front_end_drops_is_noticed() -> None:
    arm = find_modelica_model("arm")
    attachment = Attachment(
        "jointTorque1", "FESArm.Effects.JointTorque.ViscousFriction", {"b": {"b[1]": 0.1, "b[2]": 0.2}}
    )
    patched = patched_model(arm, "Patched", [attachment])

    check_attached(patched.compile(), [attachment])
    with pytest.raises(ModelicaError, match="did not arrive in slot jointTorque1 of FESArm.Arms.Arm"):
        check_attached(ModelicaModel("arm", "FESArm.Arms.Arm").compile(), [attachment])
