"""The integrator by itself: order, accuracy against its tolerance, and the choice between its two methods."""

import ctypes
import math

import numpy as np
import pytest
from helpers_integrator import AUTOMATIC, EXPLICIT, IMPLICIT, Solver, compiled_integrator


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    return compiled_integrator(tmp_path_factory.mktemp("integrator"))


def closed_form(library: ctypes.CDLL, choice: int) -> Solver:
    """`x' = -2 t x^2`, so x = 1/(1 + t^2), and `y' = cos(t) y`, so y = exp(sin(t))."""
    return Solver(
        library,
        lambda t, x: [-2 * t * x[0] ** 2, math.cos(t) * x[1]],
        lambda t, x: np.array([[-4 * t * x[0], 0], [0, math.cos(t)]]),
        [1.0, 1.0],
        by_time=lambda t, x: [-2 * x[0] ** 2, -math.sin(t) * x[1]],
        choice=choice,
    )


@pytest.mark.parametrize("choice", [EXPLICIT, IMPLICIT])
def test_the_error_of_fixed_steps_shrinks_with_their_fifth_power(library: ctypes.CDLL, choice: int) -> None:
    exact = np.array([1 / (1 + 2.0**2), math.exp(math.sin(2.0))])
    errors = [np.abs(np.array(closed_form(library, choice).fixed(2.0, n)) - exact).max() for n in (40, 80, 160)]
    for coarse, fine in zip(errors, errors[1:], strict=False):
        assert 4.9 < math.log2(coarse / fine) < 5.5


def van_der_pol(library: ctypes.CDLL, tolerance: float) -> Solver:
    """`eps z'' = (1 - z^2) z' - z` with eps = 1e-6, the problem VDPOL of the test set for IVP solvers."""
    mu = 1e6
    return Solver(
        library,
        lambda t, z: [z[1], mu * ((1 - z[0] ** 2) * z[1] - z[0])],
        lambda t, z: np.array([[0, 1], [mu * (-2 * z[0] * z[1] - 1), mu * (1 - z[0] ** 2)]]),
        [2.0, 0.0],
        tolerance=tolerance,
    )


@pytest.mark.parametrize("tolerance", [10.0**-k for k in range(4, 11)])
def test_the_error_follows_the_tolerance_on_a_very_stiff_oscillator(library: ctypes.CDLL, tolerance: float) -> None:
    # Test set for IVP solvers (Mazzia, Magherini, University of Bari), problem VDPOL, solution at t = 2.
    reference = [0.1706167732170483e1, -0.8928097010247975]
    error = np.abs(np.array(van_der_pol(library, tolerance).advance(0.0, 2.0)) - reference).max()
    assert error < 5 * tolerance


@pytest.mark.parametrize("tolerance", [1e-6, 1e-8, 1e-10])
def test_robertsons_reaction_arrives_at_its_published_end(library: ctypes.CDLL, tolerance: float) -> None:
    # The same test set, problem ROBER, solution at t = 1e11.
    reference = [0.2083340149701255e-07, 0.8333360770334713e-13, 0.9999999791665050]
    solver = Solver(
        library,
        lambda t, y: [
            -0.04 * y[0] + 1e4 * y[1] * y[2],
            0.04 * y[0] - 1e4 * y[1] * y[2] - 3e7 * y[1] ** 2,
            3e7 * y[1] ** 2,
        ],
        lambda t, y: np.array(
            [[-0.04, 1e4 * y[2], 1e4 * y[1]], [0.04, -1e4 * y[2] - 6e7 * y[1], -1e4 * y[1]], [0, 6e7 * y[1], 0]]
        ),
        [1.0, 0.0, 0.0],
        tolerance=tolerance,
        nominal=1e-4,
    )
    # The substance that is left, 2e-8, is far below its nominal value of 1e-4, which errors are measured by.
    assert solver.advance(0.0, 1e11) == pytest.approx(reference, rel=500 * tolerance)
    assert solver.evaluations < 20_000


def relaxation(library: ctypes.CDLL, rate: float, choice: int, tolerance: float = 1e-8) -> Solver:
    """`y' = -rate (y - cos t) - sin t` from 0; soon y = cos t (Prothero and Robinson)."""
    return Solver(
        library,
        lambda t, y: [-rate * (y[0] - math.cos(t)) - math.sin(t)],
        lambda t, y: np.array([[-rate]]),
        [0.0],
        by_time=lambda t, y: [-rate * math.sin(t) - math.cos(t)],
        choice=choice,
        tolerance=tolerance,
    )


@pytest.mark.parametrize("rate", [1e3, 1e6])
@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-10])
def test_a_stiff_linear_problem_meets_its_closed_form(library: ctypes.CDLL, rate: float, tolerance: float) -> None:
    solver = relaxation(library, rate, AUTOMATIC, tolerance)
    assert solver.advance(0.0, 3.0)[0] == pytest.approx(math.cos(3.0), abs=5 * tolerance)
    assert solver.memory.implicit


def friction(library: ctypes.CDLL, choice: int, sharpness: float) -> Solver:
    """A shaft of 0.05 kg.m2 under 0.5 sin(t) N.m, held by 1 N.m of smooth Coulomb friction."""

    def torque(w: float) -> float:
        return math.tanh(w / sharpness)

    return Solver(
        library,
        lambda t, x: [x[1], (0.5 * math.sin(t) - torque(x[1])) / 0.05],
        lambda t, x: np.array([[0, 1], [0, -(1 - torque(x[1]) ** 2) / sharpness / 0.05]]),
        [0.0, 0.0],
        by_time=lambda t, x: [0.0, 0.5 * math.cos(t) / 0.05],
        choice=choice,
        tolerance=1e-6,
        nominal=0.1,
    )


def test_held_friction_costs_a_hundred_times_less_than_with_the_explicit_method(library: ctypes.CDLL) -> None:
    sharpness = 1e-3
    automatic, explicit = (friction(library, choice, sharpness) for choice in (AUTOMATIC, EXPLICIT))
    one, other = automatic.advance(0.0, 3.0), explicit.advance(0.0, 3.0)
    assert one == pytest.approx(other, abs=1e-6)
    # The friction balances the drive, w = sharpness artanh(0.5 sin t), but for the shaft's inertia.
    assert one[1] == pytest.approx(sharpness * math.atanh(0.5 * math.sin(3.0)), abs=1e-6)
    assert 100 * automatic.evaluations < explicit.evaluations


def test_what_is_not_stiff_stays_with_the_explicit_method(library: ctypes.CDLL) -> None:
    for tolerance in (1e-3, 1e-6, 1e-10):
        solver = Solver(
            library,
            lambda t, x: [x[1], -900 * x[0]],
            lambda t, x: np.array([[0.0, 1.0], [-900.0, 0.0]]),
            [1.0, 0.0],
            tolerance=tolerance,
        )
        assert solver.advance(0.0, 3.0)[0] == pytest.approx(math.cos(90.0), abs=1e4 * tolerance)
        assert solver.jacobians == 0


def test_the_explicit_method_returns_when_the_stiff_phase_is_over(library: ctypes.CDLL) -> None:
    """A spring that a strong damper holds until t = 1, then swings freely."""
    damping = [1e5]
    solver = Solver(
        library,
        lambda t, x: [x[1], -100 * x[0] - damping[0] * x[1]],
        lambda t, x: np.array([[0.0, 1.0], [-100.0, -damping[0]]]),
        [1.0, 0.0],
        tolerance=1e-8,
    )
    solver.advance(0.0, 1.0)
    assert solver.memory.implicit
    x, w = solver.x
    damping[0] = 0.0
    solver.advance(1.0, 5.0)
    assert not solver.memory.implicit
    assert solver.x[0] == pytest.approx(x * math.cos(40.0) + w / 10 * math.sin(40.0), abs=1e-6)


def test_a_run_in_short_pieces_costs_what_the_pieces_need(library: ctypes.CDLL) -> None:
    solver = closed_form(library, AUTOMATIC)
    solver.advance(0.0, 0.1)
    before = solver.evaluations
    for k in range(100, 200):
        solver.advance(k * 1e-3, (k + 1) * 1e-3)
    # Six stages, and the slope at the start, which the core keeps from step to step.
    assert solver.evaluations - before == 700


@pytest.mark.parametrize("choice", [EXPLICIT, IMPLICIT])
@pytest.mark.parametrize("tolerance", [1e-6, 1e-10])
def test_events_are_found_as_exactly_as_the_solution_is_known(
    library: ctypes.CDLL, choice: int, tolerance: float
) -> None:
    """x = sin(t) passes 0.5 at pi/6, with a step as long as the interval to begin with."""
    solver = Solver(
        library,
        lambda t, x: [x[1], -x[0]],
        lambda t, x: np.array([[0.0, 1.0], [-1.0, 0.0]]),
        [0.0, 1.0],
        tolerance=tolerance,
        choice=choice,
        margin=lambda t, x: 0.5 - x[0],
    )
    assert solver.event(0.0, 3.0) == pytest.approx(math.pi / 6, abs=tolerance)
    assert list(solver.x) == pytest.approx([0.5, math.sqrt(0.75)], abs=tolerance)


def test_a_visit_shorter_than_a_step_is_seen(library: ctypes.CDLL) -> None:
    """A throw of 10 m/s against 10 m/s2, for which any step is exact, is above 4.9 m from 0.859 s to 1.141 s."""
    solver = Solver(
        library,
        lambda t, x: [x[1], -10.0],
        lambda t, x: np.array([[0.0, 1.0], [0.0, 0.0]]),
        [0.0, 10.0],
        margin=lambda t, x: 4.9 - x[0],
    )
    assert solver.event(0.0, 2.0) == pytest.approx(1 - math.sqrt(0.02), abs=1e-9)
