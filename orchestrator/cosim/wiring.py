"""A checked system as numbers: where each value is, and what is copied where, converted how."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from fmus.errors import ComponentError
from fmus.units import after_number
from orchestrator.cosim.compatible import Transfer
from orchestrator.cosim.component import INTEGERS, Port

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
