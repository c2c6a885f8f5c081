"""The plants beyond the arm: right-hand sides against Lagrange's equations taken numerically, and valid FMUs."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu

from fmus.catalogue import find_modelica_model
from fmus.package import build_fmu

Energy = Callable[[np.ndarray], float]
POLE_M, POLE_L, POLE_I = 0.147585, 0.147755, 1.0912e-4


@dataclass(frozen=True)
class Mechanism:
    """Positions, bodies and what acts on them: kinetic energy is the sum of those of point masses and spinning bodies.

    `points` maps positions to coordinates of the centres of mass, shape (bodies, 2); `turns` to their angles, (bodies,).
    `potential` depends on positions, `force` gives generalised forces from (positions, speeds, inputs).
    """

    size: int
    masses: np.ndarray
    inertias: np.ndarray
    points: Callable[[np.ndarray], np.ndarray]
    turns: Callable[[np.ndarray], np.ndarray]
    potential: Energy
    force: Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


def slope(function: Callable[[np.ndarray], np.ndarray], q: np.ndarray) -> np.ndarray:
    """Derivatives along a new last axis, by central differences of sixth order (error about 1e-11 here)."""
    step, weights = 0.02, (3 / 4, -3 / 20, 1 / 60)
    columns = []
    for unit in np.eye(len(q)):
        parts = [
            w * (np.asarray(function(q + k * step * unit)) - np.asarray(function(q - k * step * unit))) / step
            for k, w in enumerate(weights, start=1)
        ]
        columns.append(np.sum(parts, axis=0))
    return np.stack(columns, axis=-1)


def accelerations(plant: Mechanism, q: np.ndarray, w: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Lagrange's equations: M a + dM/dt w - dT/dq + dV/dq = forces, with the mass matrix from the bodies' motion."""

    def mass(at: np.ndarray) -> np.ndarray:
        moving, turning = slope(plant.points, at), slope(plant.turns, at)
        return np.einsum("b,bci,bcj->ij", plant.masses, moving, moving) + np.einsum(
            "b,bi,bj->ij", plant.inertias, turning, turning
        )

    changes = slope(mass, q)
    bias = np.einsum("ijk,j,k->i", changes, w, w) - 0.5 * np.einsum("jki,j,k->i", changes, w, w)
    weight = slope(lambda at: np.array([plant.potential(at)]), q)[0]
    return np.linalg.solve(mass(q), plant.force(q, w, u) - bias - weight)


def along(length: float, angle: float) -> np.ndarray:
    """Point at a distance from the origin, its angle counted from upright towards x."""
    return length * np.array([np.sin(angle), np.cos(angle)])


def flat(q: np.ndarray) -> np.ndarray:
    return np.zeros((len(q), 2))


def links(q: np.ndarray) -> np.ndarray:
    first = np.array([np.cos(q[0]), np.sin(q[0])])
    return np.array([0.125 * first, 0.25 * first + 0.125 * np.array([np.cos(q.sum()), np.sin(q.sum())])])


PLANTS = {
    "pendulum": Mechanism(
        1,
        np.array([POLE_M]),
        np.array([POLE_I]),
        lambda q: along(POLE_L, q[0])[None],
        lambda q: q,
        lambda q: POLE_M * 9.81001 * along(POLE_L, q[0])[1],
        lambda q, w, u: u,
    ),
    "drive": Mechanism(
        1, np.zeros(1), np.array([0.02]), flat, lambda q: q, lambda q: 0.0, lambda q, w, u: u[:1] + u[1:]
    ),
    "linear-drive": Mechanism(
        1,
        np.array([1.5]),
        np.zeros(1),
        lambda q: np.array([[q[0], 0.0]]),
        lambda q: np.zeros(1),
        lambda q: 0.0,
        lambda q, w, u: u[:1] + u[1:],
    ),
    "cart": Mechanism(
        2,
        np.array([0.5, POLE_M]),
        np.array([0.0, POLE_I]),
        lambda q: np.array([[q[0], 0.0], along(POLE_L, q[1]) + [q[0], 0.0]]),
        lambda q: np.array([0.0, q[1]]),
        lambda q: POLE_M * 9.81 * along(POLE_L, q[1])[1],
        lambda q, w, u: np.array([u[0] + u[1], u[2]]),
    ),
    "two-mass": Mechanism(
        2,
        np.zeros(2),
        np.array([0.002, 0.005]),
        flat,
        lambda q: q,
        lambda q: 10.0 * (q[0] - q[1]) ** 2,
        lambda q, w, u: np.array([u[0] + u[1], u[2]]) - 0.01 * (w[0] - w[1]) * np.array([1, -1]),
    ),
    "double-pendulum": Mechanism(
        2,
        np.array([0.20, 0.15]),
        np.array([1.1e-3, 0.8e-3]),
        links,
        lambda q: np.array([q[0], q.sum()]),
        lambda q: 9.81 * float(np.array([0.20, 0.15]) @ links(q)[:, 1]),
        lambda q, w, u: u,
    ),
}


@pytest.mark.parametrize("name", PLANTS)
def test_right_hand_side_equals_lagranges_equations_at_random_points(name: str) -> None:
    system, plant = find_modelica_model(name).compile(), PLANTS[name]
    random = np.random.default_rng(1)
    p = [parameter.start for parameter in system.parameters]
    for _ in range(30):
        q, w = random.uniform(-3, 3, plant.size), random.uniform(-5, 5, plant.size)
        u = random.uniform(-2, 2, len(system.inputs))

        dx, _ = system.rhs(0, np.concatenate([q, w]), u, [], p)

        expected = np.concatenate([w, accelerations(plant, q, w, u)])
        np.testing.assert_allclose(dx.full().ravel(), expected, rtol=1e-7, atol=1e-7)


def test_tanks_follow_torricelli_and_keep_still_when_empty() -> None:
    system = find_modelica_model("tanks").compile()
    p = [parameter.start for parameter in system.parameters]
    random = np.random.default_rng(1)
    for _ in range(30):
        h, inflow = random.uniform(0.05, 0.5, 2), random.uniform(0, 3e-4)
        flows = 5e-5 * np.sqrt(2 * 9.81 * h)

        dh = system.rhs(0, h, [inflow, 0, 0, 0], [], p)[0].full().ravel()

        # The outflow is off by (1e-4/h)^2/4 of itself, at most 1e-6.
        np.testing.assert_allclose(0.015 * dh, [inflow - flows[0], flows[0] - flows[1]], atol=2e-6 * flows.max())
    assert np.all(system.rhs(0, [0, 0], [0] * 4, [], p)[0].full() == 0)


@pytest.mark.parametrize("name", [*PLANTS, "tanks"])
def test_fmu_of_a_plant_is_valid_and_runs_in_fmpy(name: str, tmp_path: Path) -> None:
    model = find_modelica_model(name)
    fmu = build_fmu(model.compile(), tmp_path / f"{name}.fmu")

    problems = validate_fmu(str(fmu))
    run = fmpy.simulate_fmu(str(fmu), stop_time=1.0)

    assert problems == []
    assert all(np.isfinite(run[column]).all() for column in run.dtype.names)
