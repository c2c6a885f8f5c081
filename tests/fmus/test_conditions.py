"""What derivatives do not see: variables that decide between values, guesses of zero, terms far smaller than others."""

from pathlib import Path

import casadi as ca
import fmpy  # type: ignore[import-untyped]
import numpy as np
import pytest
from scipy.optimize import brentq

from fmus.catalogue import ModelicaModel
from fmus.package import build_fmu
from fmus.symbolic.newton import linear_stage
from fmus.symbolic.solution import Unknown
from fmus.symbolic.system import SymbolicSystem


def built(text: str, folder: Path) -> SymbolicSystem:
    (folder / "M.mo").write_text(text)
    return ModelicaModel("M", "M", folder / "M.mo").compile()


def run(system: SymbolicSystem, folder: Path, stop: float, interval: float) -> np.ndarray:
    fmu = build_fmu(system, folder / "M.fmu", stop_time=stop, step_size=interval)
    return fmpy.simulate_fmu(str(fmu), stop_time=stop, output_interval=interval, fmi_type="CoSimulation")


@pytest.mark.parametrize("i", [0.2, 0.8])
def test_a_variable_that_its_own_equation_compares_is_solved_for(i: float, tmp_path: Path) -> None:
    text = "Real i(start=1, fixed=true); Real v; equation der(i) = -i; v = smooth(0, if v < 1 then 2*i else 1 + 5*(i - 0.5));"
    system = built(f"model M {text} end M;", tmp_path)

    v = float(system.rhs(0, [i], [], [], [])[1])
    assert v == pytest.approx(2 * i if i < 0.5 else 1 + 5 * (i - 0.5), rel=1e-12)


def test_a_pulse_by_floor_comes_again_and_again(tmp_path: Path) -> None:
    """The derivative of time - floor(time) is 1, so its zero was taken for the only one."""
    text = (
        "output Real x(start=0, fixed=true); output Real late; equation der(x) = if time - floor(time) < 0.5 then 1 else 0; "
        "late = if time + noEvent(if time < 1 then 0 else 5) > 3 then 1 else 0;"
    )
    result = run(built(f"model M {text} end M;", tmp_path), tmp_path, 3.0, 0.1)

    whole, part = np.divmod(result["time"], 1.0)
    at_floor = np.isclose(part, 1.0) | np.isclose(part, 0.0) | np.isclose(part, 0.5)
    assert result["x"] == pytest.approx(0.5 * whole + np.minimum(part, 0.5), abs=1e-9)
    assert result["late"][~at_floor] == pytest.approx(np.where(result["time"] > 1, 1, 0)[~at_floor])


def test_a_guess_of_zero_that_another_equation_replaces_does_not_count(tmp_path: Path) -> None:
    """A diode that heats itself: vt = T/11600 is no number at the guess of 0, and begins at the start of T."""
    text = (
        "Real v(start=0.5, fixed=true); Real T(start=290), vt, i, P, dT; equation der(v) = -v; "
        "vt = T/11600; i = 1e-9*(exp(v/vt) - 1); P = v*i; P = 0.02*dT; dT = T - 300;"
    )
    system = built(f"model M {text} end M;", tmp_path)

    def rest(T: float, v: float) -> float:
        return 0.02 * (T - 300) - v * 1e-9 * (np.exp(v * 11600 / T) - 1)

    for v in (0.5, 0.35, 1e-3):
        z = dict(
            zip([a.name for a in system.algebraics], np.array(system.rhs(0, [v], [], [], [])[1]).ravel(), strict=True)
        )
        assert z["T"] == pytest.approx(brentq(rest, 290, 400, (v,), xtol=1e-12, rtol=1e-14), rel=1e-12)
        assert z["P"] == pytest.approx(0.02 * z["dT"], rel=1e-12)  # also where both are far below 1e-12
    assert system.notes == ()


def test_equations_of_small_terms_beside_large_ones_hold() -> None:
    """QR errs by the size of the largest terms; a row whose terms are all small then seems not to hold."""
    random = np.random.default_rng(3)
    matrix = random.standard_normal((6, 6))
    matrix[5] = [0, 0, 0, 0, 1, -2]
    wanted = np.array([1e3, -2e3, 5e2, 1.0, 2e-9, 1e-9 * (1 + 1e-3)])
    unknowns = [Unknown(ca.SX.sym(f"x{k}"), ca.SX(0)) for k in range(6)]
    a, b = ca.SX.sym("a", 6, 6), ca.SX.sym("b", 6)
    stage = linear_stage("s", a, b, unknowns)
    values = ca.Function("values", [a, b], [stage.values])(matrix, matrix @ wanted)

    found = np.array(stage.solver(np.zeros(6), values)).ravel()
    exact = np.linalg.solve(matrix.astype(np.longdouble).astype(float), matrix @ wanted)
    assert found == pytest.approx(exact, rel=1e-6)


def test_an_element_of_a_matrix_is_picked_by_variables(tmp_path: Path) -> None:
    text = (
        "function f input Real M[2, 3]; input Real u; output Real y; protected Integer i; Integer j; algorithm "
        "i := if u > 0 then 2 else 1; j := if u > 1 then 3 elseif u > -1 then 2 else 1; y := M[i, j]; end f; "
        "parameter Real M[2, 3] = [1, 2, 3; 4, 5, 6]; Real x(start=0, fixed=true); Real y; equation der(x) = 1; y = f(M, x);"
    )
    system = built(f"model M {text} end M;", tmp_path)
    p = [v.start for v in system.parameters]

    found = [float(system.rhs(0, [x], [], [], p)[1]) for x in (-2.0, -0.5, 0.5, 2.0)]
    assert found == [1.0, 2.0, 5.0, 6.0]
    assert system.notes == ()


def test_relations_that_would_turn_for_ever_together_find_their_sides_one_by_one(tmp_path: Path) -> None:
    """After the jump z > 1 has to become false; together with z < -1 it would change to and fro."""
    text = (
        "Real x(start=0, fixed=true); output Real z; Real u = if time < 1 then 7 else 0.5; "
        "equation der(x) = z; z = u + (if z > 1 then -5 elseif z < -1 then 5 else 0);"
    )
    result = run(built(f"model M {text} end M;", tmp_path), tmp_path, 2.0, 0.25)

    assert result["z"][[1, -1]] == pytest.approx([2.0, 0.5])
