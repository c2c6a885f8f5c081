"""A bicycle robot that its controller holds up: no free run can follow it, and records begin while it steers."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fmus.catalogue import ModelicaModel
from orchestrator.diagnose import diagnose
from orchestrator.greybox.evidence import all_candidates, case_of, nominal_set
from orchestrator.greybox.laws import laws
from orchestrator.greybox.search import Search
from orchestrator.greybox.thresholds import Thresholds
from orchestrator.measurements import load_measurements
from tests.three_trials import three_trials

BIKE = """model Bike "steered by a servo, at constant speed"
  parameter Real g(unit="m/s2") = 9.81, h(unit="m") = 0.42, b(unit="m") = 0.74, v(unit="m/s") = 2.8;
  input Real delta(unit="rad");
  output Real phi(unit="rad", start=0.03);
  output Real r(unit="rad/s");
  Real p(unit="rad/s", start=0);
equation
  der(phi) = p;
  h*der(p) = g*sin(phi) - v*r*cos(phi);
  r = v/b*tan(delta);
end Bike;
"""
STEP, COUNT = 0.01, 700


def rates(t: float, x: np.ndarray, command: float, lag: float) -> list[float]:
    turn = 2.8 / 0.74 * np.tan(x[2])
    roll = (9.81 * np.sin(x[0]) - 2.8 * turn * np.cos(x[0])) / 0.42
    return [x[1], roll, (command - x[2]) / lag if lag else 0.0]


def record(folder: Path, lag: float) -> Path:
    """Three trials; the servo begins straight, whatever the controller wants of it at the first sample."""
    (folder / "Bike.mo").write_text(BIKE)
    case = three_trials({"delta": "rad", "phi": "rad", "r": "rad/s"})
    (folder / "case.toml").write_text(case + '[interpolation]\ndelta = "hold"\n')
    for trial in (1, 2, 3):
        random = np.random.default_rng(trial)
        wanted, x, rows = np.repeat(random.uniform(-0.12, 0.12, 7), 100), np.array([0.04 + 0.01 * trial, 0.0, 0.0]), []
        for k in range(COUNT):
            command = float(np.clip(1.6 * (x[0] - wanted[k]) + 0.45 * x[1], -0.5, 0.5))
            x[2] = x[2] if lag else command
            rows.append([k * STEP, command, x[0], 2.8 / 0.74 * np.tan(x[2])])
            x = solve_ivp(rates, (0, STEP), x, "LSODA", args=(command, lag), rtol=1e-9, atol=1e-11).y[:, -1]
        noisy = np.array(rows) + [0, 0, 2e-3, 8e-3] * random.standard_normal((COUNT, 4))
        np.savetxt(folder / f"trial_{trial}.csv", noisy, delimiter=",", header="t,delta,phi,r", comments="")
    return folder


def test_a_plant_that_falls_over_is_adequate_although_its_free_runs_go_astray(tmp_path: Path) -> None:
    folder = record(tmp_path, lag=0.0)
    model = ModelicaModel("Bike", "Bike", folder / "Bike.mo")
    found = diagnose(model, load_measurements(str(folder)), workers=1)
    assert found.steps[0].comparison.learning.rmse["phi"] > 1.0
    assert found.verdict == "adequate", found.warnings


def test_a_late_input_is_likelier_than_two_late_sensors_where_a_trial_begins_on_the_move(tmp_path: Path) -> None:
    folder = record(tmp_path, lag=0.08)
    case = case_of(ModelicaModel("Bike", "Bike", folder / "Bike.mo"), load_measurements(str(folder)))
    setting, nominal = nominal_set(case, Thresholds())
    candidates = {c.family: c for c in all_candidates(case, nominal, laws())}
    search = Search(setting, tuple(candidates.values()), nominal, lambda message: None)
    late = search.fit((candidates["input_lag", "delta"],))
    sensors = search.fit((candidates["sensor_lag", "sensor:phi"], candidates["sensor_lag", "sensor:r"]))
    assert late is not None and sensors is not None
    assert late.value(*late.candidates, "T")[0] == pytest.approx(0.08, rel=0.02)
    assert late.loss < sensors.loss - 20
