"""Terminals follow from the interface, name variables that exist and are valid by the schema of FMI 3.0."""

import zipfile
from pathlib import Path

import pytest
from helpers_systems import lag

from fmus.arrays import array_variables
from fmus.catalogue import find_modelica_model
from fmus.layout import Layout, Scalar
from fmus.package import build_fmu
from fmus.symbolic.system import Variable
from fmus.terminals import FILE, terminals_of
from fmus.validate import validate_fmu


def members(inputs: list[str], outputs: list[str]) -> dict[str, list[str]]:
    """Variables of each terminal of a model with this interface."""
    sides = (("input", inputs), ("output", outputs))
    scalars = [Scalar(Variable(name), side, "continuous") for side, names in sides for name in names]
    return {t.name: list(t.members.values()) for t in terminals_of(array_variables(scalars))}


@pytest.mark.parametrize(
    ("inputs", "outputs", "expected"),
    [
        (["correction_q1"], ["q1", "q2"], {"q1": ["q1", "correction_q1"]}),
        (["u_1", "u_2", "v"], [], {"u": ["u_1", "u_2"]}),
        (["fx", "fy", "mass"], [], {"f": ["fx", "fy"]}),
        (["fx"], ["fy"], {}),
        (["u1", "u2"], ["u3"], {"u": ["u1", "u2"]}),
        (["1"], ["x", "y"], {}),
        (["q[1]", "q[2]", "correction_y[1]", "correction_y[2]"], ["y[1]", "y[2]"], {"y": ["y", "correction_y"]}),
    ],
)
def test_terminals_follow_from_names(inputs: list[str], outputs: list[str], expected: dict[str, list[str]]) -> None:
    assert members(inputs, outputs) == expected


def test_the_arm_has_its_stimulation_its_force_and_a_port_for_each_joint() -> None:
    terminals = terminals_of(array_variables(Layout(find_modelica_model("arm").compile()).scalars))
    assert {t.name: (t.rule, list(t.members)) for t in terminals} == {
        "q1": ("plug", ["coordinate", "force"]),
        "q2": ("plug", ["coordinate", "force"]),
        "f": ("plug", ["x", "y"]),
        "alpha": ("sequence", ["1", "2", "3", "4", "5", "6"]),
    }


def with_terminals(folder: Path, xml: bytes) -> Path:
    """A good FMU with these terminals."""
    return build_fmu(lag(), folder / "lag.fmu", fmi_version="3.0", extra_files={FILE: xml})


def test_terminals_of_a_built_fmu_are_valid_and_wrong_ones_are_findings(tmp_path: Path) -> None:
    fmu = build_fmu(find_modelica_model("cart").compile(), tmp_path / "cart.fmu", fmi_version="3.0")
    with zipfile.ZipFile(fmu) as archive:
        xml = archive.read(FILE)
    assert validate_fmu(fmu) == []
    assert validate_fmu(with_terminals(tmp_path, xml))[0] == "terminal 'x' names 'correction_x', which is no variable"
    assert "'rule' is not allowed" in validate_fmu(with_terminals(tmp_path, xml.replace(b"matchingRule", b"rule")))[0]
    bomb = xml.replace(b"<fmiTerminals", b'<!DOCTYPE x [<!ENTITY a "a">]><fmiTerminals', 1)
    assert "has a DOCTYPE" in validate_fmu(with_terminals(tmp_path, bomb))[0]


def test_the_second_version_has_no_terminals(tmp_path: Path) -> None:
    with zipfile.ZipFile(build_fmu(find_modelica_model("cart").compile(), tmp_path / "cart.fmu")) as archive:
        assert FILE not in archive.namelist()
