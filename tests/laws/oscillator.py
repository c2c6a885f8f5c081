"""A mass on a spring whose missing force is known: the model as a user writes it, and records from scipy's integrator."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from fmus.catalogue import ModelicaModel, find_modelica_model
from tests.three_trials import three_trials

MODEL = """model Mass "A mass on a spring under a force"
  parameter Real m(unit="kg") = 2.0;
  parameter Real k(unit="N/m") = 30.0;
  input Real F(unit="N");
  output Real x(unit="m", start=0, fixed=true);
  Real v(unit="m/s", start=0, fixed=true);
equation
  der(x) = v;
  m*der(v) = F - k*x;
end Mass;
"""
CASE = three_trials({"F": "N", "x": "m"}, "abc")


def recorded(
    folder: Path,
    force: Callable[[float, float, float], float],
    *,
    push: Callable[[float, float], float] = lambda t, net: 0.0,
    noise: float = 2e-5,
    seed: int = 0,
    n: int = 400,
) -> ModelicaModel:
    """Write three trials of the mass with a further force of time, position and speed, and a `push` of time and all else that
    pushes; its model without them."""
    random = np.random.default_rng(seed)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "Mass.mo").write_text(MODEL)
    (folder / "case.toml").write_text(CASE)
    time = 0.015 * np.arange(n)
    for name in "abc":
        waves = list(zip(random.uniform(0.2, 3.0, 4), random.uniform(0, 6.28, 4), strict=True))
        pushed = sum(3.0 * np.sin(2 * np.pi * f * time + p) for f, p in waves)

        def rates(t: float, y: np.ndarray, pushed: np.ndarray = pushed) -> list[float]:
            net = float(np.interp(t, time, pushed)) - 30.0 * y[0]
            return [y[1], (net + force(t, y[0], y[1]) + push(t, net)) / 2.0]

        run = solve_ivp(rates, (0, time[-1]), [0.0, 0.0], t_eval=time, rtol=1e-8, atol=1e-10, max_step=0.01)
        rows = np.column_stack([time, pushed, run.y[0] + noise * random.standard_normal(n)])
        np.savetxt(folder / f"{name}.csv", rows, delimiter=",", header="t,F,x", comments="", fmt="%.9g")
    return find_modelica_model(f"{folder / 'Mass.mo'}:Mass")
