"""The check of every translation against the flat equations: what it covers, and that it catches faults."""

from dataclasses import replace
from pathlib import Path

import casadi as ca
import pytest

from fmus.catalogue import ModelicaModel, built_in_models
from fmus.errors import ModelicaError
from fmus.flat.evaluate import Evaluator
from fmus.flat.expressions import Parser
from fmus.frontend.compile import compile_class
from fmus.frontend.lint.tokens import tokens_of
from fmus.symbolic import operators
from fmus.symbolic.build import build_system
from fmus.symbolic.verify import verify, verify_relations

MODEL = """package P
  function climb
    input Real v[:]; input Real gain = 2; output Real y;
  protected
    Real s;
  algorithm
    s := 0; y := 0;
    for i in 1:size(v, 1) loop
      if v[i] > 0 then s := s + v[i]; elseif v[i] < -1 then s := s - 1; else s := 2*s; end if;
      y := y + gain*s;
    end for;
  end climb;
  model A
    parameter Real k = 2; parameter Real c = 3*k + sin(k); parameter Real M[2, 2] = {{1, 2}, {3, 4}};
    input Real u; Real x[2](each start=1, each fixed=true); Real y, z, w[3]; Real v[2](each start=0.5);
  equation
    for i in 1:2 loop der(x[i]) = -k*x[i]^2 + i*cos(u); end for;
    y = climb({x[1], u, -0.3}, 4) + abs(x[2]);
    z + z^3 = c*y + delay(u, 0.1);
    v = M*x - {z, 1};
    w = {sum(x), max(x), if u > 0 then time else 2};
  end A;
end P;
"""


def compiled(text: str, folder: Path, name: str = "P.A"):  # type: ignore[no-untyped-def]
    file = folder / "probe.mo"
    file.write_text(text)
    return compile_class(name, file)


def test_all_equations_of_a_model_are_checked(tmp_path: Path) -> None:
    assert build_system(compiled(MODEL, tmp_path), "P.A").notes == ()


@pytest.mark.parametrize("name", ["arm", "rat-muscle", "tanks"])
def test_all_equations_of_built_in_models_are_checked(name: str) -> None:
    model = built_in_models()[name]

    assert build_system(compile_class(model.class_name), model.class_name).notes == ()


FAULTS = {
    "sin": ("UNARY", lambda a: ca.sin(a) * (1 + 1e-7), "the binding of parameter c"),
    "cos": ("UNARY", ca.sin, "probe.mo:17: the equation 'for i in 1:2 loop der(x[i])"),
    "abs": ("UNARY", lambda a: a, "probe.mo:18: the equation 'y = climb"),
    "power": ("BINARY", lambda a, b: a**b + 1e-7, "probe.mo:17: the equation 'for i in 1:2 loop der(x[i])"),
}


@pytest.mark.parametrize("operator", FAULTS)
def test_a_wrong_operator_fails_the_build_with_the_equation(
    operator: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    table, wrong, equation = FAULTS[operator]
    dae = compiled(MODEL, tmp_path)
    monkeypatch.setitem(getattr(operators, table), operator, wrong)

    with pytest.raises(ModelicaError) as refusal:
        build_system(dae, "P.A")

    assert str(refusal.value).startswith(equation)


def test_a_corrupted_right_hand_side_is_found(tmp_path: Path) -> None:
    dae = compiled("model A Real x(start=1, fixed=true), y; equation der(x) = -y; y = 3*x; end A;", tmp_path, "A")
    system = build_system(dae, "A")
    t, x, u, d, p = (ca.SX.sym("s", n) for n in (1, 1, 0, 0, 0))
    wrong = ca.Function("rhs", [t, x, u, d, p], [-3 * x, 3 * x * (1 + 1e-8)])
    rates = ca.Function("rates", [t, x, u, d, p], [-3 * x])

    assert verify(system, rates, ["der(x)"], dae, 2) == ()
    with pytest.raises(ModelicaError, match=r"^probe\.mo:1: the equation '(y = 3\*x|der\(x\) = -y)' does not hold"):
        verify(replace(system, rhs=wrong), rates, ["der(x)"], dae, 2)


def test_relations_that_keep_a_wrong_side_are_found(tmp_path: Path) -> None:
    dae = compiled(
        "model A Real x(start=1, fixed=true); equation der(x) = if x > 0 then 1 else 2; end A;", tmp_path, "A"
    )
    system = build_system(dae, "A")
    assert system.relations is not None
    t, x, u, d, p, c = (ca.SX.sym("s", n) for n in (1, 1, 0, 0, 0, 1))
    wrong = ca.Function("rhs", [t, x, u, d, p, c], [ca.if_else(c, 2, 1), ca.SX(0, 1)])

    verify_relations(system)
    with pytest.raises(ModelicaError, match=r"'der\(x\)' is another"):
        verify_relations(replace(system, relations=replace(system.relations, rhs=wrong)))


def test_every_row_of_a_for_equation_is_checked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = (
        "model A Real x[4](each start=1, each fixed=true); Real y[3, 2]; equation for i in 1:4 loop "
        "der(x[i]) = noEvent(if i > 3 then cos(x[i]) else -x[i]*i); end for;"
        "for i in 1:3, j in 1:2 loop y[i, j] = x[i]*j; end for; end A;"
    )
    dae = compiled(text, tmp_path, "A")

    assert build_system(dae, "A").notes == ()
    monkeypatch.setitem(operators.UNARY, "cos", ca.sin)  # in the last row only
    with pytest.raises(ModelicaError, match="does not hold"):
        build_system(dae, "A")


def test_rounding_inside_a_function_is_no_fault(tmp_path: Path) -> None:
    text = "model A Real x(start=1, fixed=true), y, e; equation der(x) = -x; y = x + 0.1; e = abs(y - x - 0.1); end A;"

    assert build_system(compiled(text, tmp_path, "A"), "A").notes == ()


def test_what_could_not_be_checked_is_counted(tmp_path: Path) -> None:
    text = (
        "model A Real x(start=1, fixed=true), y; Boolean on(start=true, fixed=true); equation der(x) = -y;"
        " y = if edge(on) then x else 0; when x < 0.5 then on = false; end when; end A;"
    )

    notes = build_system(compiled(text, tmp_path, "A"), "A").notes

    assert [note.split(" independently")[0] for note in notes] == ["1 of 2 equations were not checked"]


def test_equations_are_checked_with_what_only_events_change(tmp_path: Path) -> None:
    text = (
        "model A Real x(start=1, fixed=true), y; Boolean on(start=true, fixed=true); equation der(x) = -y;"
        " y = if on then x else 0; when x < 0.5 then on = false; end when; end A;"
    )
    assert build_system(compiled(text, tmp_path, "A"), "A").notes == ()


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("2 - 3 - 4", -5.0),
        ("-2^2", -4.0),
        ("2*3/4*2", 3.0),
        ("if 1 > 2 then 3 elseif 2 >= 2 then 4 else 5", 4.0),
        ("not 1 < 2 or 3 <> 4 and true", 1.0),
        ("sum(i*j for i in 1:3, j in 1:2)", 18.0),
        ("{1, 2}*{3, 4} + [1, 2; 3, 4][2, 1]", 14.0),
        ("mod(-3, 2) + rem(-3, 2) + div(-3, 2)", 1 - 1 - 1.0),
        ("{1, 2, 3}[end]", 3.0),
    ],
)
def test_expressions_have_modelica_precedence(text: str, value: float) -> None:
    tree = Parser(tokens_of(text, "test")).expression()

    assert float(Evaluator({}.__getitem__, lambda name, _: pytest.fail(name)).value(tree)) == value


def test_a_function_that_names_a_built_in_one_and_extends_an_icon_is_checked_independently(tmp_path: Path) -> None:
    file = tmp_path / "P.mo"
    file.write_text(
        "package P\n  package Icons\n    partial function F\n    end F;\n  end Icons;\n"
        '  function sin "Sine"\n    extends Icons.F;\n    input Real u;\n    output Real y;\n  algorithm\n    y := .sin(u);\n'
        "    annotation (Inline=true);\n  end sin;\n"
        "  model M\n    Real x(start=1, fixed=true);\n  equation\n    der(x) = -sin(x);\n  end M;\nend P;\n"
    )
    assert ModelicaModel("M", "P.M", file).compile().notes == ()
