"""Connections between terminals of two FMUs (FMI 3.0, section 2.4.9): one line for all the variables of a plug or a bus."""

import xml.etree.ElementTree as ET
import zipfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fmus.errors import MisfitError
from orchestrator.cosim.component import Port
from orchestrator.cosim.system import Connection, split_address

_FILE = "terminalsAndIcons/terminalsAndIcons.xml"
# What one network terminal sends is what the other receives (FMI-LS-BUS 1.0, section 4.1).
_TRANSCEIVER = "org.fmi-ls-bus.transceiver"
_SENT = {"Tx_Clock": "Rx_Clock", "Tx_Data": "Rx_Data"}


@dataclass(frozen=True)
class Terminal:
    """Variables by the names that they have as members; `rule` says which members of two terminals belong together."""

    name: str
    rule: str
    members: Mapping[str, str]
    flows: tuple[str, ...] = ()


def read_terminals(path: Path) -> dict[str, Terminal]:
    """Terminals of an FMU by name; those within others as `outer.inner`."""
    with zipfile.ZipFile(path) as archive:
        if _FILE not in archive.namelist():
            return {}
        with archive.open(_FILE) as stream:
            found = ET.parse(stream).find("Terminals")
    return {} if found is None else {each.name: each for each in _terminals(found, "")}


def _terminals(parent: ET.Element, before: str) -> Iterator[Terminal]:
    for element in parent.findall("Terminal"):
        name = before + element.get("name", "")
        members = [each.attrib for each in element.findall("TerminalMemberVariable")]
        names = {
            each.get("memberName", each["variableName"]): each["variableName"]
            for each in members
            if "variableName" in each
        }
        flows = tuple(each.get("variableName", "") for each in members if each.get("variableKind") != "signal")
        yield Terminal(name, element.get("matchingRule", ""), names, flows)
        yield from _terminals(element, f"{name}.")


def variables_of(connection: Connection, described: Callable[[str], Any]) -> list[Connection]:
    """A connection of variables as it is; one of terminals as those of the variables that it stands for.

    Args:
        connection: as the user wrote it.
        described: gives the description of a component by its name; only FMUs have terminals.

    Raises:
        MisfitError: if two terminals do not fit together; the message does not name the connection.
    """
    found = []
    for address in (connection.source, connection.target):
        component, name = split_address(address)
        description = described(component)
        terminals = getattr(description, "terminals", {})
        if name not in terminals or name in description.by_name:
            return [connection]
        found.append((terminals[name], {each: port for each, (port, _) in description.by_name.items()}))
    (one, ports), (other, others) = found
    return between(connection, one, other, ports, others)


def between(
    connection: Connection, one: Terminal, other: Terminal, ports: Mapping[str, Port], others: Mapping[str, Port]
) -> list[Connection]:
    """The connections of variables that a connection of two terminals stands for.

    Args:
        connection: as the user wrote it.
        one, other: terminals of its source and of its target.
        ports, others: ports of the two components.

    Raises:
        MisfitError: if the terminals do not fit together.
    """
    if connection != Connection(connection.source, connection.target):
        raise MisfitError("factor, offset, mapping and convert belong to connections of variables, not of terminals")
    if one.rule != other.rule:
        raise MisfitError(f"the matching rules {one.rule!r} and {other.rule!r} of the terminals differ")
    flows = (*one.flows, *other.flows)
    if flows:
        raise MisfitError(f"{flows[0]} is a flow, whose sum is to be zero; only terminals of signals can be connected")
    sides = [split_address(address)[0] for address in (connection.source, connection.target)]
    found = []
    for here, there in _pairs(one, other):
        names = one.members[here], other.members[there]
        ends = [f"{side}.{name}" for side, name in zip(sides, names, strict=True)]
        causality = [
            table[name].causality if name in table else "" for table, name in zip((ports, others), names, strict=True)
        ]
        if here in _SENT if one.rule == _TRANSCEIVER else causality == ["output", "input"]:
            found.append(Connection(ends[0], ends[1]))
        elif one.rule == _TRANSCEIVER or causality == ["input", "output"]:
            found.append(Connection(ends[1], ends[0]))
        elif set(causality) & {"input", "output"}:
            raise MisfitError(f"{ends[0]} and {ends[1]} belong together, but are not an output and an input")
    return found


def _pairs(one: Terminal, other: Terminal) -> list[tuple[str, str]]:
    if one.rule == _TRANSCEIVER:
        there = {**_SENT, **{received: sent for sent, received in _SENT.items()}}
        return [(name, there[name]) for name in one.members if there.get(name) in other.members]
    if one.rule == "bus":
        return [(name, name) for name in one.members if name in other.members]
    names = (
        (list(one.members), list(other.members))
        if one.rule == "sequence"
        else (sorted(one.members), sorted(other.members))
    )
    if one.rule not in ("plug", "sequence"):
        raise MisfitError(f"the matching rule {one.rule!r} is not known here; connect the variables one by one")
    if len(names[0]) != len(names[1]) or (one.rule == "plug" and names[0] != names[1]):
        odd = sorted(set(names[0]) ^ set(names[1]))
        raise MisfitError(f"the members of the two terminals differ: {', '.join(odd[:5]) or 'one has more'}")
    return list(zip(*names, strict=True))
