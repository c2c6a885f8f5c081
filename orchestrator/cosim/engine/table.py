"""The operations of a master as a table that the loop in C goes through."""

import ctypes
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmus.errors import ComponentError
from orchestrator.cosim.component import StepEnd
from orchestrator.cosim.engine.native import native_library
from orchestrator.cosim.engine.rows import Pointer, Rows, can_carry, can_copy
from orchestrator.cosim.fmu.instance import DISCARD, Instance
from orchestrator.cosim.fmu.stepping import SteppingFmu
from orchestrator.cosim.masters.checks import outside
from orchestrator.cosim.masters.coupling import Coupling
from orchestrator.cosim.masters.operations import Get, Operation, Set, Step
from orchestrator.cosim.wiring import Slot

# What C's doubles become in Python; integers without a mention.
_PYTHON_TYPES: dict[str, Callable[[float], Any]] = {"Float64": float, "Float32": float, "Boolean": bool}
DONE, FULL, STOPPED, REFUSED, OUTSIDE_RANGE, EARLY = range(6)


class LoopState(ctypes.Structure):
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
        others = [slot.address for slot in getattr(operation, "slots", ()) if not can_carry(slot)]
        if others:
            return f"{others[0]} is of a type that only Python passes on"
        if isinstance(operation, Set) and not all(can_copy(link) for link in operation.links):
            return f"a connection to {operation.component} has a table, a range to check, or changes the type"
    others = [slot.address for slot in recorded if not can_carry(slot)]
    if others:
        return f"{others[0]} is of a type that only Python passes on"
    return "" if native_library() is not None else "there is no C compiler"


class Table:
    """Operations and the loop that carries them out; everything that C points to lives as long as this."""

    def __init__(self, coupling: Coupling, operations: Sequence[Operation], places: Sequence[int]) -> None:
        library = native_library()
        assert library is not None
        self._run = library.loop_run
        self._run.argtypes, self._run.restype = [ctypes.POINTER(LoopState)], ctypes.c_int
        self.coupling = coupling
        self.signals = np.zeros(len(coupling.values))
        self._carried = [
            (k, _PYTHON_TYPES.get(slot.port.type, int))
            for slot in coupling.wiring.slots
            if can_carry(slot)
            for k in range(slot.first, slot.first + slot.port.size)
        ]
        self._instances = [self._instance(name) for name in coupling.components]
        names = dict(zip(coupling.components, self._instances, strict=True))
        self._rows_of = Rows(names, coupling.number, operations)
        self.loop = LoopState(
            parts=ctypes.addressof(self._rows_of.parts),
            operations=ctypes.addressof(self._rows_of.rows),
            n_operations=len(self._rows_of.entries),
            signals=self.signals.ctypes.data,
            columns=self._rows_of.keep(places, np.int32),
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
        for place, _ in self._carried:
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
        for place, kind in self._carried:
            coupling.values[place] = kind(values[place])
        coupling.time = coupling.last_good = loop.start + loop.k * loop.size
        for instance in self._instances:
            instance.time = coupling.time

    def _handle(self, outcome: int) -> bool:
        """Deal with an operation that did not just succeed; whether the run goes on."""
        loop, coupling = self.loop, self.coupling
        entry = self._rows_of.entries[loop.failed]
        operation = entry.operation
        instance = self._instances[coupling.number[operation.component]]
        time, last_good = coupling.progress.word.time, loop.start + loop.k * loop.size
        instance.time, coupling.last_good = time, last_good
        if not isinstance(operation, Step):
            if outcome == OUTSIDE_RANGE:
                slot, element = [(slot, e) for slot in entry.slots for e in range(slot.port.size)][loop.index]
                raise outside(slot, element, float(entry.values[loop.index]), time, last_good)
            names = [slot.port.name for slot in entry.slots]
            verb = "Get" if isinstance(operation, Get) else "Set"
            raise ComponentError(instance.refused_values(verb, names, entry.values.tolist(), loop.status))
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
