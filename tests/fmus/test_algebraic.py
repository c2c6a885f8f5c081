"""Algebraic loops: nonlinear ones against roots known from algebra, linear ones whose pivots may vanish."""

from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from fmus.catalogue import ModelicaModel
from fmus.errors import ModelicaError
from fmus.symbolic.store import from_bytes, to_bytes
from fmus.symbolic.system import SymbolicSystem


def compiled(text: str, folder: Path) -> SymbolicSystem:
    file = folder / "probe.mo"
    file.write_text(text)
    return ModelicaModel("A", "A", file).compile()


def evaluated(system: SymbolicSystem, **values: float) -> dict[str, float]:
    """Derivatives and algebraic variables at given states, inputs and parameters."""
    x = [values[v.name] for v in system.states]
    u = [values.get(v.name, 0.0) for v in system.inputs]
    p = [values.get(v.name, v.start) for v in system.parameters]
    dx, z = system.rhs(values.get("time", 0.0), x, u, [], p)
    names = [*(f"der({v.name})" for v in system.states), *(v.name for v in system.algebraics)]
    return dict(zip(names, [*dx.full().ravel(), *z.full().ravel()], strict=True))


CUBIC = "model A parameter Real k = 1; Real x(start=1, fixed=true), y; equation der(x) = -y; y + k*y^3 = x; end A;"


@pytest.mark.parametrize("x", [-40.0, 0.0, 0.3, 1e4])
def test_a_cubic_equation_is_solved_to_rounding(x: float, tmp_path: Path) -> None:
    root = next(float(r.real) for r in np.roots([1, 0, 1, -x]) if abs(r.imag) < 1e-9)

    found = evaluated(compiled(CUBIC, tmp_path), x=x)

    assert found["y"] == pytest.approx(root, rel=1e-12)
    assert found["der(x)"] == -found["y"]


def test_derivatives_follow_from_the_implicit_function_theorem(tmp_path: Path) -> None:
    system = compiled(CUBIC, tmp_path)
    y = evaluated(system, x=2.0, k=3.0)["y"]

    tangent = system.rhs.forward(1)(0, 2.0, [], [], 3.0, 0, 0, 0, 1.0, [], [], 0.0)[0]
    shares = system.rhs.reverse(1)(0, 2.0, [], [], 3.0, 0, 0, 1.0, 0.0)

    assert float(tangent) == pytest.approx(-1 / (1 + 9 * y**2), rel=1e-12)
    assert float(shares[1]) == pytest.approx(-1 / (1 + 9 * y**2), rel=1e-12)
    assert float(shares[4]) == pytest.approx(y**3 / (1 + 9 * y**2), rel=1e-12)


@pytest.mark.parametrize("sign", [-1, 1])
def test_the_start_value_chooses_among_roots_and_may_follow_a_parameter(sign: int, tmp_path: Path) -> None:
    system = compiled(
        f"model A parameter Real s = {sign}; Real x(start=4, fixed=true), y(start=0.5*s);"
        "equation der(x) = -1; y^2 = x; end A;",
        tmp_path,
    )

    assert evaluated(system, x=4.0)["y"] == pytest.approx(2 * sign, rel=1e-12)
    assert evaluated(system, x=4.0, s=-sign)["y"] == pytest.approx(-2 * sign, rel=1e-12)


def test_several_loops_in_a_chain_with_a_derivative_inside_one(tmp_path: Path) -> None:
    system = compiled(
        "model A Real x(start=0, fixed=true), a, b(start=1), c(start=3); equation a + exp(a) = x; b*c = a + 3; b + c = 4.2; "
        "der(x)^3 + der(x) = b; end A;",
        tmp_path,
    )
    found = evaluated(system, x=1 + np.e)

    assert found["a"] == pytest.approx(1.0, rel=1e-12)
    assert sorted([found["b"], found["c"]]) == pytest.approx(sorted(np.roots([1, -4.2, 4.0])), rel=1e-12)
    assert found["der(x)"] ** 3 + found["der(x)"] == pytest.approx(found["b"], rel=1e-12)


def test_damped_steps_find_a_root_that_plain_newton_flees_from(tmp_path: Path) -> None:
    system = compiled(
        "model A Real x(start=0, fixed=true), y(start=30); equation der(x) = y; atan(y) = x; end A;", tmp_path
    )

    assert evaluated(system, x=0.5)["y"] == pytest.approx(np.tan(0.5), rel=1e-10)


@pytest.mark.parametrize("unit", [1e-9, 1e9])
def test_accuracy_does_not_depend_on_the_unit_of_the_unknown(unit: float, tmp_path: Path) -> None:
    system = compiled(
        f"model A Real x(start=0, fixed=true), y(nominal={unit}); "
        f"equation der(x) = -1; (y/{unit})^3 + y/{unit} = x; end A;",
        tmp_path,
    )

    assert evaluated(system, x=10.0)["y"] == pytest.approx(2 * unit, rel=1e-12)


def test_absolute_values_and_extremes_are_allowed_inside_a_loop(tmp_path: Path) -> None:
    system = compiled(
        "model A Real x(start=0, fixed=true), y; equation der(x) = -y; y + abs(y) + max(y, 1) + min(y, 0) = x; end A;",
        tmp_path,
    )

    assert evaluated(system, x=7.0)["y"] == pytest.approx(7 / 3, rel=1e-12)
    assert evaluated(system, x=-3.0)["y"] == pytest.approx(-4.0, rel=1e-12)


def test_an_equation_without_a_solution_gives_no_number(tmp_path: Path) -> None:
    system = compiled(
        "model A Real x(start=1, fixed=true), y(start=1); equation der(x) = -1; y^2 = x; end A;", tmp_path
    )

    assert np.isnan(evaluated(system, x=-1.0)["y"])
    assert system.solved == (("y",),)


LINEAR = (
    "model A parameter Real a = 0; input Real u; Real x(start=0, fixed=true), y, z;"
    "equation der(x) = y; a*y + z = u; y + a*z = x; end A;"
)


@pytest.mark.parametrize("a", [0.0, 0.5])
def test_a_pivot_that_is_zero_at_run_time_does_not_matter(a: float, tmp_path: Path) -> None:
    found = evaluated(compiled(LINEAR, tmp_path), x=2.0, u=3.0, a=a)

    assert [found["y"], found["z"]] == pytest.approx(np.linalg.solve([[a, 1], [1, a]], [3.0, 2.0]), rel=1e-12)


def test_a_large_block_of_parameters_is_factorised_at_run_time(tmp_path: Path) -> None:
    n = 5
    rows = " ".join(f"M[{i + 1},:]*y = {i + 1}*x;" for i in range(n))
    system = compiled(
        f"model A parameter Real M[{n},{n}] = identity({n}); Real x(start=1, fixed=true), y[{n}];"
        f"equation der(x) = y[1]; {rows} end A;",
        tmp_path,
    )
    matrix = np.roll(np.eye(n), 1, axis=0) + np.diag([0.0, 0.1, 0.2, 0.3, 0.4])

    _, z = system.rhs(0, [2.0], [], [], matrix.ravel())

    np.testing.assert_allclose(z.full().ravel(), np.linalg.solve(matrix, 2.0 * np.arange(1, n + 1)), rtol=1e-12)
    assert np.isnan(system.rhs(0, [2.0], [], [], np.zeros(n * n))[1].full()).all()


def test_a_loop_that_is_singular_with_the_declared_parameters_is_refused_at_build(tmp_path: Path) -> None:
    with pytest.raises(ModelicaError, match=r"^probe\.mo:1: the equations for \w, \w have no unique solution"):
        compiled(LINEAR.replace("a = 0", "a = 1"), tmp_path)


def test_a_system_with_solvers_survives_the_cache(tmp_path: Path) -> None:
    system = compiled(CUBIC, tmp_path)
    again = from_bytes(to_bytes(system))

    assert again.solved == system.solved
    assert float(again.rhs(0, 2.0, [], [], 1.0)[0]) == float(system.rhs(0, ca.DM(2.0), [], [], 1.0)[0]) == -1.0
