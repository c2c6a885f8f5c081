"""The check of a system before anything is loaded: names, causality, types, shapes, units, ranges, start values."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby
from typing import Any, Protocol

import numpy as np

from fmus.errors import MisfitError
from orchestrator.cosim.addresses import Element, resolve
from orchestrator.cosim.compatible import Transfer, transfer, unit_scaling
from orchestrator.cosim.component import Port
from orchestrator.cosim.fmu import has_events
from orchestrator.cosim.system import Connection, System, Value, split_address
from orchestrator.cosim.terminals import variables_of
from orchestrator.cosim.values import port_value
from orchestrator.cosim.wiring import OUTSIDE, Link, Slot, Wiring, unconnected_inputs
from orchestrator.measurements.wording import nearest

_MOST_PROBLEMS = 10


class HasPorts(Protocol):
    """What is known of a component before it is loaded: a description of an FMU, or a component itself."""

    @property
    def ports(self) -> Sequence[Port]:
        """Variables of the component."""
        ...

    @property
    def feedthrough(self) -> Mapping[str, Sequence[str]]:
        """Inputs that an output depends on directly, see `Component`."""
        ...


def wire(system: System, interfaces: Mapping[str, HasPorts]) -> Wiring:
    """Check all connections and values of a system and number its values.

    Args:
        system: as described.
        interfaces: ports of every component, by its name.

    Raises:
        MisfitError: with every problem found (ten at most), each naming the connection or value.
    """
    return _Checker(system, interfaces).wiring()


@dataclass
class _Checker:
    system: System
    interfaces: Mapping[str, HasPorts]
    problems: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    links: list[Link] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.ports = {name: self._inside(name) for name in self.system.components}
        self.ports[OUTSIDE] = self._outside()
        self.slots, self.size = _numbered(self.ports)
        self.by_address = {(slot.component, slot.port.name): slot for slot in self.slots}
        self.driven: dict[int, str] = {}
        specs = self.system.components
        self.ticking = tuple(name for name, spec in specs.items() if has_events(spec, self.interfaces[name]))

    def wiring(self) -> Wiring:
        for connection in self._of_variables():
            self._connect(split_address(connection.source), split_address(connection.target), connection)
        for name, targets in self.system.inputs.items():
            for target in targets:
                self._connect((OUTSIDE, name), split_address(target), Connection(name, target))
        for name, source in self.system.outputs.items():
            self._connect(split_address(source), (OUTSIDE, name), Connection(source, name))
        starts = {name: self._starts(name) for name in self.system.components}
        if self.problems:
            more = len(self.problems) - _MOST_PROBLEMS
            raise MisfitError("; ".join(self.problems[:_MOST_PROBLEMS]) + (f"; and {more} more" if more > 0 else ""))
        self.slots, self.links = self._started(starts)
        unconnected = tuple(unconnected_inputs(self.system, self.slots, starts, self.driven))
        notes = (*self.system.notes, *self.notes)
        clocked = tuple(link for link in self.links if self._is_clocked(link))
        links = tuple(link for link in self.links if link not in clocked)
        return Wiring(self.slots, self.size, links, starts, unconnected, notes, clocked, self.ticking)

    def _of_variables(self) -> Iterator[Connection]:
        for connection in self.system.connections:
            try:
                yield from variables_of(connection, self.interfaces.get)
            except MisfitError as error:
                self.problems.append(f"connection {connection.source} -> {connection.target}: {error}")

    def _is_clocked(self, link: Link) -> bool:
        """Whether it is followed at ticks only; without event mode on either side there are none."""
        ends = [slot for slot in (link.source, link.target) if slot.component in self.ticking]
        return any(slot.port.type == "Clock" or slot.port.clocks for slot in ends)

    def _started(self, starts: Mapping[str, Mapping[str, Any]]) -> tuple[tuple[Slot, ...], list[Link]]:
        outside = {id(slot): self._outside_start(slot, starts) for slot in self.slots if slot.component == OUTSIDE}
        links = [replace(link, source=outside.get(id(link.source), link.source)) for link in self.links]
        return tuple(outside.get(id(slot), slot) for slot in self.slots), links

    def _inside(self, component: str) -> dict[str, Port]:
        """Ports of a component, with the units that the system gives to those without.

        A local variable at which a connection starts is as good as an output: FMI lets any variable be read.
        """
        starts = {c.source for c in self.system.connections}
        ports = {
            port.name: replace(port, causality="output")
            if port.causality == "local" and f"{component}.{port.name}" in starts
            else port
            for port in self.interfaces[component].ports
        }
        for name, unit in self.system.components[component].units.items():
            si = self.system.definitions.get(unit)
            if name not in ports:
                self.problems.append(f"unit of {component}.{name}: there is no such variable; {nearest(name, ports)}")
            elif not ports[name].unit:
                ports[name] = replace(ports[name], unit=unit, si=si)
            else:
                self._same_unit(component, ports[name], replace(ports[name], unit=unit, si=si))
        return ports

    def _same_unit(self, component: str, own: Port, said: Port) -> None:
        try:
            agree = unit_scaling(own, said) == (1.0, 0.0)
        except MisfitError:
            agree = False
        if not agree:
            self.problems.append(f"{component}.{own.name} is in {own.unit}, but the system says {said.unit}")

    def _outside(self) -> dict[str, Port]:
        """Inputs and outputs of the system as ports that look like the variables inside."""
        ports: dict[str, Port] = {}
        for causality, table in (("output", self.system.inputs), ("input", self.system.outputs)):
            for name, targets in table.items():
                address = targets if isinstance(targets, str) else targets[0]
                label = f"{'input' if causality == 'output' else 'output'} {name!r} of the system"
                if name in ports:
                    self.problems.append(f"{label} has the name of an input; rename one")
                    continue
                try:
                    elements = self._elements(split_address(address))
                except MisfitError as error:
                    self.problems.append(f"{label}: {error}")
                    continue
                ports[name] = self._outside_port(name, causality, elements)
        return ports

    def _outside_port(self, name: str, causality: str, elements: list[Element]) -> Port:
        inside = elements[0].port
        shape = inside.shape if len(elements) == inside.size and inside.shape else (len(elements),)
        shape = () if len(elements) == 1 and not (inside.shape and inside.size == 1) else shape
        unit = self.system.units.get(name)
        port = replace(inside, name=name, causality=causality, shape=shape, start=None)
        return port if unit is None else replace(port, unit=unit, si=self.system.definitions.get(unit))

    def _outside_start(self, slot: Slot, starts: Mapping[str, Mapping[str, Any]]) -> Slot:
        """An input of the system starts at the value of the variable that it drives first."""
        links = [link for link in self.links if link.source is slot]
        if not links or len(links[0].sources) != slot.port.size:
            return slot
        target = links[0].target
        value = starts[target.component].get(target.port.name, target.port.start)
        if value is None or target.port.size != slot.port.size:
            return slot
        if links[0].is_linear and (links[0].transfer.factor, links[0].transfer.offset) != (1.0, 0.0):
            value = (value - links[0].transfer.offset) / links[0].transfer.factor
        return replace(slot, port=replace(slot.port, start=value))

    def _elements(self, address: tuple[str, str]) -> list[Element]:
        component, variable = address
        if component not in self.ports:
            raise MisfitError(f"there is no component {component!r}; {nearest(component, self.system.components)}")
        return resolve(self.ports[component], variable, component)

    def _connect(self, source: tuple[str, str], target: tuple[str, str], connection: Connection) -> None:
        label = f"connection {connection.source} -> {connection.target}"
        if (
            OUTSIDE in (source[0], target[0])
            and (source if source[0] == OUTSIDE else target)[1] not in self.ports[OUTSIDE]
        ):
            return  # reported with the inputs and outputs of the system
        try:
            self._link(source, target, connection, label)
        except MisfitError as error:
            self.problems.append(f"{label}: {error}")

    def _link(self, source: tuple[str, str], target: tuple[str, str], connection: Connection, label: str) -> None:
        ones, others = self._elements(source), self._elements(target)
        if ones[0].port.type != "Clock" or ones[0].port.variability == "triggered":
            _check_causality(
                source[0], ones, "output"
            )  # a clock that ticks by itself is an input, whose ticks are passed on
        _check_causality(target[0], others, "input")
        if len(ones) != len(others):
            raise MisfitError(
                f"{_shape(ones)} on one side, {_shape(others)} on the other; connect single elements as x[1]"
            )
        if _array_shape(ones) and _array_shape(others) and _array_shape(ones) != _array_shape(others):
            raise MisfitError(f"the shapes {_array_shape(ones)} and {_array_shape(others)} differ")
        both = zip(ones, others, strict=True)
        for _, group in groupby(both, key=lambda pair: (pair[0].port.name, pair[1].port.name)):
            pairs = list(group)
            found = transfer(pairs[0][0].port, pairs[0][1].port, connection)
            self._refuse_still_clocks(source[0], target[0], pairs[0])
            self._add(source[0], target[0], pairs, found, label)

    def _refuse_still_clocks(self, source: str, target: str, pair: tuple[Element, Element]) -> None:
        for component, element in zip((source, target), pair, strict=True):
            if element.port.type == "Clock" and component not in self.ticking:
                raise MisfitError(
                    f"the clocks of {component or 'the system'} do not tick: that takes an FMU for co-simulation with event mode, "
                    "in the process of the others (isolate = false)"
                )

    def _add(self, source: str, target: str, pairs: list[tuple[Element, Element]], found: Transfer, label: str) -> None:
        one, other = self.by_address[source, pairs[0][0].port.name], self.by_address[target, pairs[0][1].port.name]
        sources, targets = (
            tuple(slot.first + element.index for element in elements)
            for slot, elements in zip((one, other), zip(*pairs, strict=True), strict=True)
        )
        for position in targets:
            if position in self.driven:
                raise MisfitError(f"the input is already driven by {self.driven[position]}; take one of them out")
            self.driven[position] = label
        self.links.append(Link(one, other, sources, targets, found))
        self.notes += [f"{label}: {note}" for note in found.notes if f"{label}: {note}" not in self.notes[-5:]]

    def _starts(self, name: str) -> dict[str, Any]:
        """Values to set, complete arrays where single elements were given."""
        starts: dict[str, Any] = {}
        for variable, value in self.system.components[name].values.items():
            try:
                elements = resolve(self.ports[name], variable, name)
                for port_name, set_to in self._values(elements, variable, value, starts).items():
                    starts[port_name] = set_to
            except MisfitError as error:
                self.problems.append(f"{name}.{variable}: {error}")
        return starts

    def _values(
        self, elements: list[Element], variable: str, value: Value, before: Mapping[str, Any]
    ) -> dict[str, Any]:
        port, definitions = elements[0].port, self.system.definitions
        if len(elements) == port.size and port.name == variable:
            return {port.name: port_value(port, value, definitions)}
        if len(elements) > 1:  # scalars x[1], x[2], ... given together
            row = np.asarray(value.value, dtype=object).ravel()
            if len(row) != len(elements):
                raise MisfitError(f"{len(elements)} values are expected, {len(row)} are given")
            return {
                element.port.name: port_value(element.port, replace(value, value=one), definitions)
                for element, one in zip(elements, row, strict=True)
            }
        whole = before.get(port.name, port.start)
        if whole is None:
            raise MisfitError(f"{port.name} has no start value to take the other elements from; give the whole array")
        whole = np.array(whole)
        whole.flat[elements[0].index] = port_value(replace(port, shape=()), value, definitions)
        return {port.name: whole}


def _numbered(ports: Mapping[str, Mapping[str, Port]]) -> tuple[tuple[Slot, ...], int]:
    slots, size = [], 0
    for component in sorted(ports, key=lambda name: name != OUTSIDE):  # the sort is stable
        for port in ports[component].values():
            if port.causality in ("input", "output"):
                slots.append(Slot(component, port, size))
                size += port.size
    return tuple(slots), size


def _check_causality(component: str, elements: list[Element], wanted: str) -> None:
    port = elements[0].port
    if port.causality != wanted:
        article = "an" if port.causality[0] in "aeiou" else "a"
        raise MisfitError(
            f"{component}.{port.name} is {article} {port.causality}, but a connection "
            f"{'starts at' if wanted == 'output' else 'ends in'} an {wanted}"
        )


def _array_shape(elements: list[Element]) -> tuple[int, ...]:
    """Shape of a whole array of two or more dimensions; () for anything else."""
    shape = elements[0].port.shape
    return shape if len(shape) > 1 and len(elements) == elements[0].port.size else ()


def _shape(elements: list[Element]) -> str:
    return "one value" if len(elements) == 1 else f"{len(elements)} values"
