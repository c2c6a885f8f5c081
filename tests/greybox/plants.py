"""Plants for tests of the grey box: models as users write them, and records from a simulation that shares nothing with it."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from fmus.catalogue import find_modelica_model
from orchestrator.diagnose import diagnose
from orchestrator.measurements import load_measurements
from orchestrator.verdicts.result import Diagnosis
from tests.three_trials import three_trials

SLIDE = """model Slide "A mass on a spring under a force"
  parameter Real m(unit="kg") = 2.0;
  parameter Real k(unit="N/m") = 30.0;
  input Real F(unit="N");
  output Real x(unit="m", start=0, fixed=true);
  Real v(unit="m/s", start=0, fixed=true);
equation
  der(x) = v;
  m*der(v) = F - k*x;
end Slide;
"""
CASE = three_trials({"F": "N", "x": "m"})
STRAIGHT = three_trials({"F": "N", "x": "m"}, straight="F")


def slide_record(
    folder: Path,
    extra: Callable[[float, float], float],
    *,
    dahl: tuple[float, float] | None = None,
    sensor: Callable[[np.ndarray], np.ndarray] = lambda x: x,
    noise: float = 2e-5,
    seed: int = 0,
    samples: int = 400,
    said: bool = False,
    constant: int = 0,
) -> Path:
    """Three records of `samples` of the mass with a further force of position and speed; `folder` also holds the model.

    `dahl` is the friction of Dahl's model (1968), fully developed, in N, and the way over which 63 % of it develops, in m.
    `sensor` makes of positions what is recorded. Where it is `said`, the case file tells that the force runs in straight lines
    between samples, so that no diagnosis asks. In the trial of number `constant` the force stays at 3 N.
    """
    friction, way = dahl or (0.0, 1.0)
    random = np.random.default_rng(seed)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "Slide.mo").write_text(SLIDE)
    (folder / "case.toml").write_text(STRAIGHT if said else CASE)
    step, parts = 0.01, 20
    for trial in (1, 2, 3):
        t = np.arange(samples) * step
        waves = zip(random.uniform(0.2, 3.0, 4), random.uniform(0, 6.28, 4), strict=True)
        force = sum(3.0 * np.sin(2 * np.pi * f * t + p) for f, p in waves)
        force = np.full(samples, 3.0) if trial == constant else force
        state, x = np.zeros(3), []
        for i in range(len(t)):
            x.append(state[0])
            rise = (force[min(i + 1, len(t) - 1)] - force[i]) / step

            def rate(at: float, y: np.ndarray, begin: float = float(force[i]), rise: float = float(rise)) -> np.ndarray:
                sum_of_forces = begin + rise * at - 30.0 * y[0] + extra(y[0], y[1]) - friction * y[2]
                return np.array([y[1], sum_of_forces / 2.0, (y[1] - abs(y[1]) * y[2]) / way])

            for j in range(parts):
                state = _heun(rate, j * step / parts, state, step / parts)
        rows = np.column_stack([t, force, sensor(np.array(x)) + noise * random.standard_normal(len(t))])
        np.savetxt(folder / f"trial_{trial}.csv", rows, delimiter=",", header="t,F,x", comments="", fmt="%.9g")
    return folder


def diagnosed(folder: Path) -> Diagnosis:
    """The diagnosis of the slide in a folder, along its records."""
    return diagnose(find_modelica_model(f"{folder / 'Slide.mo'}:Slide"), load_measurements(str(folder)), workers=1)


def _heun(rate: Callable[[float, np.ndarray], np.ndarray], at: float, state: np.ndarray, step: float) -> np.ndarray:
    """One step of Heun's method."""
    first = rate(at, state)
    return state + 0.5 * step * (first + rate(at + step, state + step * first))
