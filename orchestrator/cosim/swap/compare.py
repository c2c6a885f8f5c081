"""Two interfaces side by side: a pure function of their ports, of what is used, and of given names."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from difflib import SequenceMatcher
from typing import Any

import numpy as np

from fmus.errors import MisfitError
from orchestrator.cosim.addresses import Element, resolve
from orchestrator.cosim.compatible import transfer, unit_of, unit_scaling
from orchestrator.cosim.component import FLOATS, Port
from orchestrator.cosim.swap.report import Difference, Match, SwapReport
from orchestrator.cosim.system import Connection
from orchestrator.measurements.wording import nearest

_GROUPS = {"parameter": "parameter", "structuralParameter": "parameter", "calculatedParameter": "parameter"}
# Names that share half of their letters, and clearly more than with any other name.
_SIMILAR, _CLEARLY = 0.5, 0.1


@dataclass(frozen=True)
class Side:
    """One of the two components: where it is from, its ports and dependencies, and facts such as its FMI version."""

    source: str
    ports: Sequence[Port]
    feedthrough: Mapping[str, Sequence[str]] = field(default_factory=dict)
    facts: Mapping[str, Any] = field(default_factory=dict)


def compare_interfaces(
    component: str, old: Side, new: Side, used: Mapping[str, str], names: Mapping[str, str] | None = None
) -> SwapReport:
    """Compare two interfaces.

    Args:
        component: name in the system, for messages.
        old: the component that is there.
        new: the one to take its place.
        used: what the system uses the old one's variables for (a few words each), by variable or element of an array.
        names: new names by old ones; "" leaves a variable out on purpose.
    """
    return _Comparison(component, old, new, used, names or {}).report()


class _Comparison:
    def __init__(self, component: str, old: Side, new: Side, used: Mapping[str, str], names: Mapping[str, str]) -> None:
        self.component, self.old, self.new, self.names = component, old, new, names
        self.old_ports = {port.name: port for port in old.ports}
        self.new_ports = {port.name: port for port in new.ports}
        self.used = self._by_port(used)
        self.problems: list[str] = []
        self.matches: list[Match] = []
        self.parameters: list[Difference] = []
        self.taken: set[str] = set()

    def report(self) -> SwapReport:
        self._check_names()
        missing = [port for port in self.old_ports.values() if _shown(port) and not self._matched(port)]
        missing = [port for port in missing if not self._similar(port, missing)]
        self.problems += [
            self._lack(port) for port in missing if self.used.get(port.name) and port.name not in self.names
        ]
        added = [p for p in self.new_ports.values() if _shown(p) and p.name not in self.taken]
        return SwapReport(
            self.component,
            self.old.source,
            self.new.source,
            tuple(self.matches),
            tuple((p.name, p.causality, p.unit, self.used.get(p.name, "")) for p in missing),
            tuple((p.name, p.causality, p.unit, _start(p)) for p in added),
            tuple(self.parameters),
            tuple(self._facts()),
            tuple(self.problems),
            tuple(self._dependencies()),
        )

    def _lack(self, port: Port) -> str:
        free = [p.name for p in self.new_ports.values() if p.name not in self.taken and _group(p) == _group(port)]
        hint = (
            f"{nearest(port.name, free)}; give its name in a mapping file" if free else f"nor any other {_group(port)}"
        )
        return f"{self.new.source} has no {port.causality} {port.name!r} ({self.used[port.name]}); {hint}"

    def _by_port(self, used: Mapping[str, str]) -> dict[str, str]:
        """Uses of elements are uses of their port."""
        found: dict[str, str] = {}
        for name, use in used.items():
            try:
                for port in {element.port.name for element in resolve(self.old_ports, name, self.component)}:
                    found[port] = f"{found[port]}, {use}" if port in found else use
            except MisfitError:
                continue  # the system does not pass its own checks, which say so
        return found

    def _check_names(self) -> None:
        for name, target in self.names.items():
            if name not in self.old_ports:
                hint = nearest(name, self.old_ports)
                self.problems.append(f"the mapping names {name!r}, which {self.old.source} does not have; {hint}")
            elif target:
                try:
                    resolve(self.new_ports, target, self.new.source)
                except MisfitError as error:
                    self.problems.append(f"the mapping of {name!r}: {error}")

    def _matched(self, port: Port) -> bool:
        """Match a port by the mapping or its own name; True if there is nothing more to look for."""
        wanted = self.names.get(port.name, port.name)
        if not wanted:
            return False
        try:
            elements = resolve(self.new_ports, wanted, self.new.source)
        except MisfitError:
            return port.name in self.names  # reported with the mapping
        self._add(port, wanted, elements, "mapping" if port.name in self.names else "same name")
        return True

    def _add(self, port: Port, wanted: str, elements: list[Element], how: str) -> None:
        use = self.used.get(port.name, "")
        self.taken.update(element.port.name for element in elements)
        new = elements[0].port
        found, problem = _conversion(port, new, elements)
        if problem:
            text = f"{port.causality} {port.name!r} and {new.causality} {wanted!r} of {self.new.source}: {problem}"
            if use:
                self.problems.append(f"{text} ({use})")
                found = "does not fit"
            else:
                found = f"does not fit: {problem}"
        self.matches.append(Match(port.name, wanted, port.causality, how, found, use))
        if not problem and _group(port) in ("parameter", "input"):
            self._compare_starts(port, elements)

    def _compare_starts(self, port: Port, elements: list[Element]) -> None:
        new = elements[0].port
        if port.start is None or new.start is None or len(elements) != new.size:
            return
        value = port.start
        if port.type in FLOATS and new.type in FLOATS and port.unit and new.unit:
            factor, offset = unit_scaling(port, new)
            value = factor * np.asarray(port.start) + offset
        if port.type in FLOATS and new.type in FLOATS:
            equal = np.allclose(np.ravel(value), np.ravel(new.start), rtol=1e-9, atol=1e-12)
        else:
            equal = np.array_equal(np.ravel(value), np.ravel(new.start))
        if not equal:
            self.parameters.append(Difference(new.name, _valued(port), _valued(new)))

    def _similar(self, port: Port, missing: Iterable[Port]) -> bool:
        """Match a port in use with the one free port of the same kind, type and dimension whose name is similar."""
        if port.name not in self.used or self.names.get(port.name) == "":
            return False
        rivals = [p for p in missing if p.name in self.used and _alike(p, port)]
        free = [p for p in self.new_ports.values() if p.name not in self.taken and p.name not in self.old_ports]
        scores = sorted(((_likeness(port, p), p.name) for p in free if _alike(port, p)), reverse=True)
        if not scores or scores[0][0] < _SIMILAR:
            return False
        best, name = scores[0]
        others = [score for score, _ in scores[1:]]
        others += [_likeness(rival, self.new_ports[name]) for rival in rivals if rival.name != port.name]
        if any(score > best - _CLEARLY for score in others):
            return False
        self._add(port, name, resolve(self.new_ports, name, self.new.source), "similar")
        return True

    def _facts(self) -> Iterable[Difference]:
        for name in dict.fromkeys((*self.old.facts, *self.new.facts)):
            one, other = self.old.facts.get(name), self.new.facts.get(name)
            if one != other:
                yield Difference(name, _word(one), _word(other))

    def _dependencies(self) -> Iterable[str]:
        """Outputs in use that answer inputs at once now, and did not before; the other way round is harmless."""
        ports = {match.old: self._new_port(match.new) for match in self.matches}
        in_use = {ports[match.old] for match in self.matches if match.use and match.causality == "input"}
        before: dict[str, set[str]] = {}
        for match in self.matches:
            if match.causality == "output" and match.use and match.old in self.old.feedthrough:
                known = {ports.get(name, name) for name in self.old.feedthrough[match.old]}
                before.setdefault(ports[match.old], set()).update(known)
        inputs = [port.name for port in self.new.ports if port.causality == "input"]
        olds = set(ports.values())
        for output, already in before.items():
            now = set(self.new.feedthrough.get(output, inputs)) - already
            more = [name for name in inputs if name in now and (name not in olds or name in in_use)]
            if more:
                yield f"{output} depends on {', '.join(more)} without a delay now, which it did not before"

    def _new_port(self, name: str) -> str:
        return resolve(self.new_ports, name, self.new.source)[0].port.name


def _conversion(old: Port, new: Port, elements: list[Element]) -> tuple[str, str]:
    """What happens to a value, and why it cannot be passed on; one of them is empty."""
    if _group(old) != _group(new):
        return "", f"the causality {old.causality} is not {new.causality}"
    if len(elements) != old.size:
        return "", f"it has {old.size} element{'s' * (old.size > 1)}, the new one has {len(elements)}"
    if len(old.shape) > 1 and len(new.shape) > 1 and len(elements) == new.size and old.shape != new.shape:
        return "", f"the shapes {old.shape} and {new.shape} differ"
    if old.type in FLOATS and new.type not in FLOATS and old.unit not in ("", "1"):
        return "", (
            f"it is {old.type} in {old.unit}, the new one is {new.type}, which has whole numbers and no unit; "
            "put a function component between them that says what a step of one means"
        )
    # An output passes from the new component to where the old one was, anything else from there to the new one.
    source, target = (new, old) if old.causality == "output" else (old, new)
    try:
        found = transfer(source, target, Connection("", ""))
    except MisfitError as error:
        return "", str(error)
    return ", ".join(found.notes), ""


def _shown(port: Port) -> bool:
    return port.causality in ("input", "output", "parameter", "structuralParameter") and port.type != "Clock"


def _group(port: Port) -> str:
    return _GROUPS.get(port.causality, port.causality)


def _alike(one: Port, other: Port) -> bool:
    """Whether two ports are of one kind: causality, type, number of elements, dimension of the unit."""
    if _group(one) != _group(other) or one.size != other.size:
        return False
    if (one.type in FLOATS) != (other.type in FLOATS) or (one.type not in FLOATS and one.type != other.type):
        return False
    if not one.unit or not other.unit:
        return one.unit == other.unit
    try:
        units = [unit_of(port) for port in (one, other)]
    except MisfitError:
        return one.unit == other.unit
    return units[0] is not None and units[1] is not None and units[0].dimension == units[1].dimension


def _likeness(one: Port, other: Port) -> float:
    """Share of letters that two names have in common in order, without marks and case."""
    first, second = ("".join(c for c in port.name.lower() if c.isalnum()) for port in (one, other))
    return SequenceMatcher(None, first, second).ratio()


def _start(port: Port) -> str:
    if port.causality == "output":
        return ""
    return "no start value" if port.start is None else f"starts at {_valued(port)}"


def _valued(port: Port) -> str:
    value = np.asarray(port.start)
    text = f"{port.start:.9g}" if isinstance(port.start, float) else " ".join(str(value).split())
    return text if port.unit in ("", "1") else f"{text} {port.unit}"


def _word(value: Any) -> str:
    if value is None:
        return "not said"
    return {True: "yes", False: "no"}[value] if isinstance(value, bool) else str(value)
