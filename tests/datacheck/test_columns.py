"""Wrong columns are found by what the model predicts with and without a change; physics is not named for them."""

import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from orchestrator.cli.main import misfit
from orchestrator.datacheck.check import check_data, mend
from orchestrator.datacheck.findings import Finding
from orchestrator.measurements import load_measurements
from orchestrator.model_argument import load_model
from tests.datacheck.records import drive, pendulum, write_case

Spoil = Callable[[dict[str, np.ndarray], int], dict[str, np.ndarray]]
DRIVE, PENDULUM = {"torque": "N.m", "phi": "rad"}, {"theta": "rad"}


def times(column: str, factor: float) -> Spoil:
    return lambda columns, number: {**columns, column: factor * columns[column]}


def plus(column: str, offset: float) -> Spoil:
    return lambda columns, number: {**columns, column: columns[column] + offset}


def checked(model: str, folder: Path) -> tuple[Finding, ...]:
    return check_data(load_model(model), load_measurements(folder))


@pytest.mark.parametrize("friction", [0.0, 0.02])
def test_a_good_record_of_a_machine_with_or_without_friction_raises_no_alarm(tmp_path: Path, friction: float) -> None:
    folder = write_case(tmp_path, lambda k: drive(k, friction=friction), DRIVE)
    assert checked("drive", folder) == ()


@pytest.mark.parametrize(
    ("spoil", "kind", "factor"),
    [
        (times("theta", 180 / math.pi), "unit", math.pi / 180),
        (times("theta", 1000.0), "unit", 1e-3),
        (times("theta", math.pi / 180), "unit", 180 / math.pi),
        (plus("theta", math.pi), "offset", math.pi),
        (plus("theta", -math.pi / 2), "offset", math.pi / 2),
        (times("time", 1000.0), "time_unit", 1e-3),
    ],
)
def test_a_wrong_unit_or_zero_of_a_damped_pendulum_is_named_with_its_mend(
    tmp_path: Path, spoil: Spoil, kind: str, factor: float
) -> None:
    folder = write_case(tmp_path, lambda k: pendulum(k, damping=2e-4), PENDULUM, spoil)
    (finding,) = checked("pendulum", folder)
    assert finding.kind == kind and finding.strong
    assert finding.change is not None
    assert abs(finding.change.value) == pytest.approx(factor)


@pytest.mark.parametrize(
    ("spoil", "kind", "factor"),
    [
        (times("phi", 180 / math.pi), "unit", math.pi / 180),
        (times("torque", 1 / 9.80665), "unit", 9.80665),
        (times("torque", 9.80665), "unit", 1 / 9.80665),
        (times("torque", -1.0), "sign", -1.0),
    ],
)
def test_a_wrong_unit_or_sign_of_a_drive_with_friction_is_named_with_its_mend(
    tmp_path: Path, spoil: Spoil, kind: str, factor: float
) -> None:
    folder = write_case(tmp_path, lambda k: drive(k, friction=0.01), DRIVE, spoil)
    (finding,) = checked("drive", folder)
    assert (finding.kind, finding.strong) == (kind, True)
    assert finding.change is not None
    assert finding.change.value == pytest.approx(factor)


def test_a_gain_that_is_no_unit_is_left_to_physics(tmp_path: Path) -> None:
    folder = write_case(tmp_path, drive, DRIVE, times("torque", 1 / 8.0))
    assert checked("drive", folder) == ()


def test_units_that_are_said_to_be_certain_are_not_doubted(tmp_path: Path) -> None:
    """An inertia that is 6.28 times as large as the model's moves as if its angle were written in turns."""
    folder = write_case(tmp_path, drive, DRIVE, times("phi", 1 / (2 * math.pi)))
    (doubted,) = checked("drive", folder)
    assert doubted.kind == "unit"
    case = folder / "case.toml"
    case.write_text(f"units_certain = true\n{case.read_text()}")
    assert checked("drive", folder) == ()


def test_mending_gives_the_record_back(tmp_path: Path) -> None:
    good = write_case(tmp_path / "good", pendulum, PENDULUM)
    bad = write_case(tmp_path / "bad", pendulum, PENDULUM, times("theta", 180 / math.pi))
    found = mend(load_model("pendulum"), load_measurements(bad))
    assert found.open == ()
    assert len(found.measurements.mended) == 1
    for trial, wanted in zip(found.measurements.trials, load_measurements(good).trials, strict=True):
        np.testing.assert_allclose(trial.columns["theta"], wanted.columns["theta"], rtol=1e-7)


def test_degrees_declared_as_radians_never_become_a_physical_effect(tmp_path: Path) -> None:
    folder = write_case(tmp_path / "bad", lambda k: pendulum(k, damping=2e-4), PENDULUM, times("theta", 180 / math.pi))
    file = tmp_path / "diagnosis.json"
    done = CliRunner().invoke(misfit, ["diagnose", "pendulum", str(folder), "--json", str(file)])
    assert done.exit_code == 0, done.output
    assert (
        "The record is wrong, so that no physics is named; first multiply theta by 0.0174533."
        in done.output.replace("\n", " ")
    )
    result = json.loads(file.read_text())
    assert (result["verdict"], result["effects"]) == ("cannot_tell", [])
    assert "degrees declared as radians" in result["warnings"][0]
    assert result["data_checks"][0]["kind"] == "unit"
    assert result["data_checks"][0]["strong"] is True


def test_compare_mends_when_told_and_says_what_it_mended(tmp_path: Path) -> None:
    folder = write_case(tmp_path / "bad", pendulum, PENDULUM, times("theta", 180 / math.pi))
    file = tmp_path / "compare.json"
    done = CliRunner().invoke(misfit, ["compare", "pendulum", str(folder), "--mend", "--json", str(file)])
    assert done.exit_code == 0, done.output
    assert "Mended: multiply theta by 0.0174533" in done.output
    result = json.loads(file.read_text())
    assert result["data_checks"] == []
    assert "degrees declared as radians" in result["mended"][0]
    assert result["learning"]["rmse"]["theta"] < 3e-4


def test_a_torque_in_mN_m_is_found_although_friction_is_missing_too(tmp_path: Path) -> None:
    folder = write_case(tmp_path, lambda k: drive(k, friction=0.1), DRIVE, times("torque", 1e3))
    (finding,) = [found for found in checked("drive", folder) if found.strong]
    assert (finding.kind, finding.column) == ("unit", "torque") and "0.001" in finding.proposal
