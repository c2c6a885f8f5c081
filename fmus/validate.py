"""Everything that can be checked about an FMU without running it."""

import tempfile
from pathlib import Path
from typing import Any

from fmus.archive import extract_fmu


def validate_fmu(path: Path) -> list[str]:
    """List what is wrong with an FMU, one line each; empty when nothing is.

    Checked are the schema, names, units, combinations of attributes and the model structure (by FMPy),
    and that there is something to run on this machine: a binary, or sources that are all there.

    Raises:
        FmuError: if the file is no FMU at all, or is not safe to unpack.
    """
    with tempfile.TemporaryDirectory(prefix="misfit-validate-") as name:
        folder = extract_fmu(Path(path), Path(name))
        return _schema_findings(folder) or _content_findings(folder)


def _schema_findings(folder: Path) -> list[str]:
    from fmpy.validation import validate_fmu as fmpy_findings  # type: ignore[import-untyped]

    return [" ".join(str(finding).split()) for finding in fmpy_findings(str(folder))]


def _content_findings(folder: Path) -> list[str]:
    from fmpy import read_model_description, supported_platforms  # type: ignore[import-untyped]

    description = read_model_description(str(folder), validate=False)
    interfaces = [
        interface for interface in (description.coSimulation, description.modelExchange) if interface is not None
    ]
    if not interfaces:
        return ["the FMU offers neither co-simulation nor model exchange"]
    missing = _missing_sources(folder, description)
    findings = [f"source file {name!r} is listed but missing" for name in missing]
    for interface in interfaces:
        if not _has_binary(folder, description, interface) and not _has_sources(folder):
            offered = ", ".join(supported_platforms(str(folder))) or "none"
            findings.append(
                f"no binary of {interface.modelIdentifier!r} for {_platform(description)} and no sources; "
                f"platforms in the FMU: {offered}"
            )
    return list(dict.fromkeys(findings))


def _platform(description: Any) -> str:
    from fmpy import platform, platform_tuple

    return str(platform_tuple if description.fmiVersion.startswith("3") else platform)


def _has_binary(folder: Path, description: Any, interface: Any) -> bool:
    from fmpy import sharedLibraryExtension

    name = f"{interface.modelIdentifier}{sharedLibraryExtension}"
    return (folder / "binaries" / _platform(description) / name).is_file()


def _has_sources(folder: Path) -> bool:
    return any((folder / "sources").glob("*.c*"))


def _missing_sources(folder: Path, description: Any) -> list[str]:
    """Listed source files that are not there; FMPy presents those of FMI 2 as build configurations too."""
    listed = [
        name
        for configuration in description.buildConfigurations
        for file_set in configuration.sourceFileSets
        for name in file_set.sourceFiles
    ]
    return [name for name in listed if not (folder / "sources" / name).is_file()]
