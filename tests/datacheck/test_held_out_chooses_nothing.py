"""Held-out trials are for the last score: nothing that a comparison or a check of the data chooses depends on them."""

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from orchestrator.compare.comparison import compare
from orchestrator.datacheck.check import check_data, mend
from orchestrator.datacheck.holding import with_interpolation
from orchestrator.measurements import MeasurementSet, load_measurements
from orchestrator.model_argument import load_model
from tests.datacheck.records import drive, write_case

Columns = dict[str, np.ndarray]
UNITS = {"torque": "N.m", "phi": "rad"}
HELD_OUT = 5


def degrees(columns: Columns) -> Columns:
    return {**columns, "phi": columns["phi"] * 180 / math.pi}


def mirrored(columns: Columns) -> Columns:
    return {**columns, "torque": -columns["torque"]}


def noisy(columns: Columns) -> Columns:
    random = np.random.default_rng(9)
    return {**columns, "phi": columns["phi"] + 0.3 * random.normal(size=len(columns["phi"]))}


def recorded(folder: Path, last: Callable[[Columns], Columns], all_: Callable[[Columns], Columns]) -> MeasurementSet:
    def spoil(columns: Columns, number: int) -> Columns:
        return last(all_(columns)) if number == HELD_OUT else all_(columns)

    return load_measurements(write_case(folder, lambda k: drive(k, friction=0.005), UNITS, spoil, trials=HELD_OUT))


@pytest.fixture(scope="module")
def one(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """The comparison of good records."""
    return compare(load_model("drive"), recorded(tmp_path_factory.mktemp("good"), dict, dict)).to_json()


@pytest.mark.parametrize("changed", [degrees, mirrored, noisy])
def test_floor_learning_errors_and_places_of_failure_come_from_learning_trials_alone(
    tmp_path: Path, one: dict[str, Any], changed: Callable[[Columns], Columns]
) -> None:
    other = compare(load_model("drive"), recorded(tmp_path, changed, dict)).to_json()
    for key in ("noise_floor", "learning", "where", "findings", "noise_estimates"):
        assert json.dumps(one[key]) == json.dumps(other[key]), key
    assert one["held_out"] != other["held_out"]


def found(measurements: MeasurementSet) -> tuple[list[Any], list[Any], Any]:
    """Strong findings, strong changes that mend them, and how inputs are taken to run between samples."""
    model = load_model("drive")
    strong = [finding.to_json() for finding in check_data(model, measurements) if finding.strong]
    mends = [finding.change for finding in mend(model, measurements).done if finding.strong]
    return strong, mends, with_interpolation(model, measurements).interpolation


@pytest.fixture(scope="module")
def in_degrees(tmp_path_factory: pytest.TempPathFactory) -> tuple[list[Any], list[Any], Any]:
    """What is found in records in degrees whose held-out trial is good."""
    return found(recorded(tmp_path_factory.mktemp("degrees"), dict, degrees))


@pytest.mark.parametrize("changed", [mirrored, noisy])
def test_strong_findings_and_mends_come_from_learning_trials_alone(
    tmp_path: Path, in_degrees: tuple[list[Any], list[Any], Any], changed: Callable[[Columns], Columns]
) -> None:
    assert in_degrees[0] and in_degrees[1]
    assert found(recorded(tmp_path, changed, degrees)) == in_degrees
