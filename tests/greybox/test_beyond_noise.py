"""Thresholds of an input are above the noise of its sensor, which a narrow dead zone would take away."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fmus.catalogue import find_modelica_model
from fmus.symbolic.system import Variable
from orchestrator.greybox.candidates import Candidate, candidates_at
from orchestrator.greybox.diagnose import diagnose_greybox
from orchestrator.greybox.laws import laws
from orchestrator.greybox.places import Seen, input_places
from orchestrator.measurements import load_measurements
from tests.three_trials import three_trials

MODEL = """model Sled
  parameter Real m(unit="kg") = 2.0;
  parameter Real k(unit="N/m") = 30;
  parameter Real d(unit="N.s/m") = 1.5;
  input Real F(unit="N");
  output Real x(unit="m", start=0, fixed=true);
  Real v(unit="m/s", start=0, fixed=true);
equation
  der(x) = v;
  m*der(v) = F - k*x - d*v;
end Sled;
"""


def zones(noise: float) -> list[Candidate]:
    """Dead zones of a force between -2 and 2 N."""
    seen = Seen({"F": np.linspace(-2, 2, 101), "time": np.linspace(0, 1, 101)}, {})
    places = input_places([Variable("F", unit="N")], seen, {"F": noise})
    return candidates_at(places, [law for law in laws() if law.id == "dead_zone"])


@pytest.mark.parametrize("noise", [0.01, 0.05, 0.1, 0.15])
def test_no_dead_zone_is_narrower_than_three_deviations_of_the_noise(noise: float) -> None:
    found = zones(noise)
    (width,) = found[0].fitted_shapes
    assert found[0].limits(width)[0] == pytest.approx(3 * noise)
    assert all(c.shapes["width"] >= 3 * noise for c in found)
    assert len(found) == sum(share * 4 / np.sqrt(12) * 1.01 > 3 * noise for share in (0.05, 0.15, 0.4))


def test_noise_of_a_force_that_rests_half_of_the_time_is_no_effect(tmp_path: Path) -> None:
    random, t = np.random.default_rng(3), np.arange(0, 8, 0.01)
    (tmp_path / "Sled.mo").write_text(MODEL)
    for trial in range(3):
        bumps = list(zip(random.uniform(-6, 6, 3), np.sort(random.uniform(0.5, 7.5, 3)), strict=True))

        def force(s: float | np.ndarray, bumps: list[tuple[float, float]] = bumps) -> float | np.ndarray:
            return sum(a * np.exp(-(((s - c) / 0.3) ** 2)) for a, c in bumps)

        run = solve_ivp(
            lambda s, y: [y[1], (force(s) - 30 * y[0] - 1.5 * y[1]) / 2],
            (0, t[-1]),
            [0, 0],
            t_eval=t,
            rtol=1e-9,
            max_step=0.02,
        )
        shown = force(t) + 0.05 * random.standard_normal(len(t)), run.y[0] + 2e-4 * random.standard_normal(len(t))
        table = np.column_stack([t, *shown])
        np.savetxt(tmp_path / f"t{trial}.csv", table, fmt="%.8g", delimiter=",", header="t,F,x", comments="")
    case = three_trials({"F": "N", "x": "m"}, files=("t0", "t1", "t2"))
    (tmp_path / "case.toml").write_text(case)
    stages: list[str] = []
    found = diagnose_greybox(
        find_modelica_model(f"{tmp_path / 'Sled.mo'}:Sled"),
        load_measurements(tmp_path),
        workers=1,
        progress=stages.append,
    )
    assert (found.verdict, found.effects) == ("adequate", ())
    # The search asked common effects, and no rare ones of a model that is within the noise.
    assert any("candidates at" in line for line in stages) and not any("rare" in line for line in stages)
