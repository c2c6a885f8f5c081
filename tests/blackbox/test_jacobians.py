"""Jacobians of an FMU along a run are those of its equations, asked for or by differences."""

from pathlib import Path

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from fmus.package import build_fmu
from orchestrator.blackbox.fmu_file import FmuFile

J_MOTOR, J_LOAD, K, D = 0.002, 0.005, 20.0, 0.01
TIME = np.arange(50) * 0.004


@pytest.mark.parametrize("fmi_version", ["2.0", "3.0"])
@pytest.mark.parametrize("asked", [True, False])
def test_jacobians_of_two_masses_on_a_shaft_follow_from_newtons_law(
    fmi_version: str, asked: bool, tmp_path: Path
) -> None:
    """J1 w1' = u - k (p1 - p2) - d (w1 - w2), J2 w2' = k (p1 - p2) + d (w1 - w2); states p1, p2, w1, w2; outputs p1, p2."""
    fmu = FmuFile(build_fmu(find_modelica_model("two-mass").compile(), tmp_path / "box.fmu", fmi_version=fmi_version))
    assert fmu.description.directional
    if not asked:
        object.__setattr__(fmu.description, "directional", False)
    inputs = np.zeros((len(TIME), len(fmu.description.inputs)))
    inputs[:, 0] = 0.1 * np.sin(3 * TIME)

    found = fmu.jacobians(TIME, inputs, np.array([0.1, 0.0, 0.0, 0.0]), 2)

    fmu.close()
    assert [p.name for p in fmu.description.inputs] == ["torque", "correction_phiMotor", "correction_phiLoad"]
    shaft = np.array([-K, K, -D, D])
    by_states = np.array([[0, 0, 1, 0], [0, 0, 0, 1], shaft / J_MOTOR, -shaft / J_LOAD, [1, 0, 0, 0], [0, 1, 0, 0]])
    by_inputs = np.zeros((6, 3))
    by_inputs[2, :2], by_inputs[3, 2] = 1 / J_MOTOR, 1 / J_LOAD
    expected = np.tile(np.column_stack([by_states, by_inputs]), (len(TIME), 1, 1))
    # Differences over steps of 1e-6 of linear equations lose to rounding only.
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-4)
