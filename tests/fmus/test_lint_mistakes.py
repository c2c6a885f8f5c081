"""Typical mistakes in a user's file give one line with file and line."""

from pathlib import Path

import pytest

from fmus.catalogue import ModelicaModel
from fmus.errors import ModelicaError

START = "model My\n  import SI = FESArm.Units;\n  Real x(start=1, fixed=true);\n"
END = "equation\n  der(x) = -x;\nend My;\n"

# Mistake: text, line, words of the message.
MISTAKES = {
    "missing semicolon after a declaration": (f"{START}  Real y = x\n{END}", 4, "';' is missing between 'x' and"),
    "missing semicolon after an equation": (
        f"{START}  Real y;\nequation\n  der(x) = -x\n  y = x;\nend My;\n",
        6,
        "';' is missing between 'x' and 'y'",
    ),
    "misspelt type": (f"{START}  SI.Lenght l = 1;\n{END}", 4, "'SI.Lenght'"),
    "misspelt variable": (f"{START}equation\n  der(x) =\n    -xx;\nend My;\n", 6, "'xx'"),
    "unknown base class": (f"{START}  extends FESArm.Arms.Leg;\n{END}", 4, "'FESArm.Arms.Leg'"),
    "too few equations": (f"{START}  Real y;\n{END}", 1, "unbalanced model: 1 equations for 2 unknowns; add 1"),
    "too many equations": (
        f"{START}equation\n  der(x) = -x;\n  x = 1;\nend My;\n",
        1,
        "unbalanced model: 2 equations for 1 unknowns; remove 1",
    ),
    "array of the wrong size": (
        f"{START}  parameter Real k[2] = {{1, 2, 3}};\n{END}",
        4,
        "'k' has 2 elements, but 3 values are given",
    ),
    "array for a scalar": (f"{START}  parameter Real k = {{1, 2}};\n{END}", 4, "'k' of My is a scalar"),
    "a value for each part of an array, and something else wrong": (
        "model Part\n  parameter Real k = 1;\n  Real z;\nequation\n  z = k;\nend Part;\n"
        f"{START}  Part p[2](k={{1, 2}});\n  Real y;\n{END}",
        7,
        "unbalanced model: 3 equations for 4 unknowns; add 1",
    ),
    "a flow of a connector that nothing is connected to": (
        "connector Port\n  Real p;\n  flow Real q;\nend Port;\nmodel Part\n  Port a;\n  outer World world;\nequation\n"
        "  a.p = world.p;\nend Part;\nmodel World\n  Real p;\nequation\n  p = 3;\nend World;\n"
        f"{START}  inner World world;\n  Part one, two, three;\nequation\n  connect(one.a, two.a);\n  three.a.q = 1;\n{END}",
        16,
        "; the flow of a connector that nothing is connected to is zero without an equation",
    ),
    "array of the wrong size in a modifier": (
        f"{START}  FESArm.Effects.JointTorque.ViscousFriction f(n=1,\n    b={{0.2, 0.3}});\n"
        "equation\n  f.q = {x};\n  f.w = {0};\n  f.a = {0};\n  der(x) = -x;\nend My;\n",
        5,
        "'b' has 1 elements, but 2 values are given",
    ),
    "missing end": (f"{START}equation\n  der(x) = -x;\n", 6, "'end My;' of line 1 is missing"),
    "end of another class": (f"{START}equation\n  der(x) = -x;\nend Mu;\n", 6, "'end Mu' closes 'model My' of line 1"),
    "if without end": (
        f"{START}equation\n  if x > 0 then\n    der(x) = -x;\nend My;\n",
        7,
        "the 'if' of line 5 is not closed",
    ),
    "unknown function": (f"{START}equation\n  der(x) = -sine(x);\nend My;\n", 5, "'sine'"),
    "unknown slot": (
        "model My\n  extends FESArm.Arms.Arm(\n    redeclare model Torque = FESArm.Effects.JointTorque.ViscousFriction);\n"
        "end My;\n",
        3,
        "'Torque' is not an element of Arm",
    ),
    "wrong unit": (
        f"{START}  SI.Length l;\n  SI.Mass m = 2;\nequation\n  der(x) = -x;\n  l = m;\nend My;\n",
        8,
        "the units of the equation differ: l has m, m has kg",
    ),
    "wrong kind of value": (f"{START}equation\n  der(x) = -x + true;\nend My;\n", 5, "found `Boolean`"),
    "unclosed parenthesis": (f"{START}equation\n  der(x) = -(x + 1;\nend My;\n", 5, "')' is missing"),
    "unclosed string": (f'{START}  Real y = x "Output;\n{END}', 4, "not closed"),
    "declared twice": (f"{START}  Real x;\n{END}", 4, "'x' is declared already in line 3"),
    "parameter without value": (f"{START}  parameter Real k;\n{END}", 4, "parameter k has no value"),
    "assignment among equations": (
        f"{START}equation\n  der(x) := -x;\nend My;\n",
        5,
        "an equation is written with '='",
    ),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_mistake_is_told_in_one_line_with_file_and_line(mistake: str, tmp_path: Path) -> None:
    text, line, words = MISTAKES[mistake]
    file = tmp_path / "My.mo"
    file.write_text(text)

    with pytest.raises(ModelicaError) as refusal:
        ModelicaModel("My", "My", file).compile()

    assert str(refusal.value).startswith(f"My.mo:{line}: ")
    assert words in str(refusal.value)
    assert len(str(refusal.value).splitlines()) == 1
    assert str(tmp_path) not in str(refusal.value)
