"""Two sensors that are late alike: the answer is not a late input, which one lag stands for with fewer parameters."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fmus.catalogue import find_modelica_model
from orchestrator.diagnose import diagnose
from orchestrator.greybox.candidates import Candidate
from orchestrator.greybox.diagnose import _is_complete
from orchestrator.greybox.laws import laws
from orchestrator.greybox.places import Place
from orchestrator.greybox.thresholds import Thresholds
from orchestrator.measurements import load_measurements
from tests.three_trials import three_trials

TANKS = """model Cascade "Two tanks, the upper one flows into the lower one by Torricelli's law"
  parameter Real A(unit="m2") = 0.015;
  parameter Real a(unit="m2") = 5e-5;
  constant Real g(unit="m/s2") = 9.81;
  input Real q(unit="m3/s");
  output Real h1(unit="m", start=0.3, fixed=true, min=0.01);
  output Real h2(unit="m", start=0.3, fixed=true, min=0.01);
equation
  A*der(h1) = q - a*sqrt(2*g*h1);
  A*der(h2) = a*sqrt(2*g*h1) - a*sqrt(2*g*h2);
end Cascade;
"""
AREA, OUTLET, LATE = 0.015, 5e-5 * np.sqrt(2 * 9.81), 15.0
TIME = np.arange(300) * 1.0


def levels(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Inflow in m3/s and both readings in m, (n,) and (n, 2), of sensors with a lag of LATE."""
    random = np.random.default_rng(seed)
    inflow = np.interp(TIME, TIME[::30], random.uniform(0.6e-4, 1.8e-4, len(TIME[::30])))

    def rates(t: float, x: np.ndarray) -> list[float]:
        upper, lower = (OUTLET * np.sqrt(max(h, 1e-9)) for h in x[:2])
        q = float(np.interp(t, TIME, inflow))
        return [(q - upper) / AREA, (upper - lower) / AREA, (x[0] - x[2]) / LATE, (x[1] - x[3]) / LATE]

    run = solve_ivp(rates, (0, TIME[-1]), [0.3] * 4, t_eval=TIME, rtol=1e-8, atol=1e-10, max_step=1.0)
    return inflow, run.y[2:].T + 1e-4 * random.normal(size=(len(TIME), 2))


def test_two_late_sensors_are_named_with_their_lag_and_no_late_input(tmp_path: Path) -> None:
    (tmp_path / "Cascade.mo").write_text(TANKS)
    (tmp_path / "case.toml").write_text(three_trials({"q": "m3/s", "h1": "m", "h2": "m"}))
    for trial in (1, 2, 3):
        inflow, readings = levels(seed=trial)
        rows = np.column_stack([TIME, inflow, readings])
        np.savetxt(tmp_path / f"trial_{trial}.csv", rows, delimiter=",", header="t,q,h1,h2", comments="")
    model = find_modelica_model(f"{tmp_path / 'Cascade.mo'}:Cascade")
    found = diagnose(model, load_measurements(str(tmp_path)), workers=1)
    assert found.verdict == "named"
    assert {(e.id, e.site) for e in found.effects} == {("sensor_lag", "sensor:h1"), ("sensor_lag", "sensor:h2")}
    assert [e.parameters["T"].value for e in found.effects] == pytest.approx([LATE, LATE], rel=0.03)


@pytest.mark.parametrize(("outputs", "complete"), [(("T", "T"), False), (("T", "p"), True), (("T",), True)])
def test_one_output_that_answers_several_inputs_late_asks_for_a_late_sensor(
    outputs: tuple[str, ...], complete: bool
) -> None:
    """An evaporator whose refractometer lags by 120 s was named two relaxations, of its steam and of its product, before."""
    law = next(law for law in laws() if law.id == "relaxation")
    candidates = [
        Candidate(law, Place("response", f"u{k}->{y}", "K", {"u": f"u{k}", "y": y})) for k, y in enumerate(outputs)
    ]
    count = sum(len(c.gains) + len(c.fitted_shapes) for c in candidates)
    fit = SimpleNamespace(theta=np.zeros(count), priors=SimpleNamespace(std=np.ones(count)))
    decision: Any = SimpleNamespace(
        grade="named", explained=1.0, chosen=SimpleNamespace(candidates=candidates, fit=fit)
    )
    assert _is_complete(decision, Thresholds()) is complete
