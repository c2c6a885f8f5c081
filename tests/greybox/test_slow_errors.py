"""An error that adds up over a whole trial is named, though it hardly shows over an eighth of one."""

from pathlib import Path

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from orchestrator.diagnose import diagnose
from orchestrator.measurements import load_measurements
from tests.three_trials import three_trials

CELL = """model Cell "A cell that is charged and discharged"
  parameter Real Q(unit="A.s") = 9000 "capacity";
  parameter Real R(unit="Ohm") = 0.01;
  input Real I(unit="A");
  Real soc(start=0.9, fixed=true);
  output Real U(unit="V");
equation
  der(soc) = -I/Q;
  U = 3.2 + 0.9*soc - 0.3*soc^2 - R*I;
end Cell;
"""
CASE = three_trials({"I": "A", "U": "V"})
TRUE = 7650.0  # 15 % less than the model says


def test_a_capacity_that_is_wrong_is_named_with_its_error(tmp_path: Path) -> None:
    random = np.random.default_rng(5)
    (tmp_path / "Cell.mo").write_text(CELL)
    (tmp_path / "case.toml").write_text(CASE)
    t = np.arange(400) * 5.0
    for trial in (1, 2, 3):
        current = np.repeat(random.uniform(-1.0, 4.0, 20), 20)
        charge = np.concatenate([[0.0], np.cumsum(current[:-1] * 5.0)])
        soc = 0.9 - charge / TRUE
        voltage = 3.2 + 0.9 * soc - 0.3 * soc**2 - 0.01 * current + 1e-2 * random.standard_normal(len(t))
        rows = np.column_stack([t, current, voltage])
        np.savetxt(tmp_path / f"trial_{trial}.csv", rows, delimiter=",", header="t,I,U", comments="", fmt="%.9g")
    found = diagnose(find_modelica_model(f"{tmp_path / 'Cell.mo'}:Cell"), load_measurements(str(tmp_path)), workers=1)
    assert found.verdict in ("named", "ambiguous")
    (effect,) = found.effects
    assert (effect.id, effect.site) == ("parameter_error", "Q")
    assert effect.parameters["share"].value == pytest.approx(TRUE / 9000 - 1, rel=0.1)
