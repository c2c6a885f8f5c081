"""Constructs outside the supported subset are refused with their name, file and line."""

from pathlib import Path

import pytest

from fmus.catalogue import ModelicaModel
from fmus.errors import ModelicaError

BODY = "model A\n  {declaration}\n  Real x(start=1, fixed=true);\nequation\n  der(x) = -1;\n  {equation}\nend A;\n"
REFUSED = {
    "terminate": ("", 'when x < 0 then terminate("done"); end when;', 6, "terminate()"),
    "input with the value of another variable": (
        "input Real u = 2*x;",
        "",
        2,
        "the input u is given a value that depends on",
    ),
    "delay of a state": ("Real y;", "y = delay(x, 0.1, 1.0);", 6, "delay() of a quantity that depends on states"),
}


@pytest.mark.parametrize("construct", REFUSED)
def test_refusal_names_construct_file_and_line(construct: str, tmp_path: Path) -> None:
    declaration, equation, line, words = REFUSED[construct]
    file = tmp_path / "probe.mo"
    file.write_text(BODY.format(declaration=declaration, equation=equation))

    with pytest.raises(ModelicaError) as refusal:
        ModelicaModel("A", "A", file).compile()

    assert str(refusal.value).startswith(f"probe.mo:{line}: {words}")
    assert len(str(refusal.value).splitlines()) == 1


def test_further_constructs_are_listed_with_their_places(tmp_path: Path) -> None:
    file = tmp_path / "probe.mo"
    two = 'when x < 0.2 then terminate("done"); end when;\n  when x < 0.5 then terminate("half"); end when;'
    file.write_text(BODY.format(declaration="", equation=two))

    with pytest.raises(ModelicaError, match=r"^probe\.mo:6: terminate\(\) .*; so are terminate\(\) \(probe\.mo:7\)"):
        ModelicaModel("A", "A", file).compile()


def test_a_variable_that_has_to_be_a_state_and_is_none_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "probe.mo"
    file.write_text(
        "model A\n  Real x(start=2, stateSelect=StateSelect.always);\n  Real z;\nequation\n  z = 2*x;\n  der(z) = -x;\nend A;\n"
    )
    with pytest.raises(ModelicaError, match=r"^probe\.mo:2: x has StateSelect\.always, but the states are z"):
        ModelicaModel("A", "A", file).compile()


def test_an_input_that_is_declared_with_a_number_has_it_until_it_is_driven(tmp_path: Path) -> None:
    file = tmp_path / "probe.mo"
    file.write_text(
        BODY.format(declaration="input Real u = 3; input Real w[2] = {1, 2}; input Real v(start=4);", equation="")
    )
    system = ModelicaModel("A", "A", file).compile()
    assert {v.name: v.start for v in system.inputs} == {"u": 3, "w[1]": 1, "w[2]": 2, "v": 4}
