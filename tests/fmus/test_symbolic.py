"""From Modelica text to explicit functions: constructs with a known right-hand side, and refusals that say why."""

import math
from pathlib import Path

import numpy as np
import pytest

from fmus.catalogue import ModelicaModel
from fmus.errors import ModelicaError
from fmus.symbolic.system import SymbolicSystem


def compiled(text: str, folder: Path, name: str = "A") -> SymbolicSystem:
    file = folder / "probe.mo"
    file.write_text(text)
    return ModelicaModel(name, name, file).compile()


def derivatives(system: SymbolicSystem, **values: float) -> dict[str, float]:
    """Right-hand side at given states and inputs; parameters have their own values."""
    x = [values[v.name] for v in system.states]
    u = [values.get(v.name, 0.0) for v in system.inputs]
    dx, _ = system.rhs(values.get("time", 0.0), x, u, [0.0] * system.n_delays, [v.start for v in system.parameters])
    return dict(zip([v.name for v in system.states], dx.full().ravel(), strict=True))


HEAD = "input Real u; Real x(start=0, fixed=true);"
X, U = 0.7, -0.4
RIGHT = {
    "scalar functions": (
        f"model A {HEAD} equation der(x) = abs(u) + sqrt(x) + atan2(u, x) + exp(u)*sin(x)^2 + sign(u); end A;",
        abs(U) + math.sqrt(X) + math.atan2(U, X) + math.exp(U) * math.sin(X) ** 2 - 1,
    ),
    "other names of built-in functions": (
        'function angle input Real a; input Real b; output Real y; external "builtin" y = atan2(b, a); end angle;'
        f"model A {HEAD} equation der(x) = angle(x, u) + angle(2, 3*u); end A;",
        math.atan2(U, X) + math.atan2(3 * U, 2),
    ),
    "div, mod and rem": (
        f"model A {HEAD} equation der(x) = div(u, 0.3) + mod(u, 0.3) + rem(u, 0.3); end A;",
        math.trunc(U / 0.3) + (U - math.floor(U / 0.3) * 0.3) + math.fmod(U, 0.3),
    ),
    "matrices": (
        f"model A {HEAD} parameter Real M[2, 2] = [1, 2; 3, 4]; Real v[2];"
        "equation v = M*{x, u}; der(x) = v*transpose(M)*v + sum(M[1, :]) + M[2, 1]; end A;",
        (lambda a, b: a * (1 * a + 3 * b) + b * (2 * a + 4 * b) + 3 + 3)(X + 2 * U, 3 * X + 4 * U),
    ),
    "if expression": (
        f"model A {HEAD} equation der(x) = if u > 0 then 1 elseif x > 0.5 and u < 0 then 2*u else 3; end A;",
        2 * U,
    ),
    "for equation with neighbours": (
        f"model A {HEAD} Real T[4]; equation T[1] = x; for i in 2:4 loop T[i] = 2*T[i - 1] + i*u; end for; der(x) = T[4];"
        "end A;",
        8 * X + 4 * 2 * U + 2 * 3 * U + 4 * U,
    ),
    "sum over component array": (
        "package P model G parameter Real k = 1; input Real v; output Real y; equation y = k*v; end G; "
        "model A input Real u; Real x(start=0, fixed=true); parameter Real kk[3] = {1, 2, 4}; G g[3](k=kk);"
        "equation for i in 1:3 loop g[i].v = u; end for; der(x) = sum(g[i].y for i in 1:3) + x; end A; end P;",
        7 * U + X,
    ),
    "function with nested loops and branches": (
        "package P function f input Real v[:]; output Real y; protected Real s; algorithm s := 0; y := 0;"
        "for i in 1:size(v, 1) loop for j in 1:i loop if v[j] > 0 then s := s + v[j]; else s := s - i; end if;"
        "end for; y := y + s*i; end for; end f;"
        "model A input Real u; Real x(start=0, fixed=true); equation der(x) = f({x, u, 1.0}); end A; end P;",
        # s after i = 1, 2, 3 with v = (0.7, -0.4, 1): 0.7; 0.7 + 0.7 - 2; -0.6 + 0.7 - 3 + 1
        0.7 + 2 * (-0.6) + 3 * (-1.9),
    ),
    "linear loop of two equations": (
        f"model A {HEAD} Real a, b; equation 2*a + b = u; a - 3*b = x; der(x) = a*b; end A;",
        ((3 * U + X) / 7) * ((U - 2 * X) / 7),
    ),
    "mass matrix with a state": (
        "model A input Real u; Real x(start=0, fixed=true); Real w(start=0, fixed=true);"
        "equation (2 + x^2)*der(x) + der(w) = u; der(x) - 3*der(w) = 1; end A;",
        (U + 1 / 3) / (2 + X**2 + 1 / 3),
    ),
    "record parameter": (
        "package P record R Real a = 1; Real b[2] = {2, 3}; end R;"
        "model A parameter R r = R(a=7, b={8, 9}); input Real u; Real x(start=0, fixed=true);"
        "equation der(x) = r.a*u + r.b*{x, 1}; end A; end P;",
        7 * U + 8 * X + 9,
    ),
    "dependent parameter": (
        f"model A {HEAD} parameter Real k = 3; parameter Real c = 2*k + 1; equation der(x) = c*u; end A;",
        7 * U,
    ),
    "boolean parameter chooses an equation": (
        f"model A {HEAD} parameter Boolean fast = true; Real a; "
        "equation if fast then a = 5*u; else a = u; end if; der(x) = a; end A;",
        5 * U,
    ),
    "redeclared class with a modified component, two levels down": (
        "package P partial model L input Real v; output Real y; end L; model Z extends L; equation y = 0; end Z;"
        "model K extends L; parameter Real k = 1; equation y = k*v; end K;"
        "partial model Base replaceable model Law = Z constrainedby L; Law law; input Real u;"
        "Real x(start=0, fixed=true); equation law.v = u; der(x) = law.y; end Base;"
        "model Mid extends Base; end Mid; model A extends Mid(redeclare model Law = K, law(k=6)); end A; end P;",
        6 * U,
    ),
}


@pytest.mark.parametrize("construct", RIGHT)
def test_construct_gives_the_right_derivative(construct: str, tmp_path: Path) -> None:
    text, expected = RIGHT[construct]

    system = compiled(text, tmp_path, "P.A" if "package P" in text else "A")

    assert derivatives(system, x=X, u=U, w=0.0)["x"] == pytest.approx(expected, rel=1e-12)


def test_dependent_parameter_follows_when_the_independent_one_changes(tmp_path: Path) -> None:
    text, _ = RIGHT["dependent parameter"]
    system = compiled(text, tmp_path)

    assert [v.name for v in system.parameters] == ["k"]
    assert float(system.dependent([10.0])) == 21.0
    assert float(system.rhs(0, [0], [1], [], [10.0])[0]) == 21.0


def test_units_bounds_and_start_values_arrive(tmp_path: Path) -> None:
    system = compiled(
        'model A parameter Real m(unit="kg", min=0.1, max=5) = 2 "Mass"; input Real f(unit="N", start=3);'
        'constant Real c(unit="m/(s.kg)") = 1;'
        'Real v[2](each unit="m/s", start={c*m, 2*c*m}, each fixed=true); equation der(v) = {f/m, -f/m}; end A;',
        tmp_path,
    )

    mass = system.parameters[0]
    assert (mass.unit, mass.minimum, mass.maximum, mass.start) == ("kg", 0.1, 5.0, 2.0)
    assert mass.description == "Mass"
    assert system.inputs[0].start == 3.0
    assert [(v.name, v.unit, v.start) for v in system.states] == [("v[1]", "m/s", 2.0), ("v[2]", "m/s", 4.0)]
    np.testing.assert_allclose(system.initial([5.0]).full().ravel(), [5.0, 10.0])


def test_delay_of_an_input_becomes_a_history_with_its_time(tmp_path: Path) -> None:
    system = compiled(f"model A {HEAD} parameter Real T = 0.3; equation der(x) = delay(2*u, T, 1.0); end A;", tmp_path)

    source, delay = system.history(0.0, [U], [0.3])
    assert (float(source), float(delay)) == pytest.approx((2 * U, 0.3))
    assert float(system.rhs(0, [X], [U], [5.0], [0.3])[0]) == 5.0


REFUSED = {
    "more equations than unknowns": (
        "model A Real x(start=1), y(start=1); equation der(x) = -x; y = 2*x; der(y) = -y; end A;",
        "unbalanced",
    ),
    "delay of a state": (
        "model A Real x(start=1, fixed=true); equation der(x) = -delay(x, 0.1, 1.0); end A;",
        "delay an input",
    ),
    "parameter without value": (
        "model A parameter Real k; Real x(start=1, fixed=true); equation der(x) = -k*x; end A;",
        "parameter k has no value",
    ),
    "external function": (
        'package P function f input Real v; output Real y; external "C" y = f(v); end f;'
        "model A Real x(start=1, fixed=true); equation der(x) = f(x); end A; end P;",
        "external function",
    ),
    "syntax error": ("model A Real x equation der(x) = -x; end A;", "';' is missing"),
    "unknown class": ("model B Real x; equation der(x) = -x; end B;", "A"),
    "too few equations": ("model A Real x(start=1, fixed=true), y; equation der(x) = -y; end A;", "unbalanced"),
}


@pytest.mark.parametrize("construct", REFUSED)
def test_construct_outside_the_subset_is_refused_by_name(construct: str, tmp_path: Path) -> None:
    text, words = REFUSED[construct]

    with pytest.raises(ModelicaError) as refusal:
        compiled(text, tmp_path, "P.A" if "package P" in text else "A")

    assert words in str(refusal.value)
    assert len(str(refusal.value).splitlines()) == 1


def test_other_files_in_the_same_folder_do_not_matter(tmp_path: Path) -> None:
    (tmp_path / "other.mo").write_text("model A Real contradiction; end A;")

    system = compiled("model A Real x(start=1, fixed=true); equation der(x) = -x; end A;", tmp_path)

    assert [v.name for v in system.states] == ["x"]


def test_compiler_reasons_name_the_file_and_what_is_missing(tmp_path: Path) -> None:
    with pytest.raises(ModelicaError, match=r"^probe\.mo:1: .*'FESArm\.Arms\.Leg'") as refusal:
        compiled("model A extends FESArm.Arms.Leg; end A;", tmp_path)

    assert str(tmp_path) not in str(refusal.value)
