"""A whole simulation in a process of its own: as fast as in this one, since rows come back through shared memory."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmus.errors import ComponentError, MisfitError
from orchestrator.cosim.assembly import Report
from orchestrator.cosim.isolate.process import Child, ChildLimits, key_of, label, put_back, take
from orchestrator.cosim.system import System
from orchestrator.results.recorder import Nowhere, Recorder


@dataclass(frozen=True)
class State:
    """What changes as a simulation goes on; it comes with every answer."""

    time: float
    ended: str
    report: Report


class IsolatedSimulation:
    """Offers what `Simulation` does; what an FMU breaks there is a ComponentError here, and the rows until then are kept."""

    def __init__(self, system: System, limits: ChildLimits | None = None, **options: Any) -> None:
        labels, limits = [label(spec) for spec in system.components.values()], limits or ChildLimits()
        self._key = key_of(system)
        warmed = take(self._key)
        if warmed is not None:
            warmed.begin_again(labels, limits)
        self._child = warmed or Child("simulation", labels, limits)
        self._sound = self._closed = False
        self._state: State
        self._buffer: NDArray[np.float64] | None = None
        self._last = -np.inf
        self._child.send(system, options)
        try:
            self.columns, self._provenance, self.step_size = self._answer(Nowhere(), None)
        except MisfitError:
            self.close()
            raise

    @property
    def report(self) -> Report:
        """What a user should know before trusting the run."""
        return self._state.report

    def provenance(self) -> Any:
        """What the simulation is made of."""
        return self._provenance

    def run(
        self, until: float | None, recorder: Recorder | None = None, watch: Callable[[float], None] | None = None
    ) -> Any:
        """Run as `Simulation.run` does.

        Raises:
            ComponentError: also when the process crashes, hangs or takes too much memory; rows until then are recorded.
        """
        taking = recorder or Nowhere()
        self._child.send("run", (until, recorder is not None))
        try:
            return self._answer(taking, watch)
        except ComponentError:
            self._rescue(taking)
            raise

    @property
    def ended(self) -> str:
        """Which component ended the run and when; empty if none did."""
        return self._state.ended

    @property
    def time(self) -> float:
        """The communication point reached, in s."""
        return self._state.time

    def initialise(self) -> None:
        """Find the values at the start."""
        self._call("initialise")

    def step(self, size: float | None = None) -> float:
        """Go to the next communication point and return its time in s."""
        return self._call("step", size)

    def get(self, address: str) -> Any:
        """Value of a variable or of an output of the system."""
        return self._call("get", address)

    def set(self, address: str, value: Any) -> None:
        """Set an input, a parameter or an input of the system."""
        self._call("set", address, value)

    def _call(self, name: str, *arguments: Any) -> Any:
        self._child.send(name, arguments)
        return self._answer(Nowhere(), None)

    def stop(self) -> None:
        """Ask the run to end at its next communication point."""
        self._child.memory.word.stop = 1

    def close(self) -> None:
        """End the simulation; its process ends, too, unless it may be of use for another run of the same FMUs."""
        if self._closed:
            return
        self._closed = True
        if self._sound:
            state = self._state
            try:
                self._call("end")
            except MisfitError:
                self._sound = False
            self._state = state
        if self._sound:
            put_back(self._key, self._child)
        else:
            self._child.close()

    def __enter__(self) -> "IsolatedSimulation":
        return self

    def __exit__(self, *reason: object) -> None:
        self.close()

    def _answer(self, recorder: Recorder, watch: Callable[[float], None] | None) -> Any:
        self._sound = False
        while True:
            kind, *content = self._child.receive()
            if kind == "answer":
                answer, self._state = content
                self._sound = True
                return answer
            self._take(kind, content, recorder, watch)

    def _take(
        self, kind: str, content: Sequence[Any], recorder: Recorder, watch: Callable[[float], None] | None
    ) -> None:
        if kind == "buffer":
            self._buffer = self._child.memory.buffer(*content)
        elif kind == "begin":
            recorder.begin(*content)
        elif kind == "watch":
            if watch is not None:
                watch(content[0])
            self._child.send("go on")
        else:
            times, values = self._shared(*content) if kind == "shared rows" else content
            recorder.rows(times, values)
            self._last = float(times[-1]) if len(times) else self._last
            self._child.send("go on")

    def _shared(self, first: int, count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        assert self._buffer is not None
        rows = self._buffer[first : first + count]
        return rows[:, 0], rows[:, 1:]

    def _rescue(self, recorder: Recorder) -> None:
        """Record rows that were complete when the process ended, but had not been handed over."""
        if self._buffer is None:
            return
        times, values = self._shared(0, min(int(self._child.memory.word.rows), len(self._buffer)))
        new = times > self._last
        if new.any():
            recorder.rows(times[new], values[new])
