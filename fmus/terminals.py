"""terminalsAndIcons.xml of FMI 3.0: which inputs and outputs belong together, read off the model's interface."""

import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from fmus.arrays import ArrayVariable
from fmus.description_parts import plain_text, to_bytes

FILE = "terminalsAndIcons/terminalsAndIcons.xml"
# An input of this name is a generalised force beside the model's own that acts on an output.
FORCE_ON = "correction_"
_NUMBERED = re.compile(r"(?P<stem>\w*?)_?(?P<number>\d+)")
_COMPONENT = re.compile(r"(?P<stem>\w+)(?P<axis>[xyz])")


@dataclass(frozen=True)
class Terminal:
    """Variables that are connected together: member name -> name of the variable."""

    name: str
    rule: str
    description: str
    members: Mapping[str, str]


def terminals_of(variables: Sequence[ArrayVariable]) -> list[Terminal]:
    """Group the inputs and outputs of a model. Each belongs to one terminal at most.

    * A port: an output `y` and the input `correction_y`, the generalised force that acts on it.
    * A vector: two or more inputs, or outputs, whose names differ in the last letter x, y or z.
    * A row: two or more inputs, or outputs, whose names differ in the number at their end; matched in its order.

    Other variables are connected one by one, which needs no terminal.
    """
    sides = [[v.name for v in variables if v.elements[0].causality == side] for side in ("input", "output")]
    found = list(_ports(*sides))
    for names in sides:
        taken = {variable for terminal in found for variable in terminal.members.values()}
        free = [name for name in names if name not in taken]
        found += _groups(free, _COMPONENT, "axis", "plug", "Vector")
        found += _groups(free, _NUMBERED, "number", "sequence", "Row")
    unique: dict[str, Terminal] = {}
    for terminal in found:
        unique.setdefault(terminal.name, terminal)
    return list(unique.values())


def terminals_xml(variables: Sequence[ArrayVariable]) -> bytes | None:
    """Write the terminals of a model; None if it has none."""
    terminals = terminals_of(variables)
    if not terminals:
        return None
    root = ET.Element("fmiTerminalsAndIcons", fmiVersion="3.0")
    parent = ET.SubElement(root, "Terminals")
    for terminal in terminals:
        about = {"matchingRule": terminal.rule, "description": plain_text(terminal.description)}
        element = ET.SubElement(parent, "Terminal", {"name": plain_text(terminal.name), **about})
        for member, variable in terminal.members.items():
            names = {"variableName": plain_text(variable), "memberName": member}
            ET.SubElement(element, "TerminalMemberVariable", {**names, "variableKind": "signal"})
    return to_bytes(root)


def _ports(inputs: Sequence[str], outputs: Sequence[str]) -> Iterator[Terminal]:
    for name in outputs:
        if FORCE_ON + name in inputs:
            members = {"coordinate": name, "force": FORCE_ON + name}
            yield Terminal(name, "plug", f"{name} and the generalised force that acts on it", members)


def _groups(names: Sequence[str], pattern: re.Pattern[str], key: str, rule: str, kind: str) -> Iterator[Terminal]:
    stems: dict[str, dict[str, str]] = {}
    for name in names:
        match = pattern.fullmatch(name)
        if match and match["stem"]:
            stems.setdefault(match["stem"], {})[match[key]] = name
    for stem, members in stems.items():
        if len(members) > 1:
            yield Terminal(stem, rule, f"{kind} of {', '.join(members.values())}", members)
