"""An answer tells that something is left where one balance is explained and another one is not."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from fmus.catalogue import find_modelica_model
from orchestrator.greybox.diagnose import diagnose_greybox
from orchestrator.greybox.thresholds import Thresholds
from orchestrator.measurements import load_measurements
from tests.three_trials import three_trials

MODEL = """model Warmed "A slide, and a body that is heated beside it"
  parameter Real m(unit="kg") = 2, k(unit="N/m") = 30, C(unit="J/K") = 40;
  input Real F(unit="N"), P(unit="W");
  output Real x(unit="m", start=0, fixed=true), T(unit="K", start=300, fixed=true);
  Real v(unit="m/s", start=0, fixed=true);
equation
  der(x) = v;
  m*der(v) = F - k*x;
  C*der(T) = P;
end Warmed;
"""
UNITS = {"F": "N", "P": "W", "x": "m", "T": "K"}


def test_an_effect_that_explains_one_balance_alone_leaves_the_other_one(tmp_path: Path) -> None:
    random = np.random.default_rng(3)
    (tmp_path / "Warmed.mo").write_text(MODEL)
    (tmp_path / "case.toml").write_text(three_trials(UNITS) + '[interpolation]\nF = "linear"\nP = "linear"\n')
    t = 0.02 * np.arange(400)
    for trial in (1, 2, 3):
        force, power = 3 * np.sin(3 * t + trial) + 2 * np.sin(7.1 * t), 60 * np.sin(1.5 * t + trial)
        run = solve_ivp(
            lambda at, y, force=force, power=power, trial=trial: [
                y[1],
                (np.interp(at, t, force) - 30 * y[0] - 1.2 * y[1]) / 2,
                (np.interp(at, t, power) + 6 * np.sin(2.3 * at + 2 * trial)) / 40,
            ],
            (0, t[-1]),
            [0, 0, 300],
            t_eval=t,
            rtol=1e-8,
            max_step=0.02,
        )
        x, T = run.y[0] + 1e-4 * random.standard_normal(400), run.y[2] + 0.01 * random.standard_normal(400)
        table = np.column_stack([t, force, power, x, T])
        np.savetxt(tmp_path / f"trial_{trial}.csv", table, fmt="%.8g", delimiter=",", header="t,F,P,x,T", comments="")
    source = find_modelica_model(f"{tmp_path / 'Warmed.mo'}:Warmed")
    found = diagnose_greybox(
        source, load_measurements(tmp_path), workers=1, limits=replace(Thresholds(), most_effects=1, largest_set=1)
    )
    assert [effect.id for effect in found.effects] == ["viscous_friction"]
    assert found.verdict == "named" and found.incomplete
    assert found.unexplained_share is not None and found.unexplained_share < Thresholds().complete_share
