"""Boolean and Integer variables without memory, and asserts."""

from pathlib import Path

import numpy as np
import pytest

from fmus.catalogue import ModelicaModel
from fmus.errors import ModelicaError
from fmus.symbolic.system import SymbolicSystem

CONTACT = """model M
  parameter Real k = 3;
  output Real x(start=1, fixed=true);
  Boolean contact "touches";
  Boolean deep = contact and x < 0.2;
  Integer n;
equation
  contact = x < 0.5;
  n = if deep then 4 elseif contact then 2 else 1;
  der(x) = if contact then -n*k*x else -1;
end M;
"""


def compiled(text: str, folder: Path) -> SymbolicSystem:
    (folder / "M.mo").write_text(text)
    return ModelicaModel("M", "M", folder / "M.mo").compile()


@pytest.mark.parametrize(("x", "rate"), [(1.0, -1.0), (0.4, -2 * 3 * 0.4), (0.1, -4 * 3 * 0.1)])
def test_a_boolean_and_an_integer_are_their_expressions(x: float, rate: float, tmp_path: Path) -> None:
    system = compiled(CONTACT, tmp_path)
    assert float(system.rhs(0.0, [x], [], [], [3.0])[0]) == pytest.approx(rate)
    assert not [note for note in system.notes if "not checked" in note]


def test_the_relation_of_a_boolean_is_an_event(tmp_path: Path) -> None:
    system = compiled(CONTACT, tmp_path)
    assert system.relations is not None
    assert any("x < 0.5" in name for name in system.relations.names)


def test_a_boolean_output_is_refused_with_the_rewrite(tmp_path: Path) -> None:
    text = "model M\n  Real x(start=1);\n  output Boolean b;\nequation\n  b = x > 2;\n  der(x) = -x;\nend M;\n"
    with pytest.raises(
        ModelicaError, match=r"M\.mo:3: the output b is no Real; declare a Real that is 'if b then 1 else 0'"
    ):
        compiled(text, tmp_path)


ASSERTED = 'model M\n  parameter Real m = {m};\n  Real x(start=1);\nequation\n  der(x) = -x/m;\n  assert({condition}, "the mass");\nend M;\n'


def test_an_assert_on_parameters_that_does_not_hold_refuses_the_model(tmp_path: Path) -> None:
    with pytest.raises(ModelicaError, match=r"M\.mo:6: the assert does not hold at the declared values: the mass"):
        compiled(ASSERTED.format(m=-2, condition="m > 0 and m < 5"), tmp_path)


def test_an_assert_on_parameters_that_holds_leaves_no_trace(tmp_path: Path) -> None:
    system = compiled(ASSERTED.format(m=2, condition="m > 0"), tmp_path)
    assert not [note for note in system.notes if "assert" in note]
    assert np.array(system.rhs(0.0, [1.0], [], [], [2.0])[0]).item() == -0.5


def test_an_assert_on_variables_is_noted_as_not_watched(tmp_path: Path) -> None:
    system = compiled(ASSERTED.format(m=2, condition="x > -5"), tmp_path)
    assert "asserts on variables are not watched during runs: M.mo:6" in system.notes
