"""Everything that can be checked about an FMU: its description, its files, and how it behaves when it runs."""

import json
import subprocess
import tempfile
import threading
from pathlib import Path
from typing import Any

from fmus.archive import extract_fmu
from fmus.checks.terminals import check_terminals
from fmus.checks.units import check_units
from fmus.children import child_environment, python_command, run_child

TIME_LIMIT_S = 120.0
# Two threads that read their process's first XML schema at once are told that it is none, once in a hundred times:
# libxml2 makes the types that every schema builds upon when it first needs them, and does not wait.
_READING_SCHEMA = threading.Lock()


def validate_fmu(path: Path) -> list[str]:
    """List what is wrong with an FMU, one line each; empty when nothing is.

    Checked are the schema, names, units, combinations of attributes and the model structure (by FMPy and here),
    and that there is something to run on this machine: a binary, or sources that are all there. A binary
    that can run here does so in a process of its own, see `fmus.checks`: start values, equal runs, kept states, threads,
    dependencies, directional derivatives, reference results, and one interface against the other.

    Raises:
        FmuError: if the file is no FMU at all, or is not safe to unpack.
    """
    with tempfile.TemporaryDirectory(prefix="misfit-validate-") as name:
        folder = extract_fmu(Path(path), Path(name))
        return _schema_findings(folder) or [*_content_findings(folder), *_behaviour_findings(folder)]


def _schema_findings(folder: Path) -> list[str]:
    from fmpy.validation import validate_fmu as fmpy_findings  # type: ignore[import-untyped]

    with _READING_SCHEMA:
        return [" ".join(str(finding).split()) for finding in fmpy_findings(str(folder))]


def _content_findings(folder: Path) -> list[str]:
    from fmpy import read_model_description, supported_platforms  # type: ignore[import-untyped]

    description = read_model_description(str(folder), validate=False)
    offered = (description.coSimulation, description.modelExchange, description.scheduledExecution)
    interfaces = [interface for interface in offered if interface is not None]
    if not interfaces:
        return ["the FMU offers no interface: co-simulation, model exchange or scheduled execution"]
    missing = _missing_sources(folder, description)
    findings = [f"source file {name!r} is listed but missing" for name in missing]
    for interface in interfaces:
        if not _has_binary(folder, description, interface) and not _has_sources(folder):
            platforms = ", ".join(supported_platforms(str(folder))) or "none"
            findings.append(
                f"no binary of {interface.modelIdentifier!r} for {_platform(description)} and no sources; "
                f"platforms in the FMU: {platforms}"
            )
    findings += check_units(description)
    findings += check_terminals(folder, description)
    return list(dict.fromkeys(findings))


def _behaviour_findings(folder: Path) -> list[str]:
    from fmpy import read_model_description

    description = read_model_description(str(folder), validate=False)
    interfaces = [i for i in (description.coSimulation, description.modelExchange) if i is not None]
    runnable = interfaces and all(_has_binary(folder, description, i) and not i.needsExecutionTool for i in interfaces)
    if description.fmiVersion == "1.0" or not runnable:
        return []
    with tempfile.TemporaryDirectory(prefix="misfit-behaviour-") as name:
        result = Path(name) / "findings.jsonl"
        command = python_command("fmus.behaviour", str(folder), str(result))
        try:
            done = run_child(command, environment=child_environment(), timeout_s=TIME_LIMIT_S)
        except subprocess.TimeoutExpired:
            findings, last = _noted(result)
            return [*findings, f"checking {last} gave no answer for {TIME_LIMIT_S:.0f} s and was stopped"]
        findings, last = _noted(result)
        if done.returncode == 1:  # an exception in Python
            said = done.stderr.decode(errors="replace").strip().splitlines() or ["no message"]
            return [*findings, f"running the FMU failed: {said[-1]}"]
        if done.returncode != 0:
            return [*findings, f"checking {last} crashed its process (exit code {done.returncode})"]
        return findings


def _noted(result: Path) -> tuple[list[str], str]:
    """The findings so far, and what was looked at last."""
    findings, last = [], "the FMU"
    for line in result.read_text().splitlines() if result.is_file() else []:
        note = json.loads(line)
        last = note.get("check", last)
        findings += [note["finding"]] if "finding" in note else []
    return findings, last


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
