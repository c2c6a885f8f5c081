"""What drives two FMUs in the swap view: movements in the units of each, and recorded ones."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from fmus.errors import MisfitError
from orchestrator.cosim.built import built_fmu
from orchestrator.cosim.component import Port
from orchestrator.studio.project import Project
from orchestrator.studio.swap_drive import RECORDED, converted, recorded
from orchestrator.studio.swap_task import RECORDING, RESULT, swap

MODEL = """model {name} "Follows its input"
  parameter Real k(unit="1/s") = 1.0;
  input Real u(unit="{unit}", start=0);
  output Real x(unit="m", start=0, fixed=true);
equation
  der(x) = {factor}*u - k*x;
end {name};
"""


@pytest.fixture(scope="module")
def fmus(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The same law with its input in m/s and in mm/s."""
    folder = tmp_path_factory.mktemp("fmus")
    found = {}
    for side, name, unit, factor in (("old", "Metre", "m/s", "1.0"), ("new", "Milli", "mm/s", "0.001")):
        file = folder / f"{name}.mo"
        file.write_text(MODEL.format(name=name, unit=unit, factor=factor))
        found[side] = built_fmu(f"{file}:{name}")
    return found


@pytest.fixture
def project(fmus: dict[str, Path], tmp_path: Path) -> Project:
    """A comparison of the two."""
    made = Project(tmp_path / "swap")
    for side, fmu in fmus.items():
        (made.folder / side).mkdir(parents=True)
        shutil.copy(fmu, made.folder / side / f"{side}.fmu")
    made.change(name="swap")
    return made


def compared(project: Project, **settings: object) -> dict:
    project.change(**settings)
    swap(project, lambda message: None)
    found = project.result(RESULT)
    assert found is not None
    return found


def test_an_input_in_another_unit_is_moved_alike(project: Project) -> None:
    found = compared(project, stop=2.0)
    (signal,), (curve,) = found["signals"], found["curves"]  # the input itself is no output that agrees
    assert signal["name"] == "x" and signal["parted_at"] is None and np.ptp(curve["old"]) > 0.05


def test_recorded_inputs_drive_both_for_as_long_as_they_last(project: Project) -> None:
    (project.folder / RECORDING).mkdir()
    time = np.linspace(5.0, 8.0, 31)
    rows = "\n".join(f"{t},{np.sin(t - 5.0)}" for t in time)
    (project.folder / RECORDING / "recorded.csv").write_text(f"time,plant.u\n{rows}\n")

    found = compared(project, drive=RECORDED)

    (signal,) = found["signals"]
    assert found["driven"] == ["u"] and found["stop"] == pytest.approx(3.0) and signal["parted_at"] is None
    # x' = sin t - x from 0: (sin t - cos t + exp(-t)) / 2
    (curve,) = found["curves"]
    exact = 0.5 * (np.sin(curve["time"]) - np.cos(curve["time"]) + np.exp(-np.array(curve["time"])))
    assert np.max(np.abs(np.array(curve["old"]) - exact)) < 2e-3


def test_what_is_missing_is_told(project: Project) -> None:
    with pytest.raises(MisfitError, match="no recorded inputs are there; drop in a file with a column time"):
        compared(project, drive=RECORDED)
    file = project.folder / "other.csv"
    file.write_text("time,speed\n0,1\n1,2\n")
    with pytest.raises(MisfitError, match="other.csv has no column named like an input; expected .* some of: u"):
        recorded([Port("u", "input")], file)


def test_waves_are_converted_with_their_zero() -> None:
    assert converted({"kind": "sine", "amplitude": 2.0, "frequency": 1.0}, 1.0, 273.15)["offset"] == 273.15
    assert converted({"kind": "step", "at": 1.0, "to": 1.0}, 1000.0, 0.0) == {
        "kind": "step",
        "at": 1.0,
        "from": 0.0,
        "to": 1000.0,
    }
    assert converted({"kind": "table", "times": [0.0], "values": [1.0]}, 2.0, 1.0)["values"] == [3.0]
