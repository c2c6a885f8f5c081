"""Loops whose inner points the front end does not write out in its flat form are no contradiction."""

from pathlib import Path

import pytest

from fmus.catalogue import ModelicaModel

MODEL = """
model Lags
  parameter Integer n = 5;
  input Real u[n];
  output Real a[n](each start=0, each fixed=true);
equation
  for i in 1:n loop
    der(a[i]) = noEvent(if u[i] > a[i] then (u[i] - a[i])/0.25 else (u[i] - a[i])/0.5);
  end for;
end Lags;
"""


def test_a_loop_over_a_condition_without_events_is_translated_at_all_points(tmp_path: Path) -> None:
    (tmp_path / "Lags.mo").write_text(MODEL)
    system = ModelicaModel("Lags", "Lags", tmp_path / "Lags.mo").compile()
    dx, _ = system.rhs(0.0, [0.0] * 5, [1.0, -1.0, 1.0, -1.0, 1.0], [], [])
    assert dx.full().ravel() == pytest.approx([4.0, -2.0, 4.0, -2.0, 4.0])
