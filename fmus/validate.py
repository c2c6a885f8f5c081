"""Everything that can be checked about an FMU: its description, its files, and how it behaves when it runs."""

import json
import subprocess
import tempfile
import threading
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fmus.archive import extract_fmu
from fmus.checks.declared import check_names, check_terminals, check_units
from fmus.children import child_environment, python_command, run_child
from fmus.errors import FmuError
from fmus.sources import check_identifier, compile_library, sources_of

TIME_LIMIT_S = 120.0
# Two threads that read their process's first XML schema at once are told that it is none, once in a hundred times:
# libxml2 makes the types that every schema builds upon when it first needs them, and does not wait.
_READING_SCHEMA = threading.Lock()


@dataclass(frozen=True)
class Validation:
    """What is wrong with an FMU, and what could not be looked at, one line each."""

    findings: tuple[str, ...]
    notes: tuple[str, ...] = ()


def validate_fmu(path: Path) -> list[str]:
    """List what is wrong with an FMU, one line each; empty when nothing is: the findings of `examine_fmu`."""
    return list(examine_fmu(path).findings)


def examine_fmu(path: Path) -> Validation:
    """Find what is wrong with an FMU.

    Checked are the schema, names, units, combinations of attributes and the model structure (by FMPy and here),
    and that there is something to run: a binary, or sources that are all there. The binary for this machine, or what its
    sources are compiled to, runs in a process of its own, see `fmus.checks`: start values, equal runs, kept states, threads,
    dependencies, directional derivatives, reference results, and one interface against the other.

    Raises:
        FmuError: if the file is no FMU at all, or is not safe to unpack.
    """
    with tempfile.TemporaryDirectory(prefix="misfit-validate-") as name:
        folder = extract_fmu(Path(path), Path(name))
        findings = _schema_findings(folder)
        findings = findings or _identifier_findings(folder)
        if findings:
            return Validation(tuple(findings), ("not run: its description is not valid",))
        findings = _content_findings(folder)
        reason = _make_runnable(Path(path).name, folder, findings)
        if reason:
            return Validation(tuple(findings), (f"not run: {reason}",))
        return Validation((*findings, *_behaviour_findings(folder)))


def _schema_findings(folder: Path) -> list[str]:
    from fmpy import read_model_description  # type: ignore[import-untyped]
    from fmpy.model_description import ValidationError  # type: ignore[import-untyped]

    try:
        with _READING_SCHEMA:  # names are checked here: FMPy's grammar takes 8 ms for each
            description = read_model_description(str(folder), validate=True, validate_model_structure=True)
    except ValidationError as error:
        return [" ".join(str(finding).split()) for finding in error.problems]
    except Exception as error:  # whatever FMPy's XML code meets
        return [" ".join(str(error).split()) or type(error).__name__]
    return list(check_names(description))


def _identifier_findings(folder: Path) -> list[str]:
    """Names of binaries that are no names of files; they are looked at before any of them becomes a part of a path."""
    from fmpy import read_model_description  # type: ignore[import-untyped]

    description = read_model_description(str(folder), validate=False)
    for interface in (description.coSimulation, description.modelExchange, description.scheduledExecution):
        if interface is not None:
            try:
                check_identifier(interface.modelIdentifier, "modelDescription.xml")
            except FmuError as error:
                return [str(error)]
    return []


def _content_findings(folder: Path) -> list[str]:
    from fmpy import read_model_description  # type: ignore[import-untyped]

    description = read_model_description(str(folder), validate=False)
    offered = (description.coSimulation, description.modelExchange, description.scheduledExecution)
    interfaces = [interface for interface in offered if interface is not None]
    if not interfaces:
        return ["the FMU offers no interface: co-simulation, model exchange or scheduled execution"]
    missing = _missing_sources(folder, description)
    findings = [f"source file {name!r} is listed but missing" for name in missing]
    for interface in interfaces:
        if not any((folder / "binaries").glob("*/*")) and not any((folder / "sources").glob("*.c*")):
            findings.append(f"no binary of {interface.modelIdentifier!r} for any platform and no sources")
    findings += check_units(description)
    findings += check_terminals(folder, description)
    return list(dict.fromkeys(findings))


def _make_runnable(fmu: str, folder: Path, findings: list[str]) -> str:
    """Why an FMU cannot be run here, "" if it can: its sources are compiled where it has no binary for this machine."""
    from fmpy import read_model_description, supported_platforms

    description = read_model_description(str(folder), validate=False)
    interfaces = [i for i in (description.coSimulation, description.modelExchange) if i is not None]
    if description.fmiVersion == "1.0":
        return "it is of FMI 1.0, of which only the files are checked"
    if not interfaces:
        return "it offers neither co-simulation nor model exchange"
    if any(i.needsExecutionTool for i in interfaces):
        return f"it needs the tool that made it ({description.generationTool or 'which it does not name'})"
    for interface in interfaces:
        try:
            if not _has_binary(folder, description, interface):
                _compile(fmu, folder, description, interface)
        except FmuError as error:
            findings.append(str(error).removeprefix(f"{fmu}: "))
            return "there is no binary of it for this system"
        if not _has_binary(folder, description, interface):
            has = ", ".join(supported_platforms(str(folder))) or "none"
            return f"no binary for this system ({_platform(description)}), and no sources; it has binaries for: {has}"
    return ""


def _compile(fmu: str, folder: Path, description: Any, interface: Any) -> None:
    """Put the binary of an interface where it belongs, if there are sources of it that are all there."""
    sets = sources_of(description, interface.modelIdentifier)
    files = [folder / "sources" / name for part in sets for name in part.files]
    if not files or not all(file.is_file() for file in files):
        return
    target = _binary(folder, description, interface)
    target.parent.mkdir(parents=True, exist_ok=True)
    compile_library(fmu, int(description.fmiVersion[0]), sets, folder / "sources", target)


def _behaviour_findings(folder: Path) -> list[str]:
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
    return _binary(folder, description, interface).is_file()


def _binary(folder: Path, description: Any, interface: Any) -> Path:
    from fmpy import sharedLibraryExtension

    name = f"{interface.modelIdentifier}{sharedLibraryExtension}"
    return Path(folder / "binaries" / _platform(description) / name)


def _missing_sources(folder: Path, description: Any) -> list[str]:
    """Listed source files that are not there; FMPy presents those of FMI 2 as build configurations too."""
    listed = [
        name
        for configuration in description.buildConfigurations
        for file_set in configuration.sourceFileSets
        for name in file_set.sourceFiles
    ]
    return [name for name in listed if not (folder / "sources" / name).is_file()]
