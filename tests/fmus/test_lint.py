"""What the front end drops without a word is refused with file and line, and the recommended way gives the answer.

Each probe of rumoca 0.10.2 compiles without the linter and gives a wrong right-hand side.
"""

import math
from dataclasses import dataclass
from pathlib import Path

import pytest

from fmus.catalogue import ModelicaModel
from fmus.errors import ModelicaError
from fmus.frontend.lint import lint_class
from fmus.library import library_root

# `Slot` has a replaceable class and a replaceable component; yy = law.y + 10 s.y. K multiplies by k.
CLASSES = """package P
partial model L input Real v; output Real y; end L;
model Z extends L; parameter Real z = 1; equation y = 0; end Z;
model K extends L; parameter Real k = 1; equation y = k*v; end K;
model K2 extends K; end K2;
partial model Has input Real u; output Real yy; end Has;
model Slot extends Has; replaceable model Law = Z constrainedby L; Law law; replaceable Z s constrainedby L;
equation law.v = u; s.v = u; yy = law.y + 10*s.y; end Slot;
model Inherits extends Slot; end Inherits;
model Short = Slot;
model Top extends Has; Slot sub; equation sub.u = u; yy = sub.yy; end Top;
model TopInherits extends Top; end TopInherits;
model WithK extends Slot(redeclare model Law = K, law(k=6)); end WithK;
"""
LINE = CLASSES.count("\n") + 1
USER = "\nmodel A B b; Real x(start=1, fixed=true); equation b.u = x; der(x) = b.yy; end A;\nend P;\n"


def built(text: str, folder: Path) -> float:
    """Right-hand side of `P.A` at x = 1, where `text` declares `P.B` in line `LINE`."""
    file = folder / "probe.mo"
    file.write_text(CLASSES + text + USER)
    system = ModelicaModel("P.A", "P.A", file).compile()
    dx, _ = system.rhs(0.0, [1.0], [], [], [v.start for v in system.parameters])
    return float(dx)


@dataclass(frozen=True)
class Construct:
    """A text that is refused with certain words, and the recommended text with its right-hand side."""

    wrong: str
    words: str
    right: str
    expected: float


def slot(declaration: str, part: str = "s") -> str:
    return f"model S extends Has; {declaration}; equation {part}.v = u; yy = {part}.y; end S; "


CONSTRUCTS = {
    "modifiers in a redeclared class": Construct(
        "model B extends Slot(redeclare model Law = K(k=6)); end B;",
        "the modifiers of 'redeclare model Law = K(...)' would be dropped",
        "model B extends Slot(redeclare model Law = K, law(k=6)); end B;",
        6.0,
    ),
    "modifiers in a redeclared class of a part": Construct(
        "model B extends Has; Slot p(redeclare model Law = K(k=6)); equation p.u = u; yy = p.yy; end B;",
        "modify the component of this class beside it",
        "model B extends Has; Slot p(redeclare model Law = K, law(k=6)); equation p.u = u; yy = p.yy; end B;",
        6.0,
    ),
    "modifiers in a constraining clause": Construct(
        slot("replaceable K s constrainedby K(k=4)") + "model B extends S; end B;",
        "the modifiers of 'constrainedby K(...)' would be ignored",
        "model K4 extends K(k=4); end K4; "
        + slot("replaceable K4 s constrainedby K4")
        + "model K4b extends K4; end K4b; model B extends S(redeclare K4b s); end B;",
        4.0,
    ),
    "component redeclared where its slot is inherited": Construct(
        "model B extends Inherits(redeclare K s(k=6)); end B;",
        "the redeclaration of 's' would be dropped, because Slot, and not the extended class, declares it",
        "model B extends Slot(redeclare K s(k=6)); end B;",
        60.0,
    ),
    "component redeclared through a short class": Construct(
        "model B = Short(redeclare K s(k=6));",
        "the redeclaration of 's' would be dropped",
        "model B = Slot(redeclare K s(k=6));",
        60.0,
    ),
    "class redeclared in the modifiers of an inherited part": Construct(
        "model B extends Top(sub(redeclare model Law = K)); end B;",
        "the redeclaration of 'Law' inside the modifiers of a part would be dropped",
        "model B extends Has; WithK sub; equation sub.u = u; yy = sub.yy; end B;",
        6.0,
    ),
    "component redeclared in the modifiers of a part of a part": Construct(
        "model B extends Has; TopInherits t(sub(redeclare K s)); equation t.u = u; yy = t.yy; end B;",
        "the redeclaration of 's' inside the modifiers of a part would be dropped",
        "model R extends Has; replaceable Slot sub; equation sub.u = u; yy = sub.yy; end R; "
        "model B extends R(redeclare WithK sub); end B;",
        6.0,
    ),
    "modifier that a redeclaration should have lost": Construct(
        slot("replaceable K s(k=4) constrainedby L") + "model B extends S(redeclare K2 s); end B;",
        "the redeclared 's' would keep the value of 'k' from its first declaration",
        slot("replaceable K s(k=4) constrainedby L") + "model B extends S(redeclare K2 s(k=1)); end B;",
        1.0,
    ),
    "modifier that a redeclaration should have kept": Construct(
        slot("replaceable model Law = K(k=4); Law s") + "model B extends S(redeclare model Law = K2); end B;",
        "redeclaring 'Law' would lose the value of 'k'",
        slot("replaceable model Law = K; Law s(k=4)") + "model B extends S(redeclare model Law = K2); end B;",
        4.0,
    ),
    "unknown modifier of a base class": Construct(
        slot("K s") + "model T extends S; parameter Real gain = 2; end T; model B extends T(gian=3); end B;",
        "'gian' is not an element of T; did you mean 'gain'?",
        "model B extends Slot(redeclare model Law = K, law(k=3)); end B;",
        3.0,
    ),
    "unknown modifier of a part of a base class": Construct(
        "model B extends WithK(law(K=3)); end B;",
        "'K' is not an element of K; did you mean 'k'?",
        "model B extends WithK(law(k=3)); end B;",
        3.0,
    ),
    "unknown modifier of a redeclared component": Construct(
        "model B extends Slot(redeclare K s(kk=3)); end B;",
        "'kk' is not an element of K; did you mean 'k'?",
        "model B extends Slot(redeclare K s(k=3)); end B;",
        30.0,
    ),
    "unknown modifier beside a redeclared class": Construct(
        "model B extends Slot(redeclare model Law = K, law(z=3)); end B;",
        "'z' is not an element of K",
        "model B extends Slot(law(z=3)); end B;",
        0.0,
    ),
    "modifiers of a class": Construct(
        slot("replaceable model Law = K; Law s") + "model B extends S(Law(k=3)); end B;",
        "the modifiers of the class 'Law' would be dropped",
        slot("replaceable model Law = K; Law s") + "model B extends S(s(k=3)); end B;",
        3.0,
    ),
    "value of a redeclared parameter": Construct(
        "model G extends Has; replaceable parameter Real k = 3; equation yy = k*u; end G;"
        "model B extends G(redeclare parameter Real k = 4); end B;",
        "the value of the redeclared 'k' would be dropped; write 'k = ...'",
        "model G extends Has; parameter Real k = 3; equation yy = k*u; end G; model B extends G(k=4); end B;",
        4.0,
    ),
    "dotted modifier": Construct(
        "model B extends WithK(law.k=3); end B;",
        "write 'law(k = ...)' instead of 'law.k = ...'",
        "model B extends WithK(law(k=3)); end B;",
        3.0,
    ),
    "unknown class redeclared": Construct(
        "model B extends Slot(redeclare model Lw = K); end B;",
        "'Lw' is not an element of Slot; did you mean 'Law'?",
        "model B extends Slot(redeclare model Law = K); end B;",
        1.0,
    ),
    "fixed part redeclared": Construct(
        "model B extends TopInherits(redeclare WithK sub); end B;",
        "'sub' cannot be redeclared; it is not declared as replaceable",
        "model B extends Has; WithK sub; equation sub.u = u; yy = sub.yy; end B;",
        6.0,
    ),
}


@pytest.mark.parametrize("construct", CONSTRUCTS)
def test_construct_that_would_be_misread_is_refused_with_file_and_line(construct: str, tmp_path: Path) -> None:
    with pytest.raises(ModelicaError) as refusal:
        built(CONSTRUCTS[construct].wrong, tmp_path)

    assert str(refusal.value).startswith(f"probe.mo:{LINE}: ")
    assert CONSTRUCTS[construct].words in str(refusal.value)
    assert len(str(refusal.value).splitlines()) == 1


@pytest.mark.parametrize("construct", CONSTRUCTS)
def test_recommended_way_gives_the_right_derivative(construct: str, tmp_path: Path) -> None:
    value = built(CONSTRUCTS[construct].right, tmp_path)

    assert math.isclose(value, CONSTRUCTS[construct].expected, rel_tol=1e-12)


ACCEPTED = {
    "redeclared component of a part, slot inherited": (
        "model B extends Has; Inherits p(redeclare K s(k=6)); equation p.u = u; yy = p.yy; end B;",
        60.0,
    ),
    "redeclared class, slot inherited": ("model B extends Inherits(redeclare model Law = K, law(k=6)); end B;", 6.0),
    "redeclaration among the declarations keeps its modifiers": (
        "model B extends Inherits; redeclare model Law = K(k=6); end B;",
        6.0,
    ),
    "class redeclared twice": (
        "model C extends Slot(redeclare replaceable model Law = K); end C;"
        "model B extends C(redeclare model Law = K2, law(k=6)); end B;",
        6.0,
    ),
    "modifier of a redeclared component, one class further down": (
        "model C extends Slot(redeclare K s); end C; model B extends C(s(k=6)); end B;",
        60.0,
    ),
}


@pytest.mark.parametrize("construct", ACCEPTED)
def test_construct_that_the_front_end_reads_well_is_not_refused(construct: str, tmp_path: Path) -> None:
    text, expected = ACCEPTED[construct]

    assert math.isclose(built(text, tmp_path), expected, rel_tol=1e-12)


def test_every_class_of_the_library_passes() -> None:
    root = library_root()
    names = [file.relative_to(root).with_suffix("").parts for file in sorted((root / "FESArm").rglob("*.mo"))]

    for parts in names:
        lint_class(".".join(parts).removesuffix(".package"), None, [root])


def test_class_that_the_file_does_not_declare_is_named(tmp_path: Path) -> None:
    file = tmp_path / "my.mo"
    file.write_text("model B Real x; equation der(x) = -x; end B;")

    with pytest.raises(ModelicaError, match=r"^my\.mo:1: there is no class 'A'; the file declares B$"):
        ModelicaModel("A", "A", file).compile()


def test_unknown_base_class_is_told_before_the_names_it_might_declare(tmp_path: Path) -> None:
    with pytest.raises(ModelicaError, match=rf"^probe\.mo:{LINE}: base class not found: `Slt`"):
        built("model C extends Slt; end C; model B extends C(law(k=3)); end B;", tmp_path)
