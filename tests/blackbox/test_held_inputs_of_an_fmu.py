"""Inputs of an FMU that were held between samples are held when it runs, in model exchange and stepped."""

from pathlib import Path

import numpy as np
import pytest

from fmus.catalogue import ModelicaModel
from fmus.package import build_fmu
from orchestrator.blackbox.source import FmuSource
from orchestrator.diagnose import diagnose
from orchestrator.measurements import load_measurements

LAG = 0.35  # s
TEXT = f"""model Belt "speed from a voltage"
  parameter Real tau(unit="s") = {LAG};
  input Real u(unit="V");
  output Real v(unit="V", start=0, fixed=true);
equation
  tau*der(v) = u - v;
end Belt;
"""


@pytest.fixture(scope="module")
def belt(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A first-order FMU with three records of held steps, which are solved exactly."""
    folder = tmp_path_factory.mktemp("belt")
    (folder / "Belt.mo").write_text(TEXT)
    build_fmu(ModelicaModel("Belt", "Belt", folder / "Belt.mo").compile(), folder / "belt.fmu")
    time, random = np.arange(300) * 0.05, np.random.default_rng(3)
    for trial in (1, 2, 3):
        u = np.repeat(random.uniform(-5, 5, 20), 15)
        v = _exact(time, u) + 1e-3 * random.standard_normal(300)
        rows = np.column_stack([time, u, v])
        np.savetxt(folder / f"t{trial}.csv", rows, delimiter=",", header="time,u,v", comments="")
    names = 'files = ["t1.csv", "t2.csv", "t3.csv"]\nlearning = [1, 2]\nheld_out = [3]\n'
    (folder / "case.toml").write_text(names + '[columns]\ntime = "s"\nu = "V"\nv = "V"\n')
    return folder


def _exact(time: np.ndarray, u: np.ndarray) -> np.ndarray:
    v = np.zeros(len(time))
    for k, step in enumerate(np.diff(time)):
        v[k + 1] = u[k] + (v[k] - u[k]) * np.exp(-step / LAG)
    return v


@pytest.mark.parametrize("stepped", [False, True])
def test_a_held_input_of_an_fmu_gives_the_exact_answer_to_steps(belt: Path, stepped: bool) -> None:
    source = FmuSource.prepare(belt / "belt.fmu", load_measurements(str(belt)), stepped=stepped)
    model = source.model(source.compile())
    time, u = np.arange(60) * 0.05, np.repeat([0.0, 4.0, -2.0, 1.0], 15)
    found, lines = (m.simulate(time, u[:, None], ["v"], {"v": 0.0})[:, 0] for m in (model.with_held(("u",)), model))
    assert np.max(np.abs(found - _exact(time, u))) < 1e-3
    assert np.max(np.abs(lines - _exact(time, u))) > 0.1


def test_a_right_fmu_is_adequate_although_its_input_jumps(belt: Path) -> None:
    measurements = load_measurements(str(belt))
    found = diagnose(FmuSource.prepare(belt / "belt.fmu", measurements), measurements, workers=1)
    assert found.verdict == "adequate"
    assert found.held_out.rmse_before["v"] < 1.3e-3
