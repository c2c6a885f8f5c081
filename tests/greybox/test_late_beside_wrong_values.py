"""A late sensor beside wrong values: what the values explain at one balance does not hide what the sensor does at another."""

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
POWERS, LOSS, LATE, AMBIENT, STEP = np.array([1.25, 0.6]), 0.013, 18.0, 294.15, 2.0


def rates(t: float, x: np.ndarray, shares: np.ndarray) -> list[float]:
    """Of two temperatures, and of what the sensor of the first one shows."""
    heat = POWERS * shares - LOSS * (x[:2] - AMBIENT)
    return [*(heat / 2.0), (x[0] - x[2]) / LATE]


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Diagnosis:
    folder, random = tmp_path_factory.mktemp("board"), np.random.default_rng(3)
    (folder / "Board.mo").write_text(BOARD)
    (folder / "case.toml").write_text(CASE)
    time = STEP * np.arange(300)
    for trial in (1, 2):
        shares = np.column_stack([np.repeat(random.choice([0.0, 0.3, 0.7, 1.0], 6), 50) for _ in range(2)])
        states = [np.full(3, AMBIENT)]
        for now in shares[:-1]:
            states.append(solve_ivp(rates, (0.0, STEP), states[-1], args=(now,), rtol=1e-8).y[:, -1])
        shown = np.array(states)[:, [2, 1]] + 0.05 * random.standard_normal((len(time), 2))
        rows = np.column_stack([time, shares, shown])
        np.savetxt(
            folder / f"trial_{trial}.csv", rows, delimiter=",", header="time,Q1,Q2,T1,T2", comments="", fmt="%.9g"
        )
    return diagnose(find_modelica_model(f"{folder / 'Board.mo'}:Board"), load_measurements(folder), workers=1)


def test_the_sensor_is_late_by_what_it_is(found: Diagnosis) -> None:
    late = [e.parameters["T"].value for e in found.effects if e.id in ("sensor_lag", "input_lag")]
    # At the sensor or at the input of its balance, which nothing tells apart.
    assert late == [pytest.approx(LATE, rel=0.05)]


def test_nothing_but_noise_is_left(found: Diagnosis) -> None:
    assert found.steps[-1].comparison.held_out.over_floor < 1.2
    assert found.steps[0].comparison.held_out.over_floor > 50
