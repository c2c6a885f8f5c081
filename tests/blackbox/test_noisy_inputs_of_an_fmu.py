"""Noise of measured inputs counts for FMUs that can only be stepped: a right model of a drive is no false alarm."""

from pathlib import Path

import numpy as np

from fmus.catalogue import find_modelica_model
from fmus.package import build_fmu
from orchestrator.blackbox.source import FmuSource
from orchestrator.diagnose import diagnose
from orchestrator.measurements import load_measurements
from tests.noisy_drive import described

INERTIA, TORQUE_NOISE, ANGLE_NOISE = 0.02, 2e-3, 1e-4


def test_noise_of_a_torque_is_no_missing_effect_of_a_drive_that_is_stepped(tmp_path: Path) -> None:
    """J phi'' = A sin(w t) gives phi = (A/J) (t/w - sin(w t)/w^2) + speed t + phi(0)."""
    random, time, amplitude = np.random.default_rng(3), np.arange(800) * 0.005, 0.1
    for name, rate in (("a.csv", 3.0), ("b.csv", 2.0), ("c.csv", 4.0)):
        angle = amplitude / INERTIA * (time / rate - np.sin(rate * time) / rate**2) - 1.5 * time + 0.2
        torque = amplitude * np.sin(rate * time) + TORQUE_NOISE * random.normal(size=time.size)
        columns = np.column_stack([time, torque, angle + ANGLE_NOISE * random.normal(size=time.size)])
        np.savetxt(tmp_path / name, columns, delimiter=",", header="time,torque,phi", comments="", fmt="%.12g")
    (tmp_path / "case.toml").write_text(described(ANGLE_NOISE, TORQUE_NOISE))
    box = build_fmu(find_modelica_model("drive").compile(), tmp_path / "box.fmu")
    measurements = load_measurements(tmp_path)
    source = FmuSource.prepare(box, measurements, stepped=True)

    found = diagnose(source, measurements, workers=1)

    source.fmu.close()  # type: ignore[union-attr]
    assert found.verdict == "adequate", found.warnings
    assert found.noise_floor["phi"] > 2 * ANGLE_NOISE
