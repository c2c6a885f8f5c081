"""Start values from initial equations, fixed=false and steady states, against algebra."""

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


def starts(system: SymbolicSystem, p: list[float] | None = None, **known: ca.DM | float) -> dict[str, float]:
    parameters = ca.DM([v.start for v in system.parameters] if p is None else p)
    values = np.array(system.start_of_states(parameters, **known)).ravel()  # type: ignore[arg-type]
    return dict(zip([v.name for v in system.states], values, strict=True))


def test_an_initial_equation_follows_parameters_and_time(tmp_path: Path) -> None:
    system = compiled(
        "model A parameter Real k = 2; Real x; initial equation x = 3*k + time; equation der(x) = -x; end A;", tmp_path
    )

    assert starts(system) == {"x": 6.0}
    assert starts(system, [5.0], time=1.0) == {"x": 16.0}


STEADY = (
    "model A input Real u(start=3); parameter Real k = 2; Real x(start=1), y;"
    "initial equation der(x) = 0; equation der(x) = u - y; y = k*x^3; end A;"
)


def test_a_steady_state_solves_a_nonlinear_equation_of_inputs_and_parameters(tmp_path: Path) -> None:
    system = compiled(STEADY, tmp_path)

    assert starts(system)["x"] == pytest.approx((3 / 2) ** (1 / 3), rel=1e-12)
    assert starts(system, [4.0], inputs=ca.DM(0.5))["x"] == pytest.approx(0.5, rel=1e-12)
    assert from_bytes(to_bytes(system)).start_of_states(ca.DM([2.0])) == system.start_of_states(ca.DM([2.0]))


def test_a_parameter_that_is_not_fixed_is_found_with_all_that_depends_on_it(tmp_path: Path) -> None:
    system = compiled(
        "model A parameter Real k(fixed=false, start=1); parameter Real c = 2*k; Real x(start=2, fixed=true), y;"
        "initial equation y = 12; equation der(x) = -k*x; y = k*x + c*x; end A;",
        tmp_path,
    )

    assert starts(system) == pytest.approx({"x": 2.0, "k": 2.0})
    dx, z = system.rhs(0, [2.0, 2.0], [], [], [])
    assert dx.full().ravel().tolist() == [-4.0, 0.0]
    assert dict(zip([v.name for v in system.algebraics], z.full().ravel(), strict=True)) == {"c": 4.0, "y": 12.0}


def test_a_fixed_algebraic_variable_determines_its_state_on_the_side_of_the_guess(tmp_path: Path) -> None:
    text = "model A Real x(start=%d), y(start=9, fixed=true); equation der(x) = -x; y = x^2; end A;"

    assert starts(compiled(text % 1, tmp_path))["x"] == pytest.approx(3.0, rel=1e-12)
    assert starts(compiled(text % -1, tmp_path))["x"] == pytest.approx(-3.0, rel=1e-12)


def test_delayed_inputs_are_constant_before_the_start(tmp_path: Path) -> None:
    system = compiled(
        "model A input Real u(start=4); Real x; initial equation der(x) = 0; "
        "equation der(x) = delay(3*u, 0.1, 1.0) - 2*x; end A;",
        tmp_path,
    )

    assert starts(system) == pytest.approx({"x": 6.0})


def test_declared_starts_fill_what_initial_equations_leave_open_and_a_note_says_so(tmp_path: Path) -> None:
    system = compiled(
        "model A Real x, y(start=1); initial equation x + y = 5; equation der(x) = -x; der(y) = x; end A;", tmp_path
    )

    assert starts(system) == pytest.approx({"x": 4.0, "y": 1.0})
    assert system.notes == ("start values taken as fixed: y; write fixed=true to confirm",)


def test_fixed_starts_alone_need_no_solution_and_no_note(tmp_path: Path) -> None:
    system = compiled("model A Real x(start=2, fixed=true); equation der(x) = -x; end A;", tmp_path)

    assert system.consistent is None
    assert system.notes == ()


WRONG = {
    "contradiction": (
        "model A\n Real x(start=1, fixed=true);\ninitial equation\n x = 3;\nequation\n der(x) = -x;\nend A;",
        r"^probe\.mo:2: the fixed start value of x contradicts the others by 2",
    ),
    "one equation too many": (
        "model A\n Real x;\ninitial equation\n x = 3;\n der(x) = 0;\nequation\n der(x) = -x;\nend A;",
        r"^probe\.mo:5: this initial equation is one too many \(with probe\.mo:4\): x follows",
    ),
    "one equation too few": (
        "model A\n parameter Real k(fixed=false);\n Real x;\nequation\n der(x) = -k*x;\nend A;",
        r"1 start condition missing: nothing determines k at the start",
    ),
    "no solution": (
        "model A\n Real x(start=1);\ninitial equation\n x^2 = -1;\nequation\n der(x) = -x;\nend A;",
        r"no start values of x were found",
    ),
}


@pytest.mark.parametrize("mistake", WRONG)
def test_start_conditions_that_cannot_hold_are_refused_with_names(mistake: str, tmp_path: Path) -> None:
    text, message = WRONG[mistake]

    with pytest.raises(ModelicaError, match=message):
        compiled(text, tmp_path)


def test_a_start_that_need_not_hold_does_where_nothing_else_determines_it(tmp_path: Path) -> None:
    declared = "Real x(start=2, fixed=false), z(start=1, fixed=false);"
    system = compiled(
        f"model A {declared} equation der(x) = -x; der(z) = x - z; initial equation der(z) = 0; end A;", tmp_path
    )

    assert starts(system) == pytest.approx({"x": 2.0, "z": 2.0})
    assert system.notes == ("start values taken as fixed: x; write fixed=true to confirm",)
    declared = "parameter Real k(fixed=false, start=1); Real x(start=1, fixed=true);"
    with pytest.raises(ModelicaError, match="1 start condition missing"):
        compiled(f"model A {declared} equation der(x) = -k*x; end A;", tmp_path)
