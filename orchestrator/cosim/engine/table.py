"""The operations of a master as a table that the loop in C goes through."""

import ctypes
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmus.errors import ComponentError
from orchestrator.cosim.component import StepEnd
from orchestrator.cosim.engine.native import native_library, own_process_address
from orchestrator.cosim.engine.rows import Pointer, Rows, can_carry, why_in_python
from orchestrator.cosim.fmu.instance import DISCARD, Instance
from orchestrator.cosim.masters.coupling import Coupling
from orchestrator.cosim.masters.not_finite import outside
from orchestrator.cosim.masters.operations import Get, Operation, Set, Settle, Solve, Step

# What C's doubles become in Python; integers without a mention.
_PYTHON_TYPES: dict[str, Callable[[float], Any]] = {"Float64": float, "Float32": float, "Boolean": bool}
_TEXTS = ("String", "Binary")
DONE, FULL, STOPPED, REFUSED, OUTSIDE_RANGE, EARLY, HOST = range(7)


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
        ("ours", Pointer),
    ]


def why_not(coupling: Coupling) -> str:
    """Why the loop in C is not used; empty where it is."""
    if native_library() is None:
        return "there is no C compiler"
    return "" if _native(coupling) else "there is no FMU in this process"


def left_to_python(coupling: Coupling, operations: Sequence[Operation]) -> str:
    """What Python does in turn with the loop in C."""
    reasons = (why_in_python(operation, _native(coupling), coupling.not_finite) for operation in operations)
    return ", ".join(dict.fromkeys(reason for reason in reasons if reason))


def _native(coupling: Coupling) -> dict[str, Instance]:
    """FMUs that C can call."""
    found = ((name, getattr(component, "instance", None)) for name, component in coupling.components.items())
    return {name: instance for name, instance in found if isinstance(instance, Instance)}


class Table:
    """Operations and the loop that carries them out; everything that C points to lives as long as this.

    What C cannot do it leaves to Python, in its turn: components in Python, algebraic loops, texts.
    """

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
        # What C never touches is recorded all the same, such as 64-bit inputs that nothing drives.
        self._only_recorded = [
            k
            for slot in coupling.wiring.slots
            if not can_carry(slot) and slot.port.type not in _TEXTS
            for k in range(slot.first, slot.first + slot.port.size)
        ]
        self._instances = _native(coupling)
        self._rows_of = Rows(self._instances, coupling.number, operations, not_finite=coupling.not_finite)
        self._exchanged = {
            id(each.operation): _exchanged(each.operation) for each in self._rows_of.entries if each.hosted
        }
        self.loop = LoopState(
            parts=ctypes.addressof(self._rows_of.parts),
            operations=ctypes.addressof(self._rows_of.rows),
            n_operations=len(self._rows_of.entries),
            signals=self.signals.ctypes.data,
            columns=self._rows_of.keep(places, np.int32),
            n_columns=len(places),
            progress=coupling.progress.address,
            ours=own_process_address(),
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
        for place in self._only_recorded:
            self.signals[place] = coupling.values[place] or 0.0
        loop.k, loop.k_end, loop.start, loop.size, loop.next, loop.piece = k, k_end, start, size, 0, 0
        going = True
        try:
            while going:
                outcome = self._run(loop)
                if outcome in (DONE, FULL, STOPPED):
                    break
                going = self._in_python() if outcome == HOST else self._handle(outcome)
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
        for instance in self._instances.values():
            instance.time = coupling.time

    def _handle(self, outcome: int) -> bool:
        """Deal with an operation that did not just succeed; whether the run goes on."""
        loop, coupling = self.loop, self.coupling
        entry = self._rows_of.entries[loop.failed]
        operation = entry.operation
        assert isinstance(operation, Get | Set | Step)
        instance = self._instances[operation.component]
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

    def _in_python(self) -> bool:
        """Carry out the operations that are Python's turn; whether the run goes on."""
        loop, coupling, entries = self.loop, self.coupling, self._rows_of.entries
        coupling.last_good = loop.start + loop.k * loop.size
        going = True
        while going and loop.next < len(entries) and entries[loop.next].hosted:
            operation = entries[loop.next].operation
            reads, writes = self._exchanged[id(operation)]
            for place, kind in reads:
                coupling.values[place] = kind(self.signals[place])
            going = coupling.carry_out_one(operation, loop.k, loop.start, loop.size)
            for place in writes:
                self.signals[place] = coupling.values[place]
            loop.next += 1
        return going


def _exchanged(operation: Operation) -> tuple[list[tuple[int, Callable[[float], Any]]], list[int]]:
    """Places of the values that an operation takes, with their types, and of those that it gives; texts stay in Python."""
    if isinstance(operation, Step | Settle):  # with events everything is Python's, see `Simulation`
        return [], []
    parts = (*operation.torn, *operation.inside) if isinstance(operation, Solve) else (operation,)
    reads: dict[int, Callable[[float], Any]] = {}
    writes: dict[int, None] = {}
    for part in parts:
        for link in getattr(part, "links", ()):
            if can_carry(link.source):
                reads.update(dict.fromkeys(link.sources, _PYTHON_TYPES.get(link.source.port.type, int)))
        for slot in part.slots:
            places = range(slot.first, slot.first + slot.port.size)
            if slot.port.type not in _TEXTS:
                writes.update(dict.fromkeys(places))
            if can_carry(slot) and not isinstance(part, Get):
                reads.update(dict.fromkeys(places, _PYTHON_TYPES.get(slot.port.type, int)))
    return list(reads.items()), list(writes)
