"""Inputs of a model that no column is."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from orchestrator.datacheck.check import check_data
from orchestrator.datacheck.findings import Finding
from orchestrator.diagnose import diagnose
from orchestrator.measurements import load_measurements
from orchestrator.model_argument import load_model, load_source
from tests.datacheck.records import drive, write_case

Columns = dict[str, np.ndarray]


def found_in(folder: Path, spoil: Callable[[Columns, int], Columns]) -> tuple[Finding, ...]:
    units = {"motor": "N.m", "phi": "rad"}
    write_case(folder, lambda seed: drive(seed, friction=0.005), units, spoil, trials=3)
    return check_data(load_model("drive"), load_measurements(folder))


def renamed(columns: Columns, number: int) -> Columns:
    return {("motor" if name == "torque" else name): values for name, values in columns.items()}


def test_a_model_that_no_column_drives_gets_no_physics_but_the_column_that_may_be_the_input(tmp_path: Path) -> None:
    (finding,) = found_in(tmp_path, renamed)
    assert (finding.kind, finding.column, finding.strong) == ("input", "torque", True)
    assert "'motor'" in finding.proposal
    data = load_measurements(tmp_path)
    assert diagnose(load_source("drive", data), data).verdict == "cannot_tell"


def test_a_trial_without_a_push_and_without_other_columns_needs_no_input(tmp_path: Path) -> None:
    def at_rest(columns: Columns, number: int) -> Columns:
        return renamed({**columns, "torque": np.zeros_like(columns["torque"])}, number)

    assert not [finding for finding in found_in(tmp_path, at_rest) if finding.kind == "input"]


def test_a_shipped_pendulum_that_has_no_input_of_its_own_is_not_asked_for_one() -> None:
    data = load_measurements("tests/cases/pendulum")

    assert not [finding for finding in check_data(load_model("pendulum"), data) if finding.kind == "input"]
