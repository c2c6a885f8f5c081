"""Where laws at a balance explain a record alike, the answer says which record would tell them apart."""

import re
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from fmus.catalogue import find_modelica_model
from orchestrator.diagnose import diagnose
from orchestrator.measurements import load_measurements
from tests.three_trials import three_trials

SHAFT = """model Shaft "A shaft under the torque of its motor"
  parameter Real J(unit="kg.m2") = 0.02;
  input Real tau(unit="N.m");
  output Real w(unit="rad/s", start=20, fixed=true);
equation
  J*der(w) = tau;
end Shaft;
"""


def test_dry_friction_of_a_shaft_that_turned_one_way_is_told_from_a_constant_torque_by_turning_the_other_way(
    tmp_path: Path,
) -> None:
    (tmp_path / "Shaft.mo").write_text(SHAFT)
    (tmp_path / "case.toml").write_text(three_trials({"tau": "N.m", "w": "rad/s"}))
    random, time = np.random.default_rng(3), np.arange(300) * 0.01
    for trial in (1, 2, 3):
        waves = list(zip(random.uniform(0.3, 1.2, 3), random.uniform(0, 6.28, 3), strict=True))
        tau = 0.2 + 0.03 * sum(np.sin(2 * np.pi * f * time + p) for f, p in waves)

        def rate(t: float, w: np.ndarray, tau: np.ndarray = tau) -> np.ndarray:
            return np.asarray((np.interp(t, time, tau) - 0.2 * np.sign(w)) / 0.02)

        w = solve_ivp(rate, (0, time[-1]), [20.0], max_step=0.01, rtol=1e-8, t_eval=time).y[0]
        rows = np.column_stack([time, tau, w + 0.02 * random.standard_normal(len(time))])
        np.savetxt(tmp_path / f"trial_{trial}.csv", rows, "%.9g", ",", header="t,tau,w", comments="")

    found = diagnose(find_modelica_model(f"{tmp_path / 'Shaft.mo'}:Shaft"), load_measurements(tmp_path), workers=1)

    assert found.verdict == "ambiguous"
    assert found.next_experiment is not None
    proposed = re.search(r"w = (-[\d.]+) rad/s: there it is (\S+) against (\S+) N.m", found.next_experiment["do"])
    assert proposed is not None and float(proposed[1]) < 0
    assert {round(float(proposed[2]), 2), round(float(proposed[3]), 2)} == {-0.2, 0.2}
