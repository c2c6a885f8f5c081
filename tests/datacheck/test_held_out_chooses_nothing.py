"""Held-out trials are for the last score: nothing that a comparison or a check of the data chooses depends on them."""

import json
import math
from collections.abc import Callable
from pathlib import Path

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


@pytest.mark.parametrize("changed", [degrees, mirrored, noisy])
def test_floor_learning_errors_and_places_of_failure_come_from_learning_trials_alone(
    tmp_path: Path, changed: Callable[[Columns], Columns]
) -> None:
    model = load_model("drive")
    one, other = (
        compare(model, recorded(tmp_path / name, last, dict)).to_json()
        for name, last in (("good", dict), ("bad", changed))
    )
    for key in ("noise_floor", "learning", "where", "findings", "noise_estimates"):
        assert json.dumps(one[key]) == json.dumps(other[key]), key
    assert one["held_out"] != other["held_out"]


@pytest.mark.parametrize("changed", [mirrored, noisy])
def test_strong_findings_and_mends_come_from_learning_trials_alone(
    tmp_path: Path, changed: Callable[[Columns], Columns]
) -> None:
    model = load_model("drive")
    good, bad = (recorded(tmp_path / name, last, degrees) for name, last in (("good", dict), ("bad", changed)))
    strong = [[f.to_json() for f in check_data(model, each) if f.strong] for each in (good, bad)]
    assert strong[0] == strong[1]
    assert strong[0]
    assert [f.change for f in mend(model, good).done] == [f.change for f in mend(model, bad).done if f.strong]
    assert with_interpolation(model, good).interpolation == with_interpolation(model, bad).interpolation
