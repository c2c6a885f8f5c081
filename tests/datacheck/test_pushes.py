"""Wrong columns of machines that are dominated by what their models lack."""

import math
from pathlib import Path

import numpy as np
import pytest

from orchestrator.datacheck.check import check_data
from orchestrator.datacheck.pushes import driven_states
from orchestrator.measurements import load_measurements
from orchestrator.model_argument import load_model
from tests.datacheck.records import drive, write_case

UNITS = {"torque": "N.m", "phi": "rad"}
# Nine tenths of the torque go into friction at the speeds of these records.
FRICTION = 0.3


def test_friction_that_eats_most_of_the_torque_is_no_wrong_column(tmp_path: Path) -> None:
    folder = write_case(tmp_path, lambda k: drive(k, friction=FRICTION), UNITS)
    assert check_data(load_model("drive"), load_measurements(folder)) == ()


@pytest.mark.parametrize(("factor", "meaning"), [(180 / math.pi, "degrees declared as radians"), (1e3, "mrad")])
def test_wrong_units_show_through_friction_that_eats_most_of_the_torque(
    tmp_path: Path, factor: float, meaning: str
) -> None:
    def spoilt(columns: dict[str, np.ndarray], number: int) -> dict[str, np.ndarray]:
        return {**columns, "phi": factor * columns["phi"]}

    folder = write_case(tmp_path, lambda k: drive(k, friction=FRICTION), UNITS, spoilt)
    (finding,) = check_data(load_model("drive"), load_measurements(folder))
    assert finding.kind == "unit"
    assert meaning in finding.evidence


def test_only_speeds_are_pushed_and_not_positions() -> None:
    system = load_model("drive").system  # type: ignore[attr-defined]
    assert [(system.states[k].name, speed) for k, speed in driven_states(system)] == [("w", True)]
