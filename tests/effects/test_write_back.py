"""Terms written into classes of many styles: the compiled class is the original and the term, checked in two ways."""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fmus.catalogue import ModelicaModel
from fmus.errors import ModelicaError
from orchestrator.effects import AddedState, InputChange, OutputChange, Parameter, Term, write_back
from orchestrator.effects.changes import Change

DAMPED = "parameter Real m=2, d=3; input Real F; output Real v(start=1);"
DRY = Parameter(0.7, "N", "dry friction")
FRICTION = Term("v", "", "-fC*tanh(v/0.1)", {"fC": DRY}, "dry friction")


def written(
    folder: Path,
    text: str,
    changes: Sequence[Change],
    values: Mapping[str, float] = {},
    name: str = "M",  # noqa: B006
) -> tuple[ModelicaModel, ModelicaModel, str]:
    """The model of a text, the changed one, and the new text behind the user's own."""
    file = folder / "M.mo"
    file.write_text(text)
    base = ModelicaModel(name, name, file)
    new = write_back(base, "New", changes, values, folder / "out")
    assert file.read_text() == text
    assert new.file is not None
    return base, new, new.file.read_text()


def rates(model: ModelicaModel, x: Mapping[str, float], u: Mapping[str, float] = {}) -> dict[str, float]:  # noqa: B006
    """Derivatives of the states by name."""
    system = model.compile()
    states = [x.get(v.name, v.start or 0.0) for v in system.states]
    inputs = [u.get(v.name, v.start or 0.0) for v in system.inputs]
    dx, _ = system.rhs(0.0, states, inputs, [], [v.start for v in system.parameters])
    return dict(zip([v.name for v in system.states], np.array(dx).ravel().tolist(), strict=True))


# Each style says what der(v) gains from a force of 1.
STYLES = {
    "force on the right": (f"model M {DAMPED} equation m*der(v) = F - d*v; end M;", 1 / 2),
    "force on the left": (f"model M {DAMPED} equation F - d*v = m*der(v); end M;", 1 / 2),
    "residual": (f"model M {DAMPED} equation 0 = F - d*v - m*der(v); end M;", 1 / 2),
    "negative storage": (f"model M {DAMPED} equation -m*der(v) = d*v - F; end M;", 1 / 2),
    "acceleration by name": (f"model M {DAMPED} Real a; equation a = der(v); m*a = F - d*v; end M;", 1 / 2),
    "name behind": (f"model M {DAMPED} Real a; equation F = m*a + d*v; der(v) = a; end M;", 1 / 2),
    "if expression": (f"model M {DAMPED} equation m*der(v) = if F > 0 then F else 2*F - d*v; end M;", 1 / 2),
    "if equation": (
        f"model M {DAMPED} equation if F > 5 then m*der(v) = F; else m*der(v) = F - d*v; end if; end M;",
        1 / 2,
    ),
    "comments and strings": (
        f'model M "der(v) = 1; not this" {DAMPED} equation\n  // m*der(v) = F; an old one\n'
        '  m*der(v) /* = 3 */ = F - d*v "balance; of = forces" /* end */;\nend M;',
        1 / 2,
    ),
    "several lines": (f"model M {DAMPED}\nequation\n  m*der(v) =\n    F // drive\n    - d*v; // drag\nend M;", 1 / 2),
    "two on a line": (f"model M {DAMPED} Real x(start=0); equation m*der(v) = F - d*v; der(x) = v; end M;", 1 / 2),
    "divided": (f"model M {DAMPED} equation der(v) = (F - d*v)/m; end M;", 1.0),
    "inherited": (f"model B {DAMPED} equation m*der(v) = F - d*v; end B; model M extends B(d=4); end M;", 1 / 2),
    "inherited twice": (
        f"partial model A {DAMPED} Real f; equation m*der(v) = f; end A;"
        "model B extends A; equation f = F - d*v; end B; model M extends B(m=4); end M;",
        1 / 4,
    ),
    "filled by an input alone": ("model M input Real F; output Real v(start=1); equation der(v) = F; end M;", 1.0),
    "in a package": (f"package P model M {DAMPED} equation m*der(v) = F - d*v; end M; end P;", 1 / 2),
    "quoted name": (
        "model M parameter Real m=2; input Real F; output Real v(start=1); Real 'der(v)'; equation"
        " 'der(v)' = F; m*der(v) = 'der(v)'; end M;",
        1 / 2,
    ),
}


@pytest.mark.parametrize("style", STYLES)
def test_a_term_adds_to_the_balance_as_it_is_written(style: str, tmp_path: Path) -> None:
    text, gain = STYLES[style]
    name = "P.M" if "package" in text else "M"
    base, new, _ = written(tmp_path, text, [FRICTION], name=name)
    at: dict[str, float] = {"v": 0.3}
    added = rates(new, at, {"F": 1.5})["v"] - rates(base, at, {"F": 1.5})["v"]
    assert added == pytest.approx(-0.7 * np.tanh(3.0) * gain, rel=1e-9)


def test_a_speed_that_counts_the_other_way_than_the_shafts_takes_the_torque_where_the_place_says(
    tmp_path: Path,
) -> None:
    """Of the shaft's balance and the equation that defines the relative acceleration, the place names the first."""
    shaft = (
        "model M\n  parameter Real J=2; input Real F; Real w; Real a; Real aRel; Real v(start=1, stateSelect=StateSelect.always);\n"
        "equation\n  J*a = F - 3*w;\n  a = der(w);\n  v = -w;\n  aRel = der(v);\nend M;\n"
    )
    base, new, text = written(tmp_path, shaft, [replace(FRICTION, place="M.mo:4")])
    assert "J*a - fC*tanh(v/0.1) = F - 3*w;" in text
    added = rates(new, {"v": 0.3})["v"] - rates(base, {"v": 0.3})["v"]
    assert added == pytest.approx(-0.7 * np.tanh(3.0) / 2, rel=1e-9)


def test_the_changed_line_is_marked_and_nothing_else_of_the_class_changes(tmp_path: Path) -> None:
    text = 'model M "Slide"\n  parameter Real m = 2 "mass";\n  input Real F;\n  output Real v(start=1);\nequation\n  m*der(v) = F;  // balance\nend M;\n'
    _, new, all_text = written(tmp_path, text, [FRICTION])
    assert new.class_name == "New"
    assert all_text.startswith(text.rstrip())
    copy = all_text[len(text.rstrip()) :]
    assert copy.strip() == (
        ";\n\n// copied from M by misfit\n".lstrip(";\n")
        + 'model New "Slide"\n  parameter Real m = 2 "mass";\n  // dry friction, added by misfit\n'
        '  parameter Real fC(unit="N") = 0.7 "dry friction";\n  input Real F;\n  output Real v(start=1);\nequation\n'
        "  m*der(v) = F - fC*tanh(v/0.1);  // dry friction added by misfit  // balance\nend New;"
    )


def test_a_class_of_a_library_is_copied_in_front_of_a_file_that_begins_with_within(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "libs" / "Lib").mkdir(parents=True)
    (tmp_path / "libs" / "Lib" / "package.mo").write_text("within ;\npackage Lib\nend Lib;\n")
    mass = "within Lib;\nmodel Mass\n  parameter Real m=2, d=3; Real v(start=1);\nequation\n  m*der(v) = -d*v;\nend Mass;\n"
    (tmp_path / "libs" / "Lib" / "Mass.mo").write_text(mass)
    # The user's own folder is searched for libraries, too.
    monkeypatch.setenv("MODELICAPATH", f"{tmp_path / 'libs'}:{tmp_path}")
    friction = replace(FRICTION, state="body.v", expression="-fC*tanh(body.v/0.1)")
    users = "// a rig\nwithin ;\nmodel M\n  Lib.Mass body;\nend M;\n"
    base, new, text = written(tmp_path, users, [friction])
    assert text.count("within") == 0
    added = rates(new, {"body.v": 0.3})["body.v"] - rates(base, {"body.v": 0.3})["body.v"]
    assert added == pytest.approx(-0.7 * np.tanh(3.0) / 2, rel=1e-9)


def test_terms_of_array_equations_and_loops_reach_their_row(tmp_path: Path) -> None:
    vector = "model M parameter Real m[2]={2,4}; input Real F; Real v[2](each start=1); equation m.*der(v) = {F, 2*F} - v; end M;"
    loop = (
        "model M parameter Real C[3]={2,4,5}; input Real F; Real v[3](each start=1); equation\n"
        "for i in 1:3 loop\n  C[i]*der(v[i]) = F - v[i];\nend for; end M;"
    )
    for folder, text in (("a", vector), ("b", loop)):
        (tmp_path / folder).mkdir()
        base, new, _ = written(tmp_path / folder, text, [Term("v[2]", "", "-k*v[2]", {"k": DRY}, "loss")])
        before, after = rates(base, {"v[2]": 3.0}), rates(new, {"v[2]": 3.0})
        assert after["v[2]"] - before["v[2]"] == pytest.approx(-0.7 * 3.0 / 4)
        assert after["v[1]"] == before["v[1]"]


def test_a_coupled_mass_matrix_takes_the_term_in_the_states_own_row(tmp_path: Path) -> None:
    text = (
        "model M parameter Real A[2,2]={{3,1},{1,2}}; input Real F; Real v[2](each start=1);\n"
        "equation A*der(v) = {F, 0}; end M;"
    )
    base, new, _ = written(tmp_path, text, [Term("v[2]", "", "-k*v[2]", {"k": DRY}, "loss")])
    gained = np.linalg.solve([[3, 1], [1, 2]], [0, -0.7 * 3.0])
    before, after = rates(base, {"v[2]": 3.0}), rates(new, {"v[2]": 3.0})
    assert [after[f"v[{k}]"] - before[f"v[{k}]"] for k in (1, 2)] == pytest.approx(gained.tolist())


PARTS = (
    "package P\n  model Body\n    parameter Real m=2;\n    input Real f;\n    Real v(start=1);\n  equation\n    m*der(v) = f;\n  end Body;\n"
    "  model Plant\n    input Real F;\n    Body a(f=F), b(m=5, f=a.v);\n    output Real y = b.v;\n  end Plant;\nend P;\n"
)


def test_one_part_of_two_gets_the_term_and_keeps_its_modifiers(tmp_path: Path) -> None:
    base, new, text = written(tmp_path, PARTS, [Term("b.v", "", "-k*b.v", {"k": DRY}, "drag")], name="P.Plant")
    assert new.class_name == "P.New"
    assert "BodyWithDrag b(m=5, f=a.v)" in text
    before, after = rates(base, {"b.v": 2.0}), rates(new, {"b.v": 2.0})
    assert after["a.v"] == before["a.v"]
    assert after["b.v"] - before["b.v"] == pytest.approx(-0.7 * 2.0 / 5)
    assert {v.name: v.start for v in new.compile().parameters}["b.k"] == 0.7


def test_a_term_between_two_parts_is_given_to_one_from_outside(tmp_path: Path) -> None:
    base, new, text = written(tmp_path, PARTS, [Term("b.v", "", "-k*(b.v - a.v)", {"k": DRY}, "drag")], name="P.Plant")
    assert "added=-k*(b.v - a.v)" in text
    before, after = rates(base, {"b.v": 2.0, "a.v": 0.5}), rates(new, {"b.v": 2.0, "a.v": 0.5})
    assert after["b.v"] - before["b.v"] == pytest.approx(-0.7 * 1.5 / 5)


def test_two_terms_and_a_law_with_memory_stand_in_one_equation(tmp_path: Path) -> None:
    creep = Term("v", "", "-z", {"T": Parameter(3.0, "s", "")}, "creep", [AddedState("z", "N", 0.0, "(v - z)/T")])
    base, new, text = written(tmp_path, STYLES["force on the right"][0], [FRICTION, creep])
    assert "dry friction and creep added by misfit" in text
    at = {"v": 0.3, "z": 0.2}
    after = rates(new, at)
    assert after["v"] - rates(base, at)["v"] == pytest.approx((-0.7 * np.tanh(3.0) - 0.2) / 2)
    assert after["z"] == pytest.approx((0.3 - 0.2) / 3)


def test_what_acts_instead_of_an_input_reaches_every_use_of_it(tmp_path: Path) -> None:
    change = InputChange(
        "F", "g*F + b", {"g": Parameter(1.5, "1", ""), "b": Parameter(0.2, "N", "")}, "gain of the drive"
    )
    base, new, text = written(tmp_path, STYLES["if expression"][0], [change])
    assert "FActual" in text
    assert rates(new, {"v": 0.3}, {"F": 1.0})["v"] == pytest.approx(rates(base, {"v": 0.3}, {"F": 1.7})["v"])


def test_a_sensor_stands_between_a_state_and_the_output_that_was_it(tmp_path: Path) -> None:
    change = OutputChange("v", "s*v", {"s": Parameter(1.1, "1", "")}, "gain of the sensor")
    _, new, _ = written(tmp_path, STYLES["force on the right"][0], [change, FRICTION])
    system = new.compile()
    assert system.outputs == ("v",)
    assert [v.name for v in system.states] == ["vActual"]
    z = system.rhs(0.0, [2.0], [0.0], [], [v.start for v in system.parameters])[1]
    assert np.array(z).ravel()[[v.name for v in system.algebraics].index("v")] == pytest.approx(2.2)


@pytest.mark.parametrize("declared", ['output Real a, b "both";', "output Real a, c, b;", "output Real c, a, b;"])
def test_sensors_of_two_outputs_that_one_line_declares_read_both_wrong(declared: str, tmp_path: Path) -> None:
    more = "  c = 0;\n" if "c" in declared else ""
    text = f"model M\n  {declared}\n  Real x(start=1);\nequation\n  der(x) = -x;\n  a = x;\n  b = 2*x;\n{more}end M;\n"
    changes = [OutputChange(n, f"s{n}*{n}", {f"s{n}": Parameter(3.0, "1", "")}, "gain") for n in ("a", "b")]
    _, new, _ = written(tmp_path, text, changes)
    system = new.compile()
    z = np.array(system.rhs(0.0, [1.5], [], [], [v.start for v in system.parameters])[1]).ravel()
    shown = dict(zip([v.name for v in system.algebraics], z, strict=True))
    assert (shown["a"], shown["b"]) == pytest.approx((3 * 1.5, 3 * 2 * 1.5))


def test_sensors_of_outputs_that_a_base_class_declares_are_changed_in_a_copy_of_the_base(tmp_path: Path) -> None:
    base = "model Base\n  parameter Real k=1;\n  output Real a;\n  Real x(start=1);\nequation\n  der(x) = -k*x;\n  a = x;\nend Base;\n"
    text = f"{base}\nmodel M\n  extends Base(k=2);\nend M;\n"
    change = OutputChange("a", "a + zero", {"zero": Parameter(0.25, "1", "")}, "a wrong zero")
    _, new, _ = written(tmp_path, text, [change], {"k": 3.0})
    system = new.compile()
    rates, z = system.rhs(0.0, [1.5], [], [], [v.start for v in system.parameters])
    assert float(rates) == pytest.approx(-3 * 1.5)
    shown = dict(zip([v.name for v in system.algebraics], np.array(z).ravel(), strict=True))
    assert shown["a"] == pytest.approx(1.75)


def test_a_lag_of_an_input_and_one_of_an_output_bring_states_of_their_own(tmp_path: Path) -> None:
    lag = InputChange("F", "z", {"T": Parameter(0.5, "s", "")}, "lag", [AddedState("z", "N", 0.0, "(F - z)/T")])
    slow = OutputChange(
        "v", "w", {"S": Parameter(0.1, "s", "")}, "slow sensor", [AddedState("w", "m/s", 0.0, "(v - w)/S")]
    )
    _, new, _ = written(tmp_path, STYLES["force on the right"][0], [lag, slow])
    found = rates(new, {"vActual": 2.0, "z": 1.0, "w": 0.5}, {"F": 3.0})
    assert found["vActual"] == pytest.approx((1.0 - 3 * 2.0) / 2)
    assert found["z"] == pytest.approx((3.0 - 1.0) / 0.5)
    assert found["w"] == pytest.approx((2.0 - 0.5) / 0.1)


def test_other_values_alone_make_a_class_that_extends_the_users(tmp_path: Path) -> None:
    _, new, text = written(tmp_path, PARTS, [], {"b.m": 6.5}, "P.Plant")
    assert "extends Plant(\n      b(m=6.5))" in text
    assert {v.name: v.start for v in new.compile().parameters}["b.m"] == 6.5


def test_other_values_beside_a_term_are_written_where_they_are_declared(tmp_path: Path) -> None:
    _, new, text = written(tmp_path, STYLES["force on the right"][0], [FRICTION], {"d": 3.5})
    assert "d=3.5" in text
    assert "d was 3; adjusted by misfit" in text
    assert {v.name: v.start for v in new.compile().parameters}["d"] == 3.5


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (Term("w", "", "-w", {}, "x"), "'w' is no state of the model"),
        (Term("v", "", "-d*v", {"d": DRY}, "x"), "has a 'd' already"),
        (Term("v", "", "-q*v", {}, "x"), "q"),
        (InputChange("G", "G", {}, "x"), "no input, output or parameter 'G'"),
    ],
)
def test_what_cannot_be_written_is_refused_in_one_line(change: Change, words: str, tmp_path: Path) -> None:
    with pytest.raises(ModelicaError, match=words) as caught:
        written(tmp_path, STYLES["force on the right"][0], [change])
    assert "\n" not in str(caught.value)


def test_a_file_that_says_something_else_than_the_changes_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The check does not trust the text: a slip of the pen there is found."""
    module = sys.modules["orchestrator.effects.write_back"]

    real = module.with_terms
    monkeypatch.setattr(module, "with_terms", lambda text, terms, file: real(text, [(-s, e) for s, e in terms], file))
    with pytest.raises(ModelicaError, match="does not say the original's equation and the added terms"):
        written(tmp_path, STYLES["force on the right"][0], [FRICTION])
