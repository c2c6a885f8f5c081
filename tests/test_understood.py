"""The first thing that a user sees of an unknown model: what it was understood as."""

from pathlib import Path

import pytest

from fmus.catalogue import ModelicaModel
from orchestrator.measurements import load_measurements
from orchestrator.understood import understood

GALLERY = Path(__file__).parent / "cases" / "gallery"


def lines(name: str, class_name: str) -> list[str]:
    source = ModelicaModel(class_name, class_name, GALLERY / name / "Model.mo")
    return understood(source, load_measurements(GALLERY / name))


def test_states_come_with_unit_balance_and_place() -> None:
    text = (GALLERY / "overhead_crane" / "Model.mo").read_text().splitlines()
    force, torque = (next(k for k, line in enumerate(text, 1) if key in line) for key in ("F = (M", "m*l^2*der"))
    found = lines("overhead_crane", "Crane")
    assert found[0] == "Model Crane: 4 states, 1 input, 2 outputs, 4 parameters"
    assert "  x [m]: follows from other variables, no balance equation" in found
    assert f"  v [m/s]: balance of forces in N, Model.mo:{force}" in found
    assert f"  w [rad/s]: balance of torques in N.m, Model.mo:{torque}" in found
    assert found[-1].startswith("Places for an effect: 2 balance equations, the paths of 1 input and 2 outputs")


def test_columns_are_told_with_the_variables_that_they_are() -> None:
    found = lines("cylinder", "Cylinder")
    assert "Data: 3 learning and 2 held-out trials, 6000 rows, 12 s" in found
    assert "  output p[1] [Pa] from column p_1" in found


@pytest.mark.parametrize(("name", "class_name", "terms"), [("two_rooms", "House.Plant", "heat flows in W")])
def test_a_balance_speaks_the_language_of_its_domain(name: str, class_name: str, terms: str) -> None:
    assert any(terms in line for line in lines(name, class_name))
