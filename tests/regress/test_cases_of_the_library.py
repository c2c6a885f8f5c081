"""Every built-in model has cases, and the tests run them."""

from pathlib import Path

import numpy as np
import pytest

from fmus.catalogue import built_in_models
from orchestrator.regress.collect import collect
from orchestrator.regress.reference import read_table

FOLDER = Path(__file__).parents[1] / "cases" / "regress"
CASES, WRONG = collect([FOLDER])


def test_every_built_in_model_has_a_case_against_equations_and_one_against_behaviour() -> None:
    found = {(case.model, case.name.rpartition("/")[2]) for case in CASES}

    assert not WRONG
    assert found == {(model, kind) for model in built_in_models() for kind in ("equations", "behaviour")}


def test_pytest_collects_the_cases_of_the_library(request: pytest.FixtureRequest) -> None:
    """In `pytest tests` the plugin takes them in; it is installed by its entry point."""
    assert request.config.pluginmanager.hasplugin("misfit")


@pytest.mark.parametrize("model", built_in_models())
def test_a_reference_of_the_library_moves_in_every_signal(model: str) -> None:
    table = read_table(FOLDER / f"{model}_behaviour_ref.csv")

    assert len(table.time) > 50
    for name, values in table.columns.items():
        assert np.isfinite(values).all() and np.ptp(values) > 1e-6, name
