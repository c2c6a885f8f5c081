"""Algorithms of models as equations: values worked out by hand, and what stays as it is."""

from pathlib import Path

import numpy as np
import pytest

from fmus.catalogue import ModelicaModel
from fmus.frontend.rewrite import rewritten

HEAD = "model M\n  Real x(start=2, fixed=true); output Real y; Real a; Real b; Boolean on;\n"
END = "equation\n  der(x) = -x;\nend M;\n"

# Statements, and y at x = 2.
ALGORITHMS = {
    "limits": ("a := 3*x; on := a > 5; if a > 5 then a := 5; elseif a < -5 then a := -5; end if; b := a; y := b;", 5.0),
    "steps that read the one before": ("on := true; a := x; a := a + 1; b := a; a := a*b; y := a - b;", 6.0),
    "branches in branches": (
        "on := x > 1; a := 0; b := 7; if on then if x > 3 then a := 1; else a := x; b := 2*a; end if; else a := 9; end if;"
        " y := 10*a + b;",
        24.0,
    ),
    "a value of an if that an if reads": (
        "on := false; if x > 1 then a := 2; else a := 3; end if; b := if a > 2 then 1 else 4; if x > 5 then b := b + a; end if;"
        " y := a*b;",
        8.0,
    ),
    "several results of a function": ("on := false; (a, b) := both(x); y := a - b;", 4.0 - 6.0),
}
BOTH = "function both input Real u; output Real p; output Real q; algorithm p := u; p := p*u; q := 3*u; end both;\n"


@pytest.mark.parametrize("kind", ALGORITHMS)
def test_an_algorithm_gives_the_values_that_its_last_statements_leave(kind: str, tmp_path: Path) -> None:
    statements, value = ALGORITHMS[kind]
    file = tmp_path / "M.mo"
    file.write_text(f"{BOTH}{HEAD}algorithm\n  {statements}\n{END}")
    system = ModelicaModel("M", "M", file).compile()
    _, z = system.rhs(0.0, [2.0], [], [], [])
    assert dict(zip([v.name for v in system.algebraics], np.array(z).ravel(), strict=True))["y"] == value


def test_every_statement_stays_in_its_line() -> None:
    text = (
        f"{HEAD}algorithm\n  a := 3*x; // three\n  on := a > 5;\n  if on then\n    a := 5;\n  end if;\n  y := a;\n{END}"
    )
    lines = rewritten(text, "M.mo").split("\n")
    assert len(lines) == len(text.split("\n"))
    assert lines[2] == "equation" and lines[4] == " on = (3 * x) > 5;"
    assert lines[5] == " a = if on then 5 else 3 * x;"
    assert lines[8] == " y = a;"


def test_what_was_before_the_event_is_read_as_it_stands() -> None:
    text = f"{HEAD}algorithm\n  on := x > 3 or pre(on) and x > 1;\n  y := if on then 1 else 0;\n  a := y;\n  b := a;\n{END}"
    assert "\n on = x > 3 or pre ( on ) and x > 1;\n y = if on then 1 else 0;\n" in rewritten(text, "M.mo")


@pytest.mark.parametrize(
    "statements",
    [
        "a := a + 1;",  # the value of the last step
        "if x > 1 then a := 1; end if;",
        "for i in 1:2 loop a := i; end for;",
        "when x > 1 then a := 1; end when;",
        "v[1] := x; v[2] := 1;",
    ],
)
def test_what_no_equation_says_stays_for_the_compiler_to_judge(statements: str) -> None:
    text = f"{HEAD}algorithm\n  {statements}\n{END}"
    assert rewritten(text, "M.mo") == text


def test_functions_stay_algorithms() -> None:
    assert rewritten(BOTH, "M.mo") == BOTH
