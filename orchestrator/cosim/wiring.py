"""A checked system as numbers: where each value is, what is copied where, converted how, and what nothing drives."""

from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from fmus.errors import ComponentError
from fmus.units import after_number
from orchestrator.cosim.compatible import Transfer
from orchestrator.cosim.component import INTEGERS, Port
from orchestrator.cosim.system import System, split_address

# Inputs and outputs of the system itself belong to this name, which no component has.
OUTSIDE = ""


@dataclass(frozen=True)
class Slot:
    """The place of a port's values: its elements are at `first`, `first + 1`, ... of the flat numbering."""

    component: str
    port: Port
    first: int

    @property
    def address(self) -> str:
        """`component.variable`, or the bare name of an input or output of the system."""
        return f"{self.component}.{self.port.name}" if self.component else self.port.name


@dataclass(frozen=True)
class Link:
    """Elements of one port that are copied to elements of another; `sources` and `targets` are flat numbers.

    The target of an `OUTSIDE` link is an output of the system, its source an input of it.
    """

    source: Slot
    target: Slot
    sources: tuple[int, ...]
    targets: tuple[int, ...]
    transfer: Transfer

    @property
    def is_linear(self) -> bool:
        """Whether it is numbers times a factor plus an offset, without a check or table."""
        return not self.transfer.mapping and self.transfer.limits is None and self.source.port.type != "String"

    def convert(self, value: Any) -> Any:
        """The value of one element in the terms of the target.

        Raises:
            ComponentError: if the mapping has no such value, which the target's type cannot hold, or no value could.
        """
        transfer = self.transfer
        if transfer.mapping:
            if value in transfer.mapping:
                return transfer.mapping[value]
            if self.source.port.type == self.target.port.type:
                return value
            known = ", ".join(str(key) for key in transfer.mapping)
            raise ComponentError(
                f"{self.source.address} = {value!r} has no counterpart in {self.target.address}; the mapping has {known}"
            )
        if transfer.limits is not None and not transfer.limits[0] <= value <= transfer.limits[1]:
            low, high = transfer.limits
            raise ComponentError(
                f"{self.source.address} = {value!r} does not fit {self.target.address} "
                f"of type {self.target.port.type}, which holds [{low:.0f}, {high:.0f}]"
            )
        if (transfer.factor, transfer.offset) == (1.0, 0.0):
            return value
        scaled = transfer.factor * value + transfer.offset
        return int(scaled) if self.target.port.type in INTEGERS else scaled


@dataclass(frozen=True)
class Unconnected:
    """An input that nothing drives, and the value that it keeps, in the unit of the port.

    `address` is `component.variable`, or `input NAME` for an input of the system.
    """

    address: str
    value: Any
    unit: str
    given: bool

    def __str__(self) -> str:
        where = "given" if self.given else "start value"
        return f"{self.address} = {self.value!s}{after_number(self.unit)} ({where})"


@dataclass(frozen=True)
class Wiring:
    """Everything that a master needs to know about a system beside its components.

    `slots` holds all inputs and outputs of all components, in their order, after those of the system itself; `size` is
    the number of values. `starts` are the values to set before initialisation, by component and port, arrays complete, in
    the units of the ports. `notes` are lines for the user: conversions and what was assumed.
    """

    slots: tuple[Slot, ...]
    size: int
    links: tuple[Link, ...]
    starts: Mapping[str, Mapping[str, Any]]
    unconnected: tuple[Unconnected, ...]
    notes: tuple[str, ...]
    clocked: tuple[Link, ...] = ()
    ticking: tuple[str, ...] = ()

    @cached_property
    def by_address(self) -> Mapping[tuple[str, str], Slot]:
        """Slot by component and port."""
        return {(slot.component, slot.port.name): slot for slot in self.slots}

    def from_component(self, name: str) -> Sequence[Link]:
        """Links whose source is an output of a component, or an input of the system (`OUTSIDE`)."""
        return self._from.get(name, ())

    def to_component(self, name: str) -> Sequence[Link]:
        """Links whose target is an input of a component, or an output of the system (`OUTSIDE`)."""
        return self._to.get(name, ())

    @cached_property
    def _from(self) -> dict[str, list[Link]]:
        grouped: dict[str, list[Link]] = {}
        for link in self.links:
            grouped.setdefault(link.source.component, []).append(link)
        return grouped

    @cached_property
    def _to(self) -> dict[str, list[Link]]:
        grouped: dict[str, list[Link]] = {}
        for link in self.links:
            grouped.setdefault(link.target.component, []).append(link)
        return grouped


Starts = Mapping[str, Mapping[str, Any]]


def unconnected_inputs(
    system: System, slots: Sequence[Slot], starts: Starts, driven: Container[int]
) -> Iterator[Unconnected]:
    """List inputs of the system, which a plain run leaves as they are, then free inputs or elements of components.

    Args:
        system: as described.
        slots: of the wiring.
        starts: values that are set before initialisation, by component and port.
        driven: numbers of the values that a link ends in.
    """
    for slot in slots:
        if slot.component == OUTSIDE and slot.port.causality == "output":
            component, variable = split_address(system.inputs[slot.port.name][0])
            given = variable in system.components[component].values
            value = _or_zero(slot.port, slot.port.start)
            yield Unconnected(f"input {slot.port.name}", value, slot.port.unit, given)
    for slot in slots:
        if slot.component != OUTSIDE and slot.port.causality == "input" and slot.port.type != "Clock":
            yield from _free(slot, starts[slot.component], driven)


def _free(slot: Slot, starts: Mapping[str, Any], driven: Container[int]) -> Iterator[Unconnected]:
    free = [k for k in range(slot.port.size) if slot.first + k not in driven]
    given = slot.port.name in starts
    value = starts.get(slot.port.name, slot.port.start)
    if free and len(free) == slot.port.size:
        yield Unconnected(slot.address, _or_zero(slot.port, value), slot.port.unit, given)
        return
    for k in free:
        element = _or_zero(replace(slot.port, shape=()), None if value is None else np.ravel(value)[k])
        yield Unconnected(f"{slot.component}.{slot.port.elements[k]}", element, slot.port.unit, given)


def _or_zero(port: Port, value: Any) -> Any:
    """The start value; where there is none what FMI takes for it, zero or empty."""
    if value is not None:
        return value
    zero: Any = {"Boolean": False, "String": "", "Binary": b""}.get(port.type, 0)
    return np.full(port.shape, zero) if port.shape else zero
