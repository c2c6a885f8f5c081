"""The arm, from Modelica to FMU, against the same equations written down independently and integrated by SciPy."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fmus.catalogue import find_modelica_model
from fmus.package import build_fmu
from orchestrator.blackbox.source import fmu_model
from orchestrator.models.compiled import CompiledModel

TIME = np.linspace(0.0, 3.0, 751)
START = {"linkage.q[1]": 0.7, "linkage.q[2]": 1.3, "linkage.w[1]": 0.2, "linkage.w[2]": -0.4}

F_MAX = np.array([800, 800, 1000, 1000, 700, 700.0])
L_SLACK = np.array([0.0538, 0.0538, 0.2298, 0.1905, 0.1905, 0.0175])
L_OPT = np.array([0.1280, 0.1280, 0.1422, 0.0877, 0.0877, 0.1028])
V_MAX = 10 * L_OPT
LENGTH_0 = np.array([0.1840, 0.1055, 0.4283, 0.1916, 0.2387, 0.1681])
ARMS = {
    "arm": np.array([[0.05, -0.05, 0.03, -0.03, 0, 0], [0, 0, 0.03, -0.03, -0.03, 0.03]]),
    "arm-paper": np.array([[0.05, 0.05, 0.03, 0.03, 0, 0], [0, 0, 0.03, 0.03, 0.03, 0.03]]),
}


def muscle_forces(name: str, alpha: np.ndarray, length: np.ndarray, speed: np.ndarray) -> np.ndarray:
    paper = name == "arm-paper"
    fibre = length if paper else length - L_SLACK
    c = V_MAX * 0.25 * 0.5 / 1.25
    shortening = np.maximum(0.0, (V_MAX + np.minimum(speed, 0)) / (V_MAX - np.minimum(speed, 0) / 0.25))
    lengthening = (1.5 * np.maximum(speed, 0) + c) / (np.maximum(speed, 0) + c)
    passive = 7500 * (length - L_SLACK) ** 2 if paper else 7500 * np.maximum(0, fibre - L_OPT) ** 2
    bell = np.exp(-(((fibre - L_OPT) / (0.65 * L_OPT)) ** 2))
    return alpha * F_MAX * bell * np.where(speed <= 0, shortening, lengthening) + passive


def accelerations(name: str, q: np.ndarray, w: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Lagrange's equations of two links, written with the kinetic energy's derivatives."""
    d = ARMS[name]
    tau = d @ muscle_forces(name, u[:6], LENGTH_0 - q @ d, -w @ d)
    (l1, l2), (m1, m2), (c1, c2), (i1, i2) = (0.33, 0.32), (1.93, 1.52), (0.165, 0.19), (0.0141, 0.0188)
    coupling = m2 * l1 * c2
    mass = np.array(
        [
            [i1 + i2 + m1 * c1**2 + m2 * (l1**2 + c2**2) + 2 * coupling * np.cos(q[1]), 0.0],
            [i2 + m2 * c2**2 + coupling * np.cos(q[1]), i2 + m2 * c2**2],
        ]
    )
    mass[0, 1] = mass[1, 0]
    turning = -coupling * np.sin(q[1]) * np.array([2 * w[0] * w[1] + w[1] ** 2, -(w[0] ** 2)])
    elbow = np.array([-np.sin(q[0]), np.cos(q[0])]) * l1
    hand = np.array([-np.sin(q.sum()), np.cos(q.sum())]) * l2
    outside = np.array([(elbow + hand) @ u[6:8], hand @ u[6:8]])
    return np.linalg.solve(mass, tau + outside - turning - 0.3 * w + u[8:10])


def inputs() -> np.ndarray:
    """Smoothly changing activations and a push, shape (n, 10)."""
    t = TIME[:, None]
    phase = np.arange(6) * 0.9
    alpha = 0.25 + 0.2 * np.sin(2 * np.pi * (0.3 + 0.05 * np.arange(6)) * t + phase)
    push = np.column_stack([2.0 * np.sin(1.3 * TIME), 1.5 * np.cos(0.9 * TIME)])
    return np.column_stack([alpha, push, np.zeros((len(TIME), 2))])


def reference(name: str) -> np.ndarray:
    u = inputs()

    def rhs(t: float, x: np.ndarray) -> np.ndarray:
        now = np.array([np.interp(t, TIME, column) for column in u.T])
        return np.concatenate([x[2:], accelerations(name, x[:2], x[2:], now)])

    solution = solve_ivp(
        rhs, (0.0, TIME[-1]), list(START.values()), method="LSODA", rtol=1e-9, atol=1e-11, t_eval=TIME, max_step=0.02
    )
    return solution.y[:2].T


@pytest.fixture(scope="module")
def arm_reference() -> np.ndarray:
    return reference("arm")


@pytest.mark.parametrize("stepped", [True, False], ids=["co-simulation", "model exchange"])
def test_arm_fmu_agrees_with_an_independent_integration_to_a_microradian(
    stepped: bool, tmp_path: Path, arm_reference: np.ndarray
) -> None:
    fmu = fmu_model(build_fmu(find_modelica_model("arm").compile(), tmp_path / "arm.fmu"), stepped=stepped)

    outputs = fmu.simulate(TIME, inputs(), ["q1", "q2"], START)

    fmu.file.close()
    assert np.ptp(arm_reference, axis=0).min() > 0.3  # the arm really moves
    assert np.abs(outputs - arm_reference).max() < 1e-6


def test_symbolic_arm_agrees_with_the_same_integration(arm_reference: np.ndarray) -> None:
    model = CompiledModel(find_modelica_model("arm").compile(), ["q1", "q2"])

    run = model.run(TIME, inputs(), model.parameters, np.array(list(START.values())), substeps=8)

    assert np.abs(run.outputs - arm_reference).max() < 1e-6


@pytest.mark.parametrize("name", ["arm", "arm-paper"])
def test_right_hand_side_equals_the_hand_written_equations_at_random_points(name: str) -> None:
    system = find_modelica_model(name).compile()
    random = np.random.default_rng(1)
    p = [parameter.start for parameter in system.parameters]
    for _ in range(50):
        x = random.uniform([0, 0.3, -6, -6], [1.6, 2.3, 6, 6])
        u = np.concatenate([random.uniform(0, 1, 6), random.uniform(-10, 10, 4)])

        dx, _ = system.rhs(0, x, u, [], p)

        expected = np.concatenate([x[2:], accelerations(name, x[:2], x[2:], u)])
        np.testing.assert_allclose(dx.full().ravel(), expected, rtol=1e-11, atol=1e-9)


def test_paper_set_gives_the_endpoint_forces_that_the_paper_prints() -> None:
    """The paper's largest endpoint forces at full activation, over its range of motion and with its link lengths."""
    system = find_modelica_model("arm-paper").compile()
    p = [parameter.start for parameter in system.parameters]
    rows = [i for i, v in enumerate(system.algebraics) if v.name.startswith("muscle[") and v.name.endswith("].F")]
    largest = np.zeros(6)
    for q1 in np.linspace(0, 1.5, 16):
        for q2 in np.linspace(0.5, 2.2, 18):
            states = [q1, q2, 0, 0]
            on, off = (system.rhs(0, states, [a] * 6 + [0] * 4, [], p)[1].full().ravel()[rows] for a in (1.0, 0.0))
            s1, c1, s12, c12 = np.sin(q1), np.cos(q1), np.sin(q1 + q2), np.cos(q1 + q2)
            jacobian = np.array([[-0.30 * s1 - 0.33 * s12, -0.33 * s12], [0.30 * c1 + 0.33 * c12, 0.33 * c12]])
            force = np.linalg.solve(jacobian.T, ARMS["arm-paper"] * (on - off))
            largest = np.maximum(largest, np.linalg.norm(force, axis=0))
    np.testing.assert_allclose(largest, [278, 259, 3.1, 112, 8.2, 153], rtol=0.03)
