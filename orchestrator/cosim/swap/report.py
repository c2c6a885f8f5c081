"""What a comparison of two interfaces found, as data, text and JSON."""

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from fmus.errors import MisfitError
from orchestrator.measurements.toml_values import TomlTable

SCHEMA = "misfit.swap/1"


@dataclass(frozen=True)
class Match:
    """A variable of the old component and what takes its place.

    `how` is "same name", "mapping" or "similar"; the last needs the user's word. `conversion` says what happens to the
    value. `use` says what the system needs the variable for, "" where it does not.
    """

    old: str
    new: str
    causality: str
    how: str
    conversion: str = ""
    use: str = ""


@dataclass(frozen=True)
class Difference:
    """Something that both have, but not alike; values as text, with units."""

    what: str
    old: str
    new: str


@dataclass(frozen=True)
class SwapReport:
    """The comparison of an old and a new component.

    `missing` and `new` hold (variable, causality, unit, note). `problems` say why the swap cannot work, one line each;
    `notes` what a user should know although it can.
    """

    component: str
    old: str
    new: str
    matches: tuple[Match, ...]
    missing: tuple[tuple[str, str, str, str], ...]
    added: tuple[tuple[str, str, str, str], ...]
    parameters: tuple[Difference, ...]
    capabilities: tuple[Difference, ...]
    problems: tuple[str, ...]
    notes: tuple[str, ...] = ()

    @property
    def questions(self) -> tuple[Match, ...]:
        """Matches by similarity, which the user has to confirm."""
        return tuple(match for match in self.matches if match.how == "similar")

    @property
    def works(self) -> bool:
        """Whether nothing stands against the swap, once the questions are confirmed."""
        return not self.problems

    def to_json(self) -> dict[str, Any]:
        """The whole report as plain data."""
        names = ("name", "causality", "unit", "note")
        return {
            "schema": SCHEMA,
            "component": self.component,
            "old": self.old,
            "new": self.new,
            "works": self.works,
            "matched": [asdict(match) for match in self.matches],
            "missing": [dict(zip(names, each, strict=True)) for each in self.missing],
            "added": [dict(zip(names, each, strict=True)) for each in self.added],
            "parameters": [asdict(each) for each in self.parameters],
            "capabilities": [asdict(each) for each in self.capabilities],
            "problems": list(self.problems),
            "notes": list(self.notes),
        }

    def __str__(self) -> str:
        return "\n".join(self._lines())

    def _lines(self) -> Iterator[str]:
        yield f"swap {self.component}: {self.old} -> {self.new}"
        same = [m for m in self.matches if m.how == "same name" and not m.conversion]
        yield f"  {len(same)} of {len(self.matches) + len(self.missing)} variables match by name" + _used(same)
        for title, found in (
            ("converted", [m for m in self.matches if m.conversion and m.how != "similar"]),
            ("renamed by the mapping", [m for m in self.matches if m.how == "mapping" and not m.conversion]),
            ("similar, please confirm", list(self.questions)),
        ):
            yield from _section(title, [_match(m) for m in found])
        yield from _section("missing in the new one", [_variable(each) for each in self.missing])
        yield from _section("only in the new one", [_variable(each) for each in self.added])
        yield from _section("other default values", [f"{d.what}: {d.old} -> {d.new}" for d in self.parameters])
        yield from _section("other abilities", [f"{d.what}: {d.old} -> {d.new}" for d in self.capabilities])
        yield from _section("note", list(self.notes))
        yield from _section("cannot work", list(self.problems))
        if self.works:
            yield "  the swap works" + (", once the similar names are confirmed" if self.questions else "")


def _used(matches: list[Match]) -> str:
    used = sum(bool(match.use) for match in matches)
    return f", {used} of them in use" if used else ""


def _match(match: Match) -> str:
    names = match.old if match.old == match.new else f"{match.old} -> {match.new}"
    tail = f" ({match.use})" if match.use else ""
    return f"{match.causality} {names}{': ' + match.conversion if match.conversion else ''}{tail}"


def _variable(each: tuple[str, str, str, str]) -> str:
    name, causality, unit, note = each
    return f"{causality} {name}{' in ' + unit if unit else ''}{': ' + note if note else ''}"


def _section(title: str, lines: list[str], most: int = 30) -> Iterator[str]:
    if lines:
        yield f"  {title}:"
        yield from (f"    {line}" for line in lines[:most])
    if len(lines) > most:
        yield f"    and {len(lines) - most} more"


def read_mapping(path: Path, component: str) -> dict[str, str]:
    """Read the table of a component; "" leaves a variable out. Without a table of its own nothing is renamed.

    Raises:
        MisfitError: if the file cannot be read or a name is no string.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise MisfitError(f"{path} cannot be read: {error.strerror}; expected a mapping file") from error
    table = TomlTable.parse(path, content)
    for name, value in table.values.items():
        if not isinstance(value, dict):
            raise table.wrong(name, f'a table for each component, such as [{component}] with old = "new"')
    return table.get_table(component).texts()


def mapping_text(report: SwapReport) -> str:
    """Text of a mapping file with every name that differs, to be checked and given back."""
    lines = [f"# {report.old} -> {report.new}", f"[{_key(report.component)}]"]
    for match in report.matches:
        if match.old != match.new:
            remark = "  # by similarity: please check" if match.how == "similar" else ""
            lines.append(f"{_key(match.old)} = {json.dumps(match.new)}{remark}")
    missing = [name for name, *_, wanted in report.missing if wanted]
    lines += [f'{_key(name)} = ""  # missing: give a name, or leave it out like this' for name in missing]
    return "\n".join(lines) + "\n"


def _key(name: str) -> str:
    plain = name.isascii() and name.replace("_", "").replace("-", "").isalnum()
    return name if plain else json.dumps(name, ensure_ascii=False)
