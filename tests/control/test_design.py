"""Gains and margins of loops whose answers are known, and linearisation against the equations."""

import casadi as ca
import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from fmus.errors import MisfitError
from orchestrator.control.arm import PORTS, arm_component
from orchestrator.control.design import Wanted, gains, linearised
from tests.benchmarks.control.run import margins

# A mass: angle and speed, torque over inertia.
INERTIA = 0.5
A, B = np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1.0 / INERTIA]])
FINE = 1e-4


def test_gains_of_a_free_mass_are_those_of_its_formula():
    wanted = Wanted(angle=0.1, speed=1.0, torque=2.0)
    # Riccati equation of a double integrator: k1 = torque/angle, k2 = sqrt((torque/speed)^2 + 2 inertia k1).
    first = wanted.torque / wanted.angle
    second = np.sqrt((wanted.torque / wanted.speed) ** 2 + 2 * INERTIA * first)
    assert gains(A, B, wanted) == pytest.approx(np.array([[first, second]]), rel=1e-8)


def test_what_no_torque_reaches_cannot_be_held():
    with pytest.raises(MisfitError, match="no feedback holds this posture"):
        gains(np.diag([1.0, 2.0]), np.array([[0.0], [0.0]]), Wanted())


def test_margins_of_a_regulator_without_delay_are_those_that_theory_promises():
    found = margins(A, B, gains(A, B, Wanted()), FINE, delay_steps=0)
    assert found.modulus > 0.98  # at least 1, but for the sampling
    assert found.phase[0] > np.radians(60)
    assert found.decay > 0


def test_phase_and_delay_are_those_of_the_closed_formula():
    k1, k2 = 20.0, 6.0
    found = margins(A, B, np.array([[k1, k2]]), FINE, delay_steps=0)
    # |L| = sqrt(k1^2 + (k2 w)^2) / (inertia w^2) = 1.
    w = np.sqrt(np.roots([INERTIA**2, -(k2**2), -(k1**2)]).max())
    phase = np.arctan2(k2 * w, k1)
    assert found.phase[0] == pytest.approx(phase, abs=2e-3)
    assert found.delay == pytest.approx(phase / w, rel=2e-3)


def test_a_loop_bears_as_much_delay_as_its_margin_says_and_no_more():
    feedback, step = gains(A, B, Wanted()), 0.005
    spare = margins(A, B, feedback, step, delay_steps=0).delay / step
    assert margins(A, B, feedback, step, delay_steps=int(spare)).decay > 0
    assert margins(A, B, feedback, step, delay_steps=int(spare) + 1).decay < 0


def test_a_joint_that_is_driven_the_wrong_way_has_no_stable_loop():
    assert margins(A, -B, gains(A, B, Wanted()), 0.005).decay < 0


def test_two_joints_that_do_not_touch_have_the_margins_of_each():
    a, b = np.zeros((4, 4)), np.zeros((4, 2))
    a[:2, 2:] = np.eye(2)
    b[2:] = np.diag([1.0 / INERTIA, 4.0])
    feedback = np.array([[20.0, 0.0, 6.0, 0.0], [0.0, 9.0, 0.0, 3.0]])
    both = margins(a, b, feedback, FINE)
    alone = [
        margins(A, np.array([[0.0], [g]]), k[None], FINE)
        for g, k in ((2.0, feedback[0, ::2]), (4.0, feedback[1, 1::2]))
    ]
    assert both.phase == pytest.approx([each.phase[0] for each in alone], rel=1e-6)
    assert both.modulus == pytest.approx(min(each.modulus for each in alone), rel=1e-6)


def test_an_fmu_linearised_by_itself_has_the_slopes_of_its_equations():
    system = find_modelica_model("arm").compile()
    at = dict(zip(PORTS.states, [0.8, 1.3, 0.2, -0.1], strict=True)) | dict.fromkeys(PORTS.activations, 0.2)
    a, b = linearised(arm_component(), PORTS.states, PORTS.activations, at)
    x, u = ca.SX.sym("x", 4), ca.SX.sym("u", len(system.inputs))
    p = ca.DM([v.start for v in system.parameters])
    dx, _ = system.rhs(0, x, u, ca.SX(0, 1), p)
    slopes = ca.Function("slopes", [x, u], [ca.jacobian(dx, x), ca.jacobian(dx, u)])
    names = [v.name for v in system.states]
    order = [names.index(name) for name in PORTS.states]
    inputs = [0.2 if v.name in PORTS.activations else 0.0 for v in system.inputs]
    by_x, by_u = (np.array(part) for part in slopes([at[name] for name in names], inputs))
    columns = [[v.name for v in system.inputs].index(name) for name in PORTS.activations]
    assert np.allclose(a, by_x[np.ix_(order, order)], rtol=1e-10, atol=1e-12)
    assert np.allclose(b, by_u[np.ix_(order, columns)], rtol=1e-10, atol=1e-12)
