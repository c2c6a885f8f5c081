"""Jacobians of an FMU along a run are those of its equations, asked for or by differences."""

import zipfile
from pathlib import Path

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from fmus.package import build_fmu
from orchestrator.blackbox.fmu_file import FmuFile

J_MOTOR, J_LOAD, K, D = 0.002, 0.005, 20.0, 0.01
TIME = np.arange(50) * 0.004


@pytest.fixture(scope="module")
def fmus(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Two masses on a shaft, by version of FMI; `sources`: one of FMI 3.0 without a binary for any machine."""
    system, folder = find_modelica_model("two-mass").compile(), tmp_path_factory.mktemp("fmus")
    made = {v: build_fmu(system, folder / f"box{v[0]}.fmu", fmi_version=v) for v in ("2.0", "3.0")}
    with zipfile.ZipFile(made["3.0"]) as whole, zipfile.ZipFile(folder / "sources.fmu", "w") as rest:
        for name in whole.namelist():
            if not name.startswith("binaries/"):
                rest.writestr(name, whole.read(name))
    return made | {"sources": folder / "sources.fmu"}


# That a component of a coupled system is compiled from its sources is tested in tests/cosim, each time.
SOURCES = pytest.param("sources", True, marks=pytest.mark.slow)


@pytest.mark.parametrize(("box", "asked"), [("2.0", True), ("2.0", False), ("3.0", True), ("3.0", False), SOURCES])
def test_jacobians_of_two_masses_on_a_shaft_follow_from_newtons_law(
    box: str, asked: bool, fmus: dict[str, Path]
) -> None:
    """J1 w1' = u - k (p1 - p2) - d (w1 - w2), J2 w2' = k (p1 - p2) + d (w1 - w2); states p1, p2, w1, w2; outputs p1, p2."""
    fmu = FmuFile(fmus[box])
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
