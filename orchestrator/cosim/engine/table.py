"""The operations of a master as a table that the loop in C goes through."""

import ctypes
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmus.errors import ComponentError
from orchestrator.cosim.component import StepEnd
from orchestrator.cosim.engine.native import native_library
from orchestrator.cosim.fmu.instance import DISCARD, Instance
from orchestrator.cosim.fmu.stepping import SteppingFmu
from orchestrator.cosim.masters.checks import limits, outside
from orchestrator.cosim.masters.coupling import Coupling
from orchestrator.cosim.masters.operations import Get, Operation, Set, Step
from orchestrator.cosim.wiring import Slot

DONE, FULL, STOPPED, REFUSED, OUTSIDE_RANGE, EARLY = range(6)
_GET, _SET, _STEP = range(3)
Pointer = ctypes.c_void_p


class _Part(ctypes.Structure):
    _fields_ = [
        *((name, Pointer) for name in ("instance", "get", "set", "step")),
        *((name, ctypes.c_int32) for name in ("version", "number")),
    ]


class _Operation(ctypes.Structure):
    _fields_ = [
        *((name, ctypes.c_int32) for name in ("kind", "part", "n_references", "n_values")),
        *((name, Pointer) for name in ("references", "values", "places", "sources", "factors", "offsets")),
        *((name, Pointer) for name in ("lower", "upper")),
        *((name, ctypes.c_int32) for name in ("every", "pieces")),
    ]


class _Loop(ctypes.Structure):
    _fields_ = [
        *((name, Pointer) for name in ("parts", "operations")),
        *((name, ctypes.c_int32) for name in ("n_operations", "next")),
        *((name, Pointer) for name in ("signals", "columns")),
        *((name, ctypes.c_int32) for name in ("n_columns", "every")),
        ("rows", Pointer),
        *((name, ctypes.c_int64) for name in ("capacity", "filled")),
        *((name, ctypes.c_double) for name in ("start", "size")),
        *((name, ctypes.c_int64) for name in ("k", "k_end")),
        ("progress", Pointer),
        *((name, ctypes.c_int32) for name in ("failed", "index", "status", "terminated", "piece", "unused")),
        ("reached", ctypes.c_double),
    ]


def why_not(coupling: Coupling, operations: Sequence[Operation], recorded: Sequence[Slot]) -> str:
    """Why the loop in C cannot carry out operations; empty where it can."""
    for name, component in coupling.components.items():
        if not isinstance(component, SteppingFmu):
            return f"{name} is no co-simulation FMU in this process"
    for operation in operations:
        if not isinstance(operation, Get | Set | Step):
            return "there is an algebraic loop, or inputs are shaped"
        if isinstance(operation, Step):
            continue
        others = [slot.address for slot in operation.slots if slot.port.type != "Float64"]
        if others:
            return f"{others[0]} is no Float64"
        if isinstance(operation, Set) and not all(link.is_linear for link in operation.links):
            return f"a connection to {operation.component} has a table or a range to check"
    others = [slot.address for slot in recorded if slot.port.type != "Float64"]
    if others:
        return f"{others[0]} is no Float64"
    return "" if native_library() is not None else "there is no C compiler"


class Table:
    """Operations and the loop that carries them out; everything that C points to lives as long as this."""

    def __init__(self, coupling: Coupling, operations: Sequence[Operation], places: Sequence[int]) -> None:
        library = native_library()
        assert library is not None
        self._run = library.loop_run
        self._run.argtypes, self._run.restype = [ctypes.POINTER(_Loop)], ctypes.c_int
        self.coupling, self.operations = coupling, tuple(operations)
        self.signals = np.zeros(len(coupling.values))
        self._kept: list[Any] = []
        self._buffers: list[NDArray[np.float64]] = []
        self._floats = [
            k
            for slot in coupling.wiring.slots
            if slot.port.type == "Float64"
            for k in range(slot.first, slot.first + slot.port.size)
        ]
        self._instances = [self._instance(name) for name in coupling.components]
        parts = (_Part * len(self._instances))(*(self._part(k) for k in range(len(self._instances))))
        rows = (_Operation * len(self.operations))(*(self._operation(each) for each in self.operations))
        self._kept += [parts, rows]
        self.loop = _Loop(
            parts=ctypes.addressof(parts),
            operations=ctypes.addressof(rows),
            n_operations=len(rows),
            signals=self.signals.ctypes.data,
            columns=self._array(places, np.int32),
            n_columns=len(places),
            progress=coupling.progress.address,
        )

    def record_into(self, rows: NDArray[np.float64], every: int) -> None:
        """Where rows go from now on: (capacity, 1 + columns), filled from its beginning, each `every`-th point."""
        self._rows = rows
        self.loop.rows, self.loop.capacity, self.loop.every = rows.ctypes.data, len(rows), every
        self.loop.filled = 0

    def run(self, k: int, k_end: int, start: float, size: float) -> tuple[int, bool]:
        """Go from point `k` on, until `k_end`, a full buffer or a wish to stop: the point reached, whether the run goes on.

        Raises:
            ComponentError: if an FMU refuses a call or a value does not fit; rows until then are in the buffer.
        """
        loop, coupling = self.loop, self.coupling
        for place in self._floats:
            self.signals[place] = coupling.values[place] or 0.0
        loop.k, loop.k_end, loop.start, loop.size, loop.next, loop.piece = k, k_end, start, size, 0, 0
        going = True
        try:
            while going:
                outcome = self._run(loop)
                if outcome in (DONE, FULL, STOPPED):
                    break
                going = self._handle(outcome)
                if going and coupling.ended is not None:
                    loop.k_end = loop.k + 1
        finally:
            self._take_back()
        return int(loop.k), going and coupling.ended is None

    def _take_back(self) -> None:
        loop, coupling = self.loop, self.coupling
        values = self.signals.tolist()
        for place in self._floats:
            coupling.values[place] = values[place]
        coupling.time = coupling.last_good = loop.start + loop.k * loop.size
        for instance in self._instances:
            instance.time = coupling.time

    def _handle(self, outcome: int) -> bool:
        """Deal with an operation that did not just succeed; whether the run goes on."""
        loop, coupling = self.loop, self.coupling
        operation = self.operations[loop.failed]
        assert isinstance(operation, Get | Set | Step)
        instance = self._instances[coupling.number[operation.component]]
        time, last_good = coupling.progress.word.time, loop.start + loop.k * loop.size
        instance.time, coupling.last_good = time, last_good
        if not isinstance(operation, Step):
            if outcome == OUTSIDE_RANGE:
                slot, element = [(slot, e) for slot in operation.slots for e in range(slot.port.size)][loop.index]
                value = self._buffers[loop.failed][loop.index]
                raise outside(slot, element, float(value), time, last_good)
            names = [slot.port.name for slot in operation.slots]
            verb = "Get" if isinstance(operation, Get) else "Set"
            raise ComponentError(instance.refused_values(verb, names, self._buffers[loop.failed].tolist(), loop.status))
        piece = operation.every * loop.size / operation.pieces
        if outcome == REFUSED:
            if loop.status != DISCARD:
                raise instance.refused_step(loop.status, time, piece)
            end = instance.ended_early(loop.status, time, piece)
        else:
            end = StepEnd(loop.reached, early=True, terminated=bool(loop.terminated))
        going = coupling.finish_step(operation.component, end, time + piece)
        loop.piece += 1
        if loop.piece == operation.pieces:
            loop.piece, loop.next = 0, loop.next + 1
        return going

    def _instance(self, name: str) -> Instance:
        component = self.coupling.components[name]
        assert isinstance(component, SteppingFmu)
        return component.instance

    def _part(self, number: int) -> _Part:
        instance = self._instances[number]
        kind = "Real" if instance.description.version == 2 else "Float64"
        functions = (instance.address(name) for name in (f"Get{kind}", f"Set{kind}", "DoStep"))
        return _Part(instance.component.value, *functions, instance.description.version, number)

    def _operation(self, operation: Operation) -> _Operation:
        assert isinstance(operation, Get | Set | Step)
        part = self.coupling.number[operation.component]
        if isinstance(operation, Step):
            self._buffers.append(np.zeros(0))
            return _Operation(kind=_STEP, part=part, every=operation.every, pieces=operation.pieces)
        references = [self._instances[part].description.by_name[slot.port.name][1] for slot in operation.slots]
        places = [place for slot in operation.slots for place in range(slot.first, slot.first + slot.port.size)]
        ranges = np.array([limits(slot) for slot in operation.slots for _ in range(slot.port.size)])
        bounded = bool(np.isfinite(ranges).any())
        buffer = np.zeros(len(places))
        self._buffers.append(buffer)
        row = _Operation(
            kind=_GET if isinstance(operation, Get) else _SET,
            part=part,
            n_references=len(references),
            n_values=len(places),
            references=self._array(references, np.uint32),
            values=buffer.ctypes.data,
            places=self._array(places, np.int32),
            lower=self._array(ranges[:, 0], np.float64) if bounded else None,
            upper=self._array(ranges[:, 1], np.float64) if bounded else None,
        )
        if isinstance(operation, Set):
            self._sources(row, operation, places)
        return row

    def _sources(self, row: _Operation, operation: Set, places: Sequence[int]) -> None:
        # An element that nothing drives keeps its own value.
        origin = {place: (place, 1.0, 0.0) for place in places}
        for link in operation.links:
            for source, target in zip(link.sources, link.targets, strict=True):
                origin[target] = (source, link.transfer.factor, link.transfer.offset)
        sources, factors, offsets = zip(*(origin[place] for place in places), strict=True)
        row.sources = self._array(sources, np.int32)
        if any(factor != 1.0 or offset != 0.0 for factor, offset in zip(factors, offsets, strict=True)):
            row.factors, row.offsets = self._array(factors, np.float64), self._array(offsets, np.float64)

    def _array(self, values: Any, kind: Any) -> int:
        array = np.ascontiguousarray(values, dtype=kind)
        self._kept.append(array)
        return int(array.ctypes.data)
