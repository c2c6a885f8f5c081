"""The Modelica library: every class with a known answer gives it, in the built FMU."""

from pathlib import Path

import fmpy
import numpy as np
import pytest

from fmus.catalogue import ModelicaModel
from fmus.library import library_root
from fmus.package import build_fmu

TESTS = [line for line in (library_root() / "FESArm" / "Test" / "package.order").read_text().split() if line]
STOP_S = {
    "ViscousDecay": 2,
    "CoulombStop": 1,
    "PayloadAcceleration": 2,
    "LagOfAStep": 0.3,
    "DelayOfARamp": 0.3,
    "PendulumSmallSwing": 2,
    "PendulumKeepsItsEnergy": 5,
    "DriveUnderConstantTorque": 2,
    "CartKeepsEnergyAndMomentum": 5,
    "DoublePendulumKeepsItsEnergy": 2,
    "TanksKeepTheirWater": 60,
    "TankEmpties": 5,
}


@pytest.mark.parametrize("name", TESTS)
def test_error_variables_of_the_test_models_stay_at_zero(name: str, tmp_path: Path) -> None:
    model = ModelicaModel(name, f"FESArm.Test.{name}")
    fmu = build_fmu(model.compile(), tmp_path / f"{name}.fmu", tolerance=1e-10)

    stop = STOP_S.get(name, 1.0)
    result = fmpy.simulate_fmu(str(fmu), stop_time=stop, step_size=stop / 100, output_interval=stop / 100)

    errors = [column for column in result.dtype.names if column.lower().endswith("error")]
    assert errors
    for column in errors:
        # The integrator's tolerance is 1e-10; 100 steps of it, and the force's smoothing of 1e-6 N, stay below this.
        assert np.abs(result[column]).max() < 2e-6, column
