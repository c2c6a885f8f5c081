"""The independent check reads functions, constants and declarations as Modelica does, and finds what is wrong in them."""

from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from fmus.catalogue import ModelicaModel
from fmus.errors import ModelicaError
from fmus.flat.evaluate import Unknown
from fmus.flat.external import external
from fmus.flat.functions import Functions
from fmus.frontend.compile import compile_class
from fmus.symbolic import operators
from fmus.symbolic.build import build_system

PACKAGE = """package P
  package Constants
    constant Real two = 2;
    constant Real four = two*square(two)/2;
    function square input Real u; output Real y; algorithm y := u^2; end square;
  end Constants;
  type Way = enumeration(up "Up", down "Down");
  package A
    function f input Real u; output Real y; algorithm y := 3*u; end f;
  end A;
  package B
    import P.Constants.four;
    function f input Real u; input Way way = Way.down; output Real y;
    algorithm
      y := 0;
      if way == Way.down then
        y := u*four;
        return;
      end if;
      y := P.Constants.two;
    end f;
    function g input Real u; output Real y; algorithm y := f(u, way=Way.down) + A.f(u=u); end g;
  end B;
  model C Real y; Real z = 3; end C;
  model M
    Real x(start=1, fixed=true);
    C c(y = %s(x));
    Boolean above = x > 0;
    Switch switch;
    Real w = if switch.on then 1 else 2;
  equation
    der(x) = -B.g(x) - A.f(x) - w;
    above = switch.on;
  end M;
  model Switch Boolean on; end Switch;
end P;
"""


def file_of(tmp_path: Path, function: str = "sin") -> Path:
    file = tmp_path / "P.mo"
    file.write_text(PACKAGE % function)
    return file


def test_functions_constants_and_declarations_are_all_checked(tmp_path: Path) -> None:
    system = ModelicaModel("M", "P.M", file_of(tmp_path)).compile()

    rates = np.array(system.rhs(0, [1.0], [], [], [])[0]).ravel()
    assert system.notes == ()
    assert rates == pytest.approx([-(4 + 3) - 3 - 1])


def test_what_a_component_is_bound_to_is_checked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    dae = compile_class("P.M", file_of(tmp_path, "cos"))
    monkeypatch.setitem(operators.UNARY, "cos", ca.sin)

    with pytest.raises(ModelicaError, match="does not hold in the translation"):
        build_system(dae, "P.M")


def test_names_in_functions_have_their_scope() -> None:
    functions = Functions([PACKAGE % "sin"])

    assert functions.run("P.B.g", [1.0]) == [7.0]
    assert functions.run("P.B.f", [1.0, 1.0]) == [2.0]
    assert functions.constant("P.Way.down") == 2.0
    with pytest.raises(Unknown, match=r"the function f \(2 of that name\)"):
        functions.run("f", [1.0])


def test_a_replaceable_function_is_not_taken_for_the_one_that_replaces_it() -> None:
    text = "package Q replaceable function f input Real u; output Real y; algorithm y := u; end f; end Q;"

    with pytest.raises(Unknown, match="replaceable"):
        Functions([text]).run("Q.f", [1.0])


def table(kind: str, **more: float) -> dict[str, object]:
    """Row 0 to 1 rises from 0 to 2, there the table jumps to 5, and ends at 3 with 4."""
    rows = np.array([[0.0, 0.0], [1.0, 2.0], [1.0, 5.0], [3.0, 4.0]])
    inputs = {"table": rows, "columns": np.array([2.0]), "smoothness": 1, "extrapolation": 1, **more}
    return dict(external(f"ModelicaStandardTables_{kind}_init3", [], inputs))


@pytest.mark.parametrize(
    ("extrapolation", "smoothness", "u", "value"),
    [
        (1, 1, 0.5, 1),
        (1, 1, 1, 5),
        (1, 1, 9, 4),
        (2, 1, -1, -2),
        (2, 1, 5, 3),
        (3, 1, 3.5, 1),
        (1, 3, 2.9, 5),
        (1, 3, 3, 4),
    ],
)
def test_tables_are_looked_up_row_by_row(extrapolation: int, smoothness: int, u: float, value: float) -> None:
    given = table("CombiTable1D", extrapolation=extrapolation, smoothness=smoothness)

    assert external("ModelicaStandardTables_CombiTable1D_getValue", [given, 1, u], {}) == pytest.approx(value)


@pytest.mark.parametrize(("time", "event", "value"), [(1.0, 1.0, 2), (1.0, 3.0, 5), (-0.5, -0.5, 0), (0.25, 1.0, 0.5)])
def test_a_time_table_waits_for_its_event(time: float, event: float, value: float) -> None:
    given = table("CombiTimeTable", startTime=-0.5, shiftTime=0.0)

    found = external("ModelicaStandardTables_CombiTimeTable_getValue", [given, 1, time, event, event], {})
    assert found == pytest.approx(value)
