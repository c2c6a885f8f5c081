"""Operations as the rows that C goes through."""

import ctypes
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orchestrator.cosim.fmu.description import CO_SIMULATION, SCHEDULED
from orchestrator.cosim.fmu.instance import Instance
from orchestrator.cosim.masters.not_finite import NotFinite, limits
from orchestrator.cosim.masters.operations import Get, Operation, Set, Settle, Shape, Solve, Step
from orchestrator.cosim.wiring import Link, Slot

_GET, _SET, _STEP, _HOST = range(4)
# Numbers of the types in loop.c, and their bytes. 64-bit integers need not fit into the doubles that values travel in.
_TYPES = {"Float64": (0, 8), "Float32": (1, 4), "Int8": (2, 1), "UInt8": (3, 1), "Int16": (4, 2), "UInt16": (5, 2)}
_TYPES |= {"Int32": (6, 4), "UInt32": (7, 4), "Enumeration": (8, 8), "Boolean": (9, 1)}
_TYPES1 = {"Float64": (0, 8), "Int32": (6, 4), "Enumeration": (6, 4), "Boolean": (9, 1)}
_TYPES2 = {"Float64": (0, 8), "Int32": (6, 4), "Enumeration": (6, 4), "Boolean": (6, 4)}
Pointer = ctypes.c_void_p


def can_carry(slot: Slot) -> bool:
    """Whether C can read or write a port."""
    return slot.port.type in _TYPES


def why_in_python(operation: Operation, instances: Mapping[str, Instance], not_finite: NotFinite | None = None) -> str:
    """What keeps an operation from C, as a name of what it is; empty where nothing does.

    Args:
        operation: the operation.
        instances: FMUs that can be called from C, by component.
        not_finite: which values need not be finite.
    """
    if not_finite is not None and not_finite.policies:
        lenient = [slot for slot in getattr(operation, "slots", ()) if not_finite.concerns(slot)]
        if lenient:
            return f"{lenient[0].address}, which need not be finite"
    if isinstance(operation, Solve):
        return f"the algebraic loop {operation.loop}"
    if isinstance(operation, Settle):
        return "events of clocks"
    if operation.component not in instances:
        return operation.component
    if isinstance(operation, Shape):
        return f"inputs of {operation.component} that are not held"
    stepping = instances[operation.component].interface.kind == CO_SIMULATION
    if isinstance(operation, Step) and instances[operation.component].asks_within_steps:
        return f"inputs of {operation.component} within steps"
    if isinstance(operation, Step):
        what = "ticks" if instances[operation.component].interface.kind == SCHEDULED else "integration"
        return "" if stepping else f"{what} of {operation.component}"
    if isinstance(operation, Set) and not stepping:
        jumping = [slot for slot in operation.slots if slot.port.variability != "continuous"]
        if jumping:  # makes an event
            return jumping[0].address
    links = [link for link in getattr(operation, "links", ()) if not _can_copy(link)]
    others = [slot for slot in operation.slots if not can_carry(slot)]
    return f"{links[0].target.address} with its conversion" if links else others[0].address if others else ""


def _can_copy(link: Link) -> bool:
    """Whether C can copy along a link: real numbers with any factor, others as they are."""
    types = link.source.port.type, link.target.port.type
    as_it_is = (link.transfer.factor, link.transfer.offset) == (1.0, 0.0) and types[0] == types[1]
    return link.is_linear and can_carry(link.source) and (types == ("Float64", "Float64") or as_it_is)


class Part(ctypes.Structure):
    """Mirror of `Part` in loop.h."""

    _fields_ = [("instance", Pointer), ("version", ctypes.c_int32), ("number", ctypes.c_int32)]


class Row(ctypes.Structure):
    """Mirror of `Operation` in loop.h."""

    _fields_ = [
        *((name, ctypes.c_int32) for name in ("kind", "part", "type", "n_references", "n_values", "unused")),
        *((name, Pointer) for name in ("function", "references", "raw", "values", "places")),
        *((name, Pointer) for name in ("sources", "factors", "offsets", "lower", "upper")),
        *((name, ctypes.c_int32) for name in ("every", "pieces")),
    ]


@dataclass(frozen=True)
class Entry:
    """What a row stands for: an operation, or the part of it that has variables of one type; `hosted` is left to Python."""

    operation: Operation
    slots: tuple[Slot, ...]
    values: NDArray[np.float64]
    hosted: bool = False


class Rows:
    """Rows for operations on instances; everything that C points to lives as long as this.

    `numbers` tells for each component its number in the system. Without `ranges` only numbers that are not finite count as
    wrong, as within the trial steps of an integrator.
    """

    def __init__(
        self,
        instances: Mapping[str, Instance],
        numbers: Mapping[str, int],
        operations: Sequence[Operation],
        ranges: bool = True,
        not_finite: NotFinite | None = None,
    ) -> None:
        self._ranges, self._instances = ranges, instances
        self._kept: list[Any] = []
        self._place = {name: k for k, name in enumerate(instances)}
        # The functions of version 1 that are called here take the same arguments as those of version 2.
        versions = ((n, each.component.value, max(each.description.version, 2)) for n, each in instances.items())
        self.parts = (Part * len(instances))(*(Part(at, version, numbers[name]) for name, at, version in versions))
        self.entries = [entry for operation in operations for entry in _entries(operation, instances, not_finite)]
        self.rows = (Row * len(self.entries))(*(self._row(entry) for entry in self.entries))

    def keep(self, values: Any, kind: Any) -> int:
        """Address of an array with these values."""
        array = np.ascontiguousarray(values, dtype=kind)
        self._kept.append(array)
        return int(array.ctypes.data)

    def _row(self, entry: Entry) -> Row:
        operation = entry.operation
        if entry.hosted:
            return Row(kind=_HOST)
        assert isinstance(operation, Get | Set | Step)
        part, instance = self._place[operation.component], self._instances[operation.component]
        if isinstance(operation, Step):
            function = instance.address("DoStep")
            return Row(kind=_STEP, part=part, function=function, every=operation.every, pieces=operation.pieces)
        kind = entry.slots[0].port.type
        number, size = {1: _TYPES1, 2: _TYPES2, 3: _TYPES}[instance.description.version][kind]
        references = [instance.description.by_name[slot.port.name][1] for slot in entry.slots]
        places = _places(entry.slots)
        ranges = np.array([limits(slot) or (-np.inf, np.inf) for slot in entry.slots for _ in range(slot.port.size)])
        bounded = self._ranges and bool(np.isfinite(ranges).any())
        verb = "Get" if isinstance(operation, Get) else "Set"
        row = Row(
            kind=_GET if isinstance(operation, Get) else _SET,
            part=part,
            type=number,
            n_references=len(references),
            n_values=len(places),
            function=instance.address(verb + instance.kinds[kind][0]),
            references=self.keep(references, np.uint32),
            raw=self.keep(np.zeros(size * len(places)), np.uint8) if number else entry.values.ctypes.data,
            values=entry.values.ctypes.data,
            places=self.keep(places, np.int32),
            lower=self.keep(ranges[:, 0], np.float64) if bounded else None,
            upper=self.keep(ranges[:, 1], np.float64) if bounded else None,
        )
        if isinstance(operation, Set):
            self._sources(row, operation, places)
        return row

    def _sources(self, row: Row, operation: Set, places: Sequence[int]) -> None:
        # An element that nothing drives keeps its own value.
        origin = {place: (place, 1.0, 0.0) for place in places}
        for link in operation.links:
            for source, target in zip(link.sources, link.targets, strict=True):
                if target in origin:
                    origin[target] = (source, link.transfer.factor, link.transfer.offset)
        sources, factors, offsets = zip(*origin.values(), strict=True)
        row.sources = self.keep(sources, np.int32)
        if any(factor != 1.0 or offset != 0.0 for factor, offset in zip(factors, offsets, strict=True)):
            row.factors, row.offsets = self.keep(factors, np.float64), self.keep(offsets, np.float64)


def _entries(operation: Operation, instances: Mapping[str, Instance], not_finite: NotFinite | None) -> Iterator[Entry]:
    """The calls that an operation takes: one for each type."""
    hosted = bool(why_in_python(operation, instances, not_finite))
    if hosted or not isinstance(operation, Get | Set):
        yield Entry(operation, (), np.zeros(0), hosted)
        return
    by_type: dict[str, list[Slot]] = {}
    for slot in operation.slots:
        by_type.setdefault(slot.port.type, []).append(slot)
    for slots in by_type.values():
        yield Entry(operation, tuple(slots), np.zeros(len(_places(slots))))


def _places(slots: Sequence[Slot]) -> list[int]:
    return [place for slot in slots for place in range(slot.first, slot.first + slot.port.size)]
