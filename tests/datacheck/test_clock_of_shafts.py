"""A shaft whose friction the model lacks has no wrong clock: a time in which nothing moves predicts whatever is slow."""

from pathlib import Path

import pytest

from fmus.catalogue import find_modelica_model
from orchestrator.datacheck.check import check_data
from orchestrator.diagnosis.fit.extensible import model_of
from orchestrator.measurements import load_measurements
from tests.benchmarks.laws.cases import CASES
from tests.benchmarks.laws.truth import record


@pytest.mark.parametrize("friction", ["root damping", "rubbing from a moment on"])
def test_a_shaft_without_its_friction_has_no_wrong_clock(friction: str, tmp_path: Path) -> None:
    [case] = [case for case in CASES if (case.plant, case.name) == ("rotor", friction)]
    record(case, tmp_path, 0)
    source = find_modelica_model(f"{tmp_path / 'Rotor.mo'}:Rotor")
    found = check_data(model_of(source, source.compile()), load_measurements(str(tmp_path)))
    assert not [str(finding) for finding in found if finding.strong]
