"""A run of a system, step by step or as a whole."""

import math
import time as clock
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmus.errors import MisfitError
from orchestrator.cosim.assembly import Assembly, assemble
from orchestrator.cosim.engine.native import end_copies
from orchestrator.cosim.engine.table import Table, left_to_python, why_not
from orchestrator.cosim.masters import TableMaster
from orchestrator.cosim.masters.coupling import Coupling
from orchestrator.cosim.masters.rollback import Point, restore, save
from orchestrator.cosim.progress import Progress
from orchestrator.cosim.system import System, split_address
from orchestrator.cosim.wiring import OUTSIDE
from orchestrator.results.column import Column
from orchestrator.results.recorder import Nowhere, Recorder

_BLOCK_ROWS = 4096
_BLOCK_S = 0.05


@dataclass(frozen=True)
class SavedPoint:
    """A communication point of a simulation: its values and states, and how its time is counted."""

    coupling: Point
    start: float
    k: int


class Simulation:
    """A system, loaded and ready to run; a context manager that ends it.

    Every method raises ComponentError when a component fails, with its name and the time, and MisfitError for wrong use.

    Args:
        system: what to run. Where it says nothing of start, step, tolerance or master, and no argument does, time starts
            at 0, steps are the shortest that a component suggests, the tolerance is 1e-6 and the master is `ordered`.
        record: patterns of the columns to record, such as `mass.*`; all outputs without any.
        every: record each `every`-th communication point.
        progress: where to note who is called, for whoever watches from another process.
        stop, step, master, tolerance: instead of what the system says; times in s.
        engine: whether the loop in C may be used; it gives the same bits.

    Example:
        >>> from orchestrator.cosim import ComponentSpec, Simulation, System          # doctest: +SKIP
        >>> system = System("one", {"ball": ComponentSpec("ball", source="ball.fmu")})  # doctest: +SKIP
        >>> with Simulation(system, step=0.01) as simulation:                          # doctest: +SKIP
        ...     simulation.run(1.0)
        ...     simulation.get("ball.h")
    """

    def __init__(
        self,
        system: System,
        *,
        record: Sequence[str] | None = None,
        every: int = 1,
        progress: Progress | None = None,
        stop: float | None = None,
        step: float | None = None,
        master: str | None = None,
        tolerance: float | None = None,
        engine: bool = True,
    ) -> None:
        if every < 1:
            raise MisfitError(f"every = {every}: expected 1 or more communication points to a row")
        self.system, self.every = system, every
        self._progress = progress or Progress()
        self._parts: Assembly = assemble(
            system, self._progress, record=record, stop=stop, step=step, master=master, tolerance=tolerance
        )
        self.columns: tuple[Column, ...] = self._parts.columns
        self.report = self._parts.report
        self.coupling: Coupling = self._parts.coupling
        self._start, self._k = self._parts.start, 0
        self._ready = self._closed = False
        self._engine = engine
        self._table: Table | None = None
        self._recorder: Recorder | None = None
        self._recorded_time = -math.inf
        self._rows: NDArray[np.float64] | None = None
        self._filled = 0

    @property
    def time(self) -> float:
        """The communication point reached, in s."""
        return self.coupling.time

    @property
    def step_size(self) -> float | None:
        """The communication step in s; None where the master chooses it."""
        return None if self._parts.master.adaptive else self._parts.step

    @property
    def ended(self) -> str:
        """Which component ended the run and when; empty if none did."""
        found = self.coupling.ended
        return "" if found is None else f"{found[0]} ended the run at t = {found[1]:.9g} s"

    def provenance(self) -> Mapping[str, Any]:
        """What the simulation is made of: components with the hashes of their FMUs, values, master, versions."""
        return self._parts.provenance()

    def initialise(self) -> None:
        """Find the values at the start; `step` and `run` do it where it has not been done."""
        self._open()
        if self._ready:
            return
        self._parts.initialise()
        self._ready = True
        self._progress.word.last_good = self.time
        self._progress.leave()
        end_copies()
        master = self._parts.master
        if not isinstance(master, TableMaster):
            self.report.engine = f"master {master.name} runs in Python"
            return
        reason = why_not(self.coupling) if self._engine else "it is switched off"
        reason = "clocks tick, between steps" if master.events and not reason else reason
        self.report.engine = reason or left_to_python(self.coupling, master.operations)
        if not reason:
            self._table = Table(self.coupling, master.operations, [place for _, place in self._parts.recorded])

    def step(self, size: float | None = None) -> float:
        """Go to the next communication point, `size` s away where it is given, and return its time in s."""
        self.initialise()
        if self.coupling.ended is not None:
            raise MisfitError(f"{self.ended}; there are no further steps")
        wanted = self._parts.step if size is None else size
        if not (wanted > 0.0 and math.isfinite(wanted)):
            raise MisfitError(f"step of {wanted:g} s at t = {self.time:.9g} s: expected a positive time")
        adaptive = self._parts.master.adaptive
        if wanted != self._parts.step and not adaptive:
            self._parts.refuse_other_steps(wanted, self.time)
            self._start, self._k = self.time, 0
        self._advance(wanted)
        if wanted != self._parts.step:
            self._start, self._k = self.time, 0
        self._progress.leave()
        return self.time

    def run(
        self, until: float | None = None, recorder: Recorder | None = None, watch: Callable[[float], None] | None = None
    ) -> bool:
        """Run to `until` s, or to the stop time of the system; whether it got there, rather than a component ending it.

        Args:
            until: a later call goes on from there.
            recorder: gets rows in blocks; the caller ends it. The last point is recorded, whatever `every` says, when it
                is the stop time or nothing said where to stop.
            watch: is called with the time reached after every block.
        """
        end = self._parts.stop if until is None else until
        if end is None:
            raise MisfitError("nothing says how long to run; give a stop time in s")
        self.initialise()
        try:
            self._begin(recorder)
            while self.coupling.ended is None and end - self.time > 1e-9 * self._parts.step:
                if self._progress.word.stop:
                    return False
                self._block(end)
                self._hand_over()
                if watch is not None:
                    watch(self.time)
            if self.coupling.ended is not None or end >= (self._parts.stop or -math.inf):
                self._record_point()
        finally:
            self._hand_over()
            self._progress.leave()
        return self.coupling.ended is None

    def save(self) -> "SavedPoint":
        """Everything at the present communication point, to come back to with `restore`.

        Raises:
            ComponentError: if a component cannot save its state.
        """
        self.initialise()
        return SavedPoint(save(self.coupling), self._start, self._k)

    def restore(self, point: "SavedPoint") -> None:
        """Go back to a saved point, as often as wanted; the next rows go to a recorder that begins there."""
        restore(self.coupling, point.coupling)
        self._start, self._k = point.start, point.k
        self._recorder, self._recorded_time = None, -math.inf

    def get(self, address: str) -> Any:
        """Value of a variable, `component.variable`, or of an output of the system, by its name."""
        self._open()
        if address in self.system.outputs:
            return self.coupling.show(address)
        name, variable = self._known(address)
        return self.coupling.components[name].get([variable])[0]

    def set(self, address: str, value: Any) -> None:
        """Set an input that nothing drives, a tunable parameter, or an input of the system; from the next step on it counts.

        Before `initialise`, any parameter or start value can be set.

        Args:
            address: `COMPONENT.VARIABLE`, or the name of an input of the system.
            value: in the variable's own unit.
        """
        self._open()
        addresses = self.system.inputs.get(address, (address,))
        for each in addresses:
            name, variable = self._known(each)
            if (name, variable) in self._sizes:
                raise MisfitError(
                    f"{each} says how large arrays are, which is settled when the system is read; give its value there: "
                    f"parameters of the component, --set {each}=N or System.set"
                )
            slot = self.coupling.wiring.by_address.get((name, variable))
            driving = [link for link in self.coupling.wiring.to_component(name) if link.target is slot]
            if slot is not None and any(link.source.component != OUTSIDE for link in driving):
                raise MisfitError(f"{each} is driven by {driving[0].source.address}; take the connection out to set it")
            if slot is not None and driving:
                self.coupling.store(driving[0].source, value)
                self.coupling.copy(driving)
                value = self.coupling.fetch(slot)
            elif slot is not None:
                self.coupling.store(slot, value)
            self.coupling.components[name].set([variable], [value])

    def evaluate(self) -> None:
        """Carry what was set since the last step through all connections, at the communication point reached."""
        self.coupling.evaluate(self._parts.initial, self.time)
        self._progress.leave()

    def close(self) -> None:
        """End the run and free everything; calling it again does nothing."""
        if not self._closed:
            self._closed = True
            self._table = None
            self._parts.close()

    def __enter__(self) -> "Simulation":
        return self

    def __exit__(self, *reason: object) -> None:
        self.close()

    def __del__(self) -> None:
        if hasattr(self, "_parts"):
            self.close()

    def _open(self) -> None:
        if self._closed:
            raise MisfitError(f"the simulation of {self.system.name!r} is closed; make a new one")

    @cached_property
    def _sizes(self) -> frozenset[tuple[str, str]]:
        components = self.coupling.components.items()
        return frozenset((n, p.name) for n, c in components for p in c.ports if p.causality == "structuralParameter")

    def _known(self, address: str) -> tuple[str, str]:
        name, variable = split_address(address)
        self.system.component(name)
        return name, variable

    def _advance(self, size: float) -> None:
        """One step in Python."""
        going = self._parts.master.advance(self.coupling, self._k, self._start, size)
        end_copies()
        if going:
            self._k += 1

    def _begin(self, recorder: Recorder | None) -> None:
        """Make ready for rows; a new recorder gets the present point first."""
        wanted = recorder or Nowhere()
        if self._rows is None:
            self._rows = self._progress.buffer(_BLOCK_ROWS, 1 + len(self.columns))
        if recorder is None or self._recorder is not recorder:
            self._recorder = wanted
            self._recorded_time = -math.inf
            if recorder is not None:
                recorder.begin(self.columns, self.provenance())
            self._record_point()

    def _block(self, end: float) -> None:
        """Run for a while, at most until the buffer is full."""
        assert self._rows is not None
        deadline = clock.perf_counter() + _BLOCK_S
        step = self._parts.step
        while self.coupling.ended is None and self._filled < len(self._rows):
            left = end - self.time
            if left <= 1e-9 * step:
                return
            whole = math.floor((end - self._start) / step + 1e-9) - self._k
            if self._parts.master.adaptive:
                self._advance(left)
                if self._k % self.every == 0:
                    self._record_point()
            elif whole <= 0:
                self.step(left)
                self._record_point()
            elif self._table is not None and whole > 1:
                self._run_table(whole - 1)  # the last step, which must not pass the stop, is made below
            else:
                self._advance(step)
                if self.coupling.ended is None and self._k % self.every == 0:
                    self._record_point()
            if clock.perf_counter() > deadline or self._progress.word.stop:
                return

    def _run_table(self, steps: int) -> None:
        """The loop in C, for so many steps that it is back in time."""
        assert self._table is not None and self._rows is not None
        self._table.record_into(self._rows, self.every)
        self._table.loop.filled = self._filled
        before, began = self._k, clock.perf_counter()
        try:
            self._k, _ = self._table.run(
                self._k, self._k + min(steps, self._parts.chunk), self._start, self._parts.step
            )
        finally:
            end_copies()
            self._filled = int(self._table.loop.filled)
            if self._filled:
                self._recorded_time = float(self._rows[self._filled - 1, 0])
        took, done = clock.perf_counter() - began, self._k - before
        if done and took < 0.5 * _BLOCK_S:
            self._parts.chunk = min(2 * self._parts.chunk, 1_000_000)
        elif took > 2.0 * _BLOCK_S:
            self._parts.chunk = max(1, self._parts.chunk // 2)

    def _record_point(self) -> None:
        """Write the row of the present point, unless it is there already."""
        if self.time <= self._recorded_time:
            return
        assert self._rows is not None
        if self._filled == len(self._rows):
            self._hand_over()
        values = self.coupling.values
        self._rows[self._filled, 0] = self._recorded_time = self.time
        for column, (_, place) in enumerate(self._parts.recorded):
            self._rows[self._filled, 1 + column] = values[place]
        self._filled += 1
        self._progress.word.rows = self._filled

    def _hand_over(self) -> None:
        """Give the recorder what is in the buffer."""
        if self._filled and self._recorder is not None and self._rows is not None:
            self._recorder.rows(self._rows[: self._filled, 0], self._rows[: self._filled, 1:])
        self._filled = 0
        self._progress.word.rows = 0
