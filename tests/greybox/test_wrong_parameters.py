"""Data sheets err by a few percent in everything: no sensor, memory or formula may stand for that."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fmus.catalogue import find_modelica_model
from orchestrator.discover import discover
from orchestrator.measurements import load_measurements

VESSEL = """model Vessel "Two reactions in a stirred vessel, A -> B -> C, isothermal"
  parameter Real V(unit="m3")=0.06;
  parameter Real k1(unit="1/s")=2.4e-3, k2(unit="1/s")=9e-4;
  parameter Real cf(unit="mol/m3")=1800 "feed";
  input Real F(unit="m3/s");
  output Real cA(unit="mol/m3", start=400), cB(unit="mol/m3", start=300);
equation
  V*der(cA) = F*(cf - cA) - V*k1*cA;
  V*der(cB) = -F*cB + V*(k1*cA - k2*cB);
end Vessel;
"""
CASE = """files = ["trial_1.csv", "trial_2.csv", "trial_3.csv", "trial_4.csv"]
learning = [1, 2, 3]
held_out = [4]
[columns]
time = "s"
F = "m3/s"
cA = "mol/m3"
cB = "mol/m3"
[interpolation]
F = "hold"
"""
V, K1, K2, CF = 0.06 * 1.01, 2.4e-3 * 0.98, 9e-4 * 1.02, 1800 * 0.985


@pytest.fixture(scope="module")
def vessel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder, random = tmp_path_factory.mktemp("vessel"), np.random.default_rng(3)
    (folder / "Vessel.mo").write_text(VESSEL)
    (folder / "case.toml").write_text(CASE)
    time = 10.0 * np.arange(300)
    for trial in (1, 2, 3, 4):
        flow = np.repeat(random.uniform(2e-5, 2e-4, 10), 30)
        states = [np.array([random.uniform(200, 700), random.uniform(100, 400)])]
        for now in flow[:-1]:
            run = solve_ivp(
                lambda t, c, f: [f / V * (CF - c[0]) - K1 * c[0], -f / V * c[1] + K1 * c[0] - K2 * c[1]],
                (0.0, 10.0),
                states[-1],
                args=(now,),
                rtol=1e-9,
            )
            states.append(run.y[:, -1])
        shown = np.array(states) + 4.0 * random.standard_normal((len(time), 2))
        rows = np.column_stack([time, flow, shown])
        np.savetxt(folder / f"trial_{trial}.csv", rows, delimiter=",", header="time,F,cA,cB", comments="", fmt="%.9g")
    return folder


def test_four_parameters_that_err_by_a_few_percent_are_no_sensor_no_memory_and_no_formula(
    vessel: Path, tmp_path: Path
) -> None:
    model = find_modelica_model(f"{vessel / 'Vessel.mo'}:Vessel")
    found = discover(model, load_measurements(vessel), tmp_path / "out", workers=1)
    assert {effect.id for effect in found.diagnosis.effects} == {"parameter_error"}
    assert all(abs(effect.parameters["share"].value) < 0.05 for effect in found.diagnosis.effects)
    assert found.diagnosis.held_out.reducible_removed > 0.95
    assert not found.laws
