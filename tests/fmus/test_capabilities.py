"""Capability flags say what the FMUs can do, no less and no more."""

from pathlib import Path
from xml.etree import ElementTree

import pytest
from helpers_systems import lag, pendulum

from fmus.archive import read_archive
from fmus.package import build_fmu

COMMON = {"needsExecutionTool": "false", "canBeInstantiatedOnlyOncePerProcess": "false"}
SECOND = {"canGetAndSetFMUstate": "true", "canSerializeFMUstate": "true", "providesDirectionalDerivative": "true"}
THIRD = {
    "canGetAndSetFMUState": "true",
    "canSerializeFMUState": "true",
    "providesDirectionalDerivatives": "true",
    "providesAdjointDerivatives": "true",
}
# Version, interface: the flags of a model without events; only delays have to know when a step is complete.
FLAGS = {
    ("2.0", "CoSimulation"): {
        **COMMON,
        **SECOND,
        "canNotUseMemoryManagementFunctions": "true",
        "canHandleVariableCommunicationStepSize": "true",
        "canInterpolateInputs": "true",
    },
    ("2.0", "ModelExchange"): {
        **COMMON,
        **SECOND,
        "canNotUseMemoryManagementFunctions": "true",
        "completedIntegratorStepNotNeeded": "{no delays}",
    },
    ("3.0", "CoSimulation"): {**COMMON, **THIRD, "canHandleVariableCommunicationStepSize": "true"},
    ("3.0", "ModelExchange"): {**COMMON, **THIRD, "needsCompletedIntegratorStep": "{delays}"},
}


@pytest.mark.parametrize("make", [lag, pendulum])
@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_flags_are_those_of_the_abilities(make, version: str, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    system = make()
    description = read_archive(build_fmu(system, tmp_path / "m.fmu", fmi_version=version))["modelDescription.xml"]
    words = {"{delays}": bool(system.n_delays), "{no delays}": not system.n_delays}
    for kind in ("CoSimulation", "ModelExchange"):
        (element,) = ElementTree.fromstring(description).iter(kind)
        expected = {
            key: str(words[value]).lower() if value in words else value for key, value in FLAGS[version, kind].items()
        }
        assert {key: value for key, value in element.attrib.items() if key != "modelIdentifier"} == expected
