"""Everything that can be checked about an FMU: its description, its files, and how it behaves when it runs."""

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from fmus.archive import extract_fmu

TIME_LIMIT_S = 120.0


def validate_fmu(path: Path) -> list[str]:
    """List what is wrong with an FMU, one line each; empty when nothing is.

    Checked are the schema, names, units, combinations of attributes and the model structure (by FMPy),
    and that there is something to run on this machine: a binary, or sources that are all there. A binary
    that can run here does so in a process of its own: equal runs and restored states have to give equal bits, and
    outputs and derivatives may move with declared dependencies only.

    Raises:
        FmuError: if the file is no FMU at all, or is not safe to unpack.
    """
    with tempfile.TemporaryDirectory(prefix="misfit-validate-") as name:
        folder = extract_fmu(Path(path), Path(name))
        return _schema_findings(folder) or _content_findings(folder) or _behaviour_findings(folder)


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


def _behaviour_findings(folder: Path) -> list[str]:
    from fmpy import read_model_description

    description = read_model_description(str(folder), validate=False)
    interfaces = [i for i in (description.coSimulation, description.modelExchange) if i is not None]
    if description.fmiVersion == "1.0" or not all(_has_binary(folder, description, i) for i in interfaces):
        return []
    with tempfile.TemporaryDirectory(prefix="misfit-behaviour-") as name:
        result = Path(name) / "findings.json"
        command = [sys.executable, "-m", "fmus.behaviour", str(folder), str(result)]
        try:
            done = subprocess.run(
                command, capture_output=True, text=True, errors="replace", timeout=TIME_LIMIT_S, check=False
            )
        except subprocess.TimeoutExpired:
            return [f"running the FMU gave no answer for {TIME_LIMIT_S:.0f} s and was stopped"]
        if done.returncode == 0 and result.is_file():
            return [str(finding) for finding in json.loads(result.read_text())]
        if done.returncode == 1:  # an exception in Python, such as a refused call
            return [f"running the FMU failed: {(done.stderr.strip().splitlines() or ['no message'])[-1]}"]
        return [f"running the FMU crashed its process (exit code {done.returncode})"]


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
