"""Operations as the rows that C goes through."""

import ctypes
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orchestrator.cosim.fmu.description import CO_SIMULATION
from orchestrator.cosim.fmu.instance import Instance
from orchestrator.cosim.masters.checks import limits
from orchestrator.cosim.masters.operations import Get, Operation, Set, Step

_GET, _SET, _STEP = range(3)
Pointer = ctypes.c_void_p


class Part(ctypes.Structure):
    _fields_ = [
        *((name, Pointer) for name in ("instance", "get", "set", "step")),
        *((name, ctypes.c_int32) for name in ("version", "number")),
    ]


class Row(ctypes.Structure):
    _fields_ = [
        *((name, ctypes.c_int32) for name in ("kind", "part", "n_references", "n_values")),
        *((name, Pointer) for name in ("references", "values", "places", "sources", "factors", "offsets")),
        *((name, Pointer) for name in ("lower", "upper")),
        *((name, ctypes.c_int32) for name in ("every", "pieces")),
    ]


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
    ) -> None:
        self._ranges = ranges
        self._kept: list[Any] = []
        self.buffers: list[NDArray[np.float64]] = []
        self.instances, self.operations = instances, tuple(operations)
        self._place = {name: k for k, name in enumerate(instances)}
        self.parts = (Part * len(instances))(*(self._part(each, numbers[name]) for name, each in instances.items()))
        self.rows = (Row * len(self.operations))(*(self._row(each) for each in self.operations))

    def keep(self, values: Any, kind: Any) -> int:
        """Address of an array with these values."""
        array = np.ascontiguousarray(values, dtype=kind)
        self._kept.append(array)
        return int(array.ctypes.data)

    def _part(self, instance: Instance, number: int) -> Part:
        kind = "Real" if instance.description.version == 2 else "Float64"
        step = instance.address("DoStep") if instance.interface.kind == CO_SIMULATION else None
        functions = (instance.address(f"Get{kind}"), instance.address(f"Set{kind}"), step)
        return Part(instance.component.value, *functions, instance.description.version, number)

    def _row(self, operation: Operation) -> Row:
        assert isinstance(operation, Get | Set | Step)
        part = self._place[operation.component]
        if isinstance(operation, Step):
            self.buffers.append(np.zeros(0))
            return Row(kind=_STEP, part=part, every=operation.every, pieces=operation.pieces)
        references = [
            list(self.instances.values())[part].description.by_name[slot.port.name][1] for slot in operation.slots
        ]
        places = [place for slot in operation.slots for place in range(slot.first, slot.first + slot.port.size)]
        ranges = np.array([limits(slot) for slot in operation.slots for _ in range(slot.port.size)])
        bounded = self._ranges and bool(np.isfinite(ranges).any())
        buffer = np.zeros(len(places))
        self.buffers.append(buffer)
        row = Row(
            kind=_GET if isinstance(operation, Get) else _SET,
            part=part,
            n_references=len(references),
            n_values=len(places),
            references=self.keep(references, np.uint32),
            values=buffer.ctypes.data,
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
                origin[target] = (source, link.transfer.factor, link.transfer.offset)
        sources, factors, offsets = zip(*(origin[place] for place in places), strict=True)
        row.sources = self.keep(sources, np.int32)
        if any(factor != 1.0 or offset != 0.0 for factor, offset in zip(factors, offsets, strict=True)):
            row.factors, row.offsets = self.keep(factors, np.float64), self.keep(offsets, np.float64)
