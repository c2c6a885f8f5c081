"""The interface of an FMU against that of the last release: what breaks who uses it, and which version number that asks for."""

import xml.etree.ElementTree as ET
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from fmus.errors import MisfitError
from orchestrator.cosim.fmu import FmuDescription, read_description
from orchestrator.cosim.swap import Side, SwapReport, compare_interfaces
from orchestrator.cosim.swap.apply import facts
from orchestrator.cosim.system import System
from orchestrator.regress.case import Case
from orchestrator.regress.outcome import WholeVerdict
from orchestrator.regress.recording import Watched

Level = Literal["patch", "minor", "major"]
LEVELS: tuple[Level, ...] = ("patch", "minor", "major")
_USED = ("input", "output", "parameter", "structuralParameter")
# Abilities that somebody may rely on, by the name of the fact and what it was.
_ABILITIES = (
    "keeps its state",
    "writes its state to memory",
    "derivatives",
    "steps of any size",
    "events while stepping",
)


@dataclass(frozen=True)
class InterfaceChange:
    """What changed between two versions of an FMU: `breaking` for who uses it, `compatible` with that; one line each."""

    breaking: tuple[str, ...]
    compatible: tuple[str, ...]

    @property
    def level(self) -> Level:
        """Which part of a semantic version has to rise."""
        return "major" if self.breaking else "minor" if self.compatible else "patch"


def judge(case: Case, system: System, settings: Mapping[str, Any], progress: Watched) -> WholeVerdict:
    """Compare with the last release; a change above the allowed level fails.

    Args:
        case: the case.
        system: what it runs.
        settings: `fmu`, the last release, and `allow`, the level of change.
        progress: where it is noted what runs.

    Raises:
        MisfitError: for an unknown level, or a system that is not one FMU.
    """
    allowed = settings["allow"]
    if allowed not in LEVELS:
        raise MisfitError(f"{case.file}: allow = {allowed!r}; expected one of {', '.join(LEVELS)}")
    fmus = [system.folder / spec.source for spec in system.components.values() if spec.kind == "fmu"]
    if len(fmus) != 1:
        raise MisfitError(f"{case.file}: a release is compared FMU by FMU; {system.name!r} has {len(fmus)}")
    old = case.folder / settings["fmu"]
    change = interface_change(read_description(old), read_description(fmus[0]))
    version = version_of(old)
    advice = f"a {change.level} version" + (f", {next_version(version, change.level)}" if version else "")
    figures: dict[str, Any] = {
        "level": change.level,
        "breaking": list(change.breaking),
        "compatible": list(change.compatible),
    }
    figures["advice"] = advice
    lines = (*change.breaking, *change.compatible)
    words = f"{advice} after {old.name}{f' {version}' if version else ''}"
    words += f": {lines[0]}{f' (and {len(lines) - 1} more)' if len(lines) > 1 else ''}" if lines else ": no change"
    passed = LEVELS.index(change.level) <= LEVELS.index(allowed)
    return WholeVerdict(
        "release", passed, words if passed else f"{words}; at most a {allowed} change is allowed", figures
    )


def interface_change(old: FmuDescription, new: FmuDescription) -> InterfaceChange:
    """What changed for somebody who uses every input, output and parameter of the old one."""
    report = interface_report(old, new)
    renamed = [f"{m.old} is called {m.new} now" for m in report.matches if m.how == "similar"]
    units = [f"{m.old}: {m.conversion}" for m in report.matches if m.conversion and m.how == "same name"]
    lost = [f"{c.what}: {c.old} before, {c.new} now" for c in report.capabilities if _is_loss(c.what, c.old, c.new)]
    gone = [f"{name} of the FMU is gone" for name in old.interfaces if name not in new.interfaces]
    breaking = [*report.problems, *renamed, *units, *lost, *gone]
    compatible = [
        f"new {causality} {name} ({note or unit or 'no unit'})" for name, causality, unit, note in report.added
    ]
    taken = {m.new for m in report.matches}
    required = [
        f"new input {p.name} has no start value"
        for p in new.ports
        if p.causality == "input" and p.name not in taken and p.start is None and p.type != "Clock"
    ]
    compatible += [f"{p.what}: {p.old} before, {p.new} now" for p in report.parameters]
    compatible += [
        f"{c.what}: {c.old} before, {c.new} now" for c in report.capabilities if not _is_loss(c.what, c.old, c.new)
    ]
    compatible += list(report.notes)
    return InterfaceChange(tuple([*breaking, *required]), tuple(compatible))


def interface_report(old: FmuDescription, new: FmuDescription) -> SwapReport:
    """Compare two interfaces as somebody who uses every input, output and parameter of the old one."""
    used = {port.name: "used" for port in old.ports if port.causality in _USED and port.type != "Clock"}
    sides = [Side(each.path.name, each.ports, each.feedthrough, facts(each)) for each in (old, new)]
    return compare_interfaces(new.path.stem, sides[0], sides[1], used)


def _is_loss(what: str, old: str, new: str) -> bool:
    return what in _ABILITIES and (old, new) == ("yes", "no")


def version_of(path: Path) -> str:
    """The version that the model description states; "" if it states none."""
    with zipfile.ZipFile(path) as archive:
        return ET.fromstring(archive.read("modelDescription.xml")).get("version", "")


def next_version(version: str, level: Level) -> str:
    """The semantic version after a change of a level.

    Example:
        >>> next_version("1.4.2", "minor"), next_version("1.4", "major"), next_version("spring 24", "patch")
        ('1.5.0', '2.0.0', 'after spring 24')
    """
    parts = _numbers(version)
    if parts is None:
        return f"after {version}"
    place = 2 - LEVELS.index(level)
    return ".".join(str(part + 1 if k == place else part if k < place else 0) for k, part in enumerate(parts))


def _numbers(version: str) -> Sequence[int] | None:
    texts = version.split("-")[0].split("+")[0].split(".")
    if not all(text.isdigit() for text in texts) or len(texts) > 3:
        return None
    return [int(text) for text in (*texts, "0", "0")][:3]
