"""Wrong gains and late sensors beside each other: none of them hides the others, and no drift stands for them."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fmus.catalogue import find_modelica_model
from orchestrator.diagnose import diagnose
from orchestrator.measurements import load_measurements
from orchestrator.verdicts.result import Diagnosis

BOARD = """model Board "Two heaters on a board, each in a balance of its own"
  parameter Real C(unit="J/K") = 2;
  parameter Real UA(unit="W/K") = 0.012;
  parameter Real a1(unit="W") = 1.0, a2(unit="W") = 0.75 "at full power";
  parameter Real Tamb(unit="K") = 294.15;
  input Real Q1(unit="1"), Q2(unit="1") "share of full power";
  output Real T1(unit="K", start=294.15, fixed=true), T2(unit="K", start=294.15, fixed=true);
equation
  C*der(T1) = a1*Q1 - UA*(T1 - Tamb);
  C*der(T2) = a2*Q2 - UA*(T2 - Tamb);
end Board;
"""
CASE = """files = ["trial_1.csv", "trial_2.csv"]
learning = [1]
held_out = [2]
[columns]
time = "s"
Q1 = "1"
Q2 = "1"
T1 = "K"
T2 = "K"
[interpolation]
Q1 = "hold"
Q2 = "hold"
"""
POWERS, LAG, PATH, AMBIENT = (0.72, 0.45), 20.0, 0.005, 294.15


def board(t: float, x: np.ndarray, powers: np.ndarray) -> list[float]:
    """Rates of two temperatures and of what their sensors show."""
    over, shown = x[:2], x[2:]
    path = PATH * (over[1] - over[0])
    heat = np.array(POWERS) * powers - 0.012 * (over - AMBIENT) + np.array([path, -path])
    return [*(heat / 2.0), *((over - shown) / LAG)]


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Diagnosis:
    folder, random = tmp_path_factory.mktemp("board"), np.random.default_rng(8)
    (folder / "Board.mo").write_text(BOARD)
    (folder / "case.toml").write_text(CASE)
    time = np.arange(600.0)
    for trial in (1, 2):
        powers = np.column_stack([np.repeat(random.choice([0.0, 0.3, 0.7, 1.0], 6), 100) for _ in range(2)])
        states = [np.full(4, AMBIENT)]
        for now in powers[:-1]:
            states.append(solve_ivp(board, (0.0, 1.0), states[-1], args=(now,), rtol=1e-8).y[:, -1])
        shown = np.array(states)[:, 2:] + 0.05 * random.standard_normal((len(time), 2))
        rows = np.column_stack([time, powers, shown])
        np.savetxt(
            folder / f"trial_{trial}.csv", rows, delimiter=",", header="time,Q1,Q2,T1,T2", comments="", fmt="%.9g"
        )
    return diagnose(find_modelica_model(f"{folder / 'Board.mo'}:Board"), load_measurements(folder), workers=1)


def test_both_sensors_are_late_by_what_they_are_late(found: Diagnosis) -> None:
    late = {effect.site: effect.parameters["T"].value for effect in found.effects if effect.id == "sensor_lag"}
    assert late == {"sensor:T1": pytest.approx(LAG, rel=0.15), "sensor:T2": pytest.approx(LAG, rel=0.15)}


def test_both_heaters_are_weaker_by_what_they_are(found: Diagnosis) -> None:
    gains = {
        effect.site: effect.parameters for effect in found.effects if effect.id in ("input_gain", "parameter_error")
    }
    shares = {
        site[-1]: next(iter(each.values())).value for site, each in gains.items() if site in ("Q1", "Q2", "a1", "a2")
    }
    assert shares == {"1": pytest.approx(-0.28, abs=0.03), "2": pytest.approx(-0.40, abs=0.03)}


def test_no_drift_stands_for_what_is_missing(found: Diagnosis) -> None:
    assert not [effect.id for effect in found.effects if "drift" in effect.id]
    assert found.held_out.reducible_removed > 0.9
