"""The force that an FMU lacks along a measured motion is that which was left out of it."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fmus.catalogue import find_modelica_model
from fmus.package import build_fmu
from orchestrator.blackbox.forces import missing_forces
from orchestrator.blackbox.source import FmuSource
from orchestrator.diagnosis.advise.unexplained import where_forces_lack
from orchestrator.diagnosis.fit.evidence import LearningData
from orchestrator.measurements import load_measurements
from orchestrator.models.smoothing import SmoothedTrial

M, A, INERTIA, G = 0.147585, 0.147755, 1.0912e-4, 9.81001
TIME = np.arange(0, 5, 0.004)
DRAG = 2e-4


def swings(folder: Path) -> Path:
    """Two swings with friction in proportion to speed, integrated here, with 0.05 mrad of noise."""
    folder.mkdir()
    random = np.random.default_rng(3)

    def slope(t: float, x: np.ndarray) -> list[float]:
        return [x[1], (M * G * A * np.sin(x[0]) - DRAG * x[1]) / (INERTIA + M * A**2)]

    for k, first in enumerate((1.2, 2.2)):
        theta = solve_ivp(slope, (0, TIME[-1]), [first, 0.0], t_eval=TIME, rtol=1e-9, atol=1e-10).y[0]
        table = np.column_stack([TIME, theta + 5e-5 * random.standard_normal(len(TIME))])
        np.savetxt(folder / f"trial_{k}.csv", table, delimiter=",", header="time,theta", comments="")
    (folder / "case.toml").write_text(
        'files = ["trial_0.csv", "trial_1.csv"]\nlearning = [1]\nheld_out = [2]\n'
        '[columns]\ntime = "s"\ntheta = "rad"\n[sensors]\nencoder_noise_std_rad = 5e-5\n'
    )
    return folder


@pytest.mark.parametrize(("fmi_version", "stepped"), [("2.0", False), ("3.0", False), ("2.0", True)])
def test_friction_left_out_of_a_pendulum_is_the_missing_torque(fmi_version: str, stepped: bool, tmp_path: Path) -> None:
    box = build_fmu(find_modelica_model("pendulum").compile(), tmp_path / "box.fmu", fmi_version=fmi_version)
    data = load_measurements(swings(tmp_path / "data"))
    source = FmuSource.prepare(box, data, stepped=stepped)
    trials = [t.time for t in data.trials]
    noise = np.array([5e-5])
    smooth = [
        SmoothedTrial(time, np.zeros((len(time), 1)), np.asarray(t.columns["theta"])[:, None], noise)
        for time, t in zip(trials, data.trials, strict=True)
    ]
    model = source.model(source.compile(), ("theta",))

    found = missing_forces(model, smooth)
    rows, sentences = where_forces_lack(model, LearningData(tuple(smooth), noise))
    source.fmu.close()

    if stepped:  # nothing is said of an FMU that does not show its rates
        assert (found, rows, sentences) == ([], [], ())
        return
    ((name, unit, series),) = found
    assert (name, unit) == ("theta", "N.m")
    speed = np.concatenate([t.smoother.thin(t.speeds)[:, 0] for t in smooth])
    slope = np.polyfit(speed, np.concatenate(series), 1)[0]
    assert slope == pytest.approx(-DRAG, rel=0.02)
    assert "speed of theta" in sentences[0]
    assert {row["force_unit"] for row in rows} == {"N.m"}
