"""Units on both sides of equations, in sums and in values have to agree; what has no unit fits everything."""

from pathlib import Path

import pytest

from fmus.catalogue import ModelicaModel
from fmus.errors import ModelicaError

HEAD = """model A
  Real x(unit="m", start=1, fixed=true);
  Real v(unit="m/s", start=0, fixed=true);
  parameter Real m(unit="kg") = 2;
  parameter Real d(unit="N.s/m") = 0.3;
  parameter Real T(unit="s") = 0.5;
  parameter Real phi(unit="rad") = 0.4;
  parameter Real n = 3;
  Real f(unit="N");
"""
LINE = HEAD.count("\n") + 2


def built(equation: str, folder: Path, more: str = "  der(x) = v;\n  m*der(v) = f;\n") -> None:
    file = folder / "probe.mo"
    file.write_text(f"{HEAD}equation\n  {equation}\n{more}end A;\n")
    ModelicaModel("A", "A", file).compile()


WRONG = {
    "sides": ("f = x;", "f has kg.m.s-2, x has m"),
    "terms of a sum": ("f = -d*v - m*x;", "the terms of a sum have different units: kg.m.s-2 and kg.m"),
    "terms inside a product": ("f = m*(v + x)/T;", "the terms of a sum have different units: m.s-1 and m"),
    "argument of a function": ("f = m*v/T*exp(-x);", "the argument of exp has unit m; it must have none, or rad"),
    "result of a function": ("f = sin(phi);", "f has kg.m.s-2, the right side has 1"),
    "compared values": ("f = if x > v then d*v else 0;", "the compared values have different units: m and m.s-1"),
    "branches": ("f = if x > 1 then d*v else d*x;", "the branches of an if have different units"),
    "powers and roots": ("f = d*sqrt(x^2);", "f has kg.m.s-2, the right side has kg.m.s-1"),
    "largest of two": ("f = max(d*v, d*x);", "the arguments of max have different units"),
}
RIGHT = {
    "angle without its unit": "f = m*v/T*sin(phi)*phi;",
    "number beside a quantity": "f = d*v + 1.5;",
    "number that may have a unit": "f = 9.81*m;",
    "zero": "f = if x > 0 then 0 else -d*v;",
    "quantity without unit": "f = n*x;",
    "time as a ramp": "f = time;",
    "half a square": "f = 0.5*m*v^2/x + m*v^2/x/2;",
    "fractional power": "f = d*v*sqrt(x^2/(v*T)^2) + d*(x/T)*(v*T/x)^1.5;",
    "smooth step": "f = -d*v*tanh(x/(v*T)) + noEvent(if abs(v) > 0.1 then d*v else 0);",
    "elements of different quantities": "f = {d*v, m*v}*{1, 0};",
    "arguments of atan2": "f = d*v*atan2(x, v*T);",
}


@pytest.mark.parametrize("case", WRONG)
def test_units_that_differ_are_refused_with_file_and_line(case: str, tmp_path: Path) -> None:
    equation, words = WRONG[case]

    with pytest.raises(ModelicaError) as refusal:
        built(equation, tmp_path)

    assert str(refusal.value).startswith(f"probe.mo:{LINE}: ")
    assert words in str(refusal.value)


@pytest.mark.parametrize("case", RIGHT)
def test_units_that_may_agree_pass(case: str, tmp_path: Path) -> None:
    built(RIGHT[case], tmp_path)


@pytest.mark.parametrize("equation", ["f = 2*d*x;", "f = d*v*exp((x - 3)/8);", "f = -d*v + 3/x;"])
def test_units_that_a_number_might_mend_are_noted_and_not_refused(equation: str, tmp_path: Path) -> None:
    file = tmp_path / "probe.mo"
    file.write_text(f"{HEAD}equation\n  {equation}\n  der(x) = v;\n  m*der(v) = f;\nend A;\n")
    notes = ModelicaModel("A", "A", file).compile().notes
    assert any(note.startswith(f"probe.mo:{LINE}: ") and "unless a number there has a unit" in note for note in notes)


def test_derivative_has_the_unit_per_second(tmp_path: Path) -> None:
    with pytest.raises(ModelicaError, match=r"^probe\.mo:12: .*der\(x\) has m\.s-1, the right side has m\.s-2"):
        built("f = -d*v;", tmp_path, "  der(x) = v/T;\n  m*der(v) = f;\n")


def test_value_of_another_unit_is_refused_where_the_parameter_stands(tmp_path: Path) -> None:
    file = tmp_path / "probe.mo"
    file.write_text(
        'model A\n  parameter Real a(unit="m") = 1;\n  parameter Real b(unit="s") = 2*a;\n'
        "  Real x(start=0, fixed=true);\nequation\n  der(x) = b*x;\nend A;\n"
    )

    with pytest.raises(ModelicaError, match=r"^probe\.mo:3: b has unit s, but its value has unit m$"):
        ModelicaModel("A", "A", file).compile()


def test_large_number_in_the_value_of_a_parameter_may_have_a_unit(tmp_path: Path) -> None:
    file = tmp_path / "probe.mo"
    file.write_text(
        'model A\n  parameter Real V(unit="m3") = 1;\n  parameter Real C(unit="J/K") = V*1.9e6;\n'
        "  Real x(start=0, fixed=true);\nequation\n  der(x) = C*x;\nend A;\n"
    )

    notes = ModelicaModel("A", "A", file).compile().notes
    assert [note.split(" unit ")[0] for note in notes] == ["probe.mo:3: C has"]


def test_unknown_unit_is_refused_where_it_is_declared(tmp_path: Path) -> None:
    file = tmp_path / "probe.mo"
    file.write_text(
        'model A\n  parameter Real a(unit="furlong") = 1;\n  Real x(start=0, fixed=true);\n'
        "equation\n  der(x) = a*x;\nend A;\n"
    )

    with pytest.raises(ModelicaError, match=r"^probe\.mo:2: a has unit 'furlong'"):
        ModelicaModel("A", "A", file).compile()


def test_branches_of_an_if_equation_may_be_equations_of_different_units(tmp_path: Path) -> None:
    text = """model M
  parameter Real R(unit="Ohm") = 2;
  parameter Boolean short = false;
  input Real u(unit="V");
  Real i(unit="A"), v(unit="V");
  Real x(start=1, fixed=true);
equation
  if x > 0.5 then v = 0; else i = 0; end if;
  u = R*i + v;
  der(x) = -x;
end M;
"""
    (tmp_path / "M.mo").write_text(text)
    assert ModelicaModel("M", "M", tmp_path / "M.mo").compile().states[0].name == "x"


def test_the_sides_in_a_branch_of_an_if_equation_still_have_one_unit(tmp_path: Path) -> None:
    text = """model M
  Real i(unit="A"), v(unit="V") = 1;
  Real x(start=1, fixed=true);
equation
  if x > 0.5 then i = v; else i = 0; end if;
  der(x) = -x;
end M;
"""
    (tmp_path / "M.mo").write_text(text)
    with pytest.raises(ModelicaError, match=r"M\.mo:\d+: "):
        ModelicaModel("M", "M", tmp_path / "M.mo").compile()
