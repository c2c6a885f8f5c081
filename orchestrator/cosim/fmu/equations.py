"""Model exchange FMUs as one system of equations: integrated with error control, with their events handled."""

import ctypes
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from fmus.errors import ComponentError
from orchestrator.cosim.component import StepEnd
from orchestrator.cosim.engine.native import exchange_library
from orchestrator.cosim.engine.rows import Pointer, Rows
from orchestrator.cosim.engine.table import LoopState
from orchestrator.cosim.fmu.instance import Double, Instance
from orchestrator.cosim.masters.operations import Operation
from orchestrator.cosim.progress import Progress

_TOLERANCE = 1e-6
# Outcomes of the integrator, see fmus/runtime/integrator.h.
_DONE, _EVENT, _NOT_FINITE, _TOO_SMALL, _TOO_MANY = range(5)
_FUNCTIONS = ("SetTime", "SetContinuousStates", "derivatives", "GetEventIndicators", "values that pass between them")
_MOST_EVENTS = 10_000
_MOST_TURNS = 100


class _Member(ctypes.Structure):
    _fields_ = [
        *((name, Pointer) for name in ("instance", "set_time", "set_states", "get_rates", "get_indicators")),
        *((name, ctypes.c_int64) for name in ("n_states", "n_indicators")),
        *((name, ctypes.c_int32) for name in ("number", "unused")),
    ]


class _Memory(ctypes.Structure):
    _fields_ = [("step", Double), ("error", Double), ("implicit", ctypes.c_int), ("evidence", ctypes.c_int)]


class _Group(ctypes.Structure):
    _fields_ = [
        ("members", Pointer),
        *((name, ctypes.c_int64) for name in ("n_members", "n")),
        *((name, Pointer) for name in ("links", "x", "indicators", "work", "at", "nominal", "pivots", "positive")),
        ("n_indicators", ctypes.c_int64),
        *((name, Double) for name in ("tolerance", "time")),
        ("memory", _Memory),
        ("culprit", ctypes.c_int64),
        *((name, ctypes.c_int32) for name in ("failed", "function", "status", "outcome")),
    ]


class Equations:
    """The equations of one FMU or several, with the links between them as operations.

    Method: an explicit Runge-Kutta method of order 5 (Dormand and Prince) that gives way to an implicit one (Rosenbrock) in
    stiff phases, with step-size control; the one that FMUs built here have inside.
    """

    def __init__(
        self,
        instances: Mapping[str, Instance],
        operations: Sequence[Operation] = (),
        size: int = 0,
        numbers: Mapping[str, int] | None = None,
        progress: Progress | None = None,
    ) -> None:
        self.instances = dict(instances)
        self._library = exchange_library()
        self._numbers = numbers or {name: k for k, name in enumerate(instances)}
        self._rows = Rows(self.instances, self._numbers, operations, ranges=False)
        self._progress = progress or Progress()
        self._signals = np.zeros(size + 1)
        self._links = LoopState(
            parts=ctypes.addressof(self._rows.parts),
            operations=ctypes.addressof(self._rows.rows),
            n_operations=len(self._rows.entries),
            signals=self._signals.ctypes.data,
            progress=self._progress.address,
        )
        self.tolerance = _TOLERANCE
        self.time = 0.0
        self.next_event: float | None = None
        # Called before an event is handled, while the indicators still show what crossed.
        self.at_event: Callable[[], None] = _nothing
        self._started: set[str] = set()
        self._terminate = False

    @property
    def needs_completed_step(self) -> bool:
        """Whether an FMU wants to know when an integrator step is done."""
        return any(instance.interface.needs_completed_step for instance in self.instances.values())

    def begin(self, time: float, tolerance: float | None) -> None:
        """Note when the run begins, and its tolerance."""
        self.time, self.tolerance = time, tolerance or _TOLERANCE

    def start(self, name: str) -> None:
        """Note that a member has left initialisation; the last one settles the events at the beginning."""
        self._started.add(name)
        if len(self._started) < len(self.instances):
            return
        self._allocate()
        self._settle()

    def advance(self, time: float, size: float) -> StepEnd:
        """Integrate to `time + size` s, unless that has been done for another member."""
        end = time + size
        # Anything shorter is rounding.
        least = 1e-12 * max(abs(end), size)
        if end - self.time <= least:
            return StepEnd(end)
        if self._check(self._library.exchange_changed(ctypes.byref(self._group), Double(self.time))):
            self._event()
        for _ in range(_MOST_EVENTS):
            self._integrate(end, least)
            if self._terminate:
                return StepEnd(self.time, early=True, terminated=True)
            if end - self.time <= least:
                self._note_time(end)
                return StepEnd(end)
        names = ", ".join(self.instances)
        raise ComponentError(
            f"FMU '{names}' has more than {_MOST_EVENTS} events between t = {time:.9g} s and {self.time:.9g} s"
        )

    def change(self, setting: Callable[[], None]) -> None:
        """Set what may only be set at an event."""
        for instance in self.instances.values():
            instance.call("EnterEventMode")
        setting()
        self._settle()

    def snapshot(self) -> tuple[Any, ...]:
        """What the integrator knows beside the states of the FMUs."""
        return self._x.copy(), bytes(self._group.memory), self._positive.copy(), self.time, self.next_event

    def come_back(self, snapshot: tuple[Any, ...]) -> None:
        """Go back to a snapshot."""
        x, memory, positive, self.time, self.next_event = snapshot
        self._x[:], self._positive[:] = x, positive
        self._group.memory = _Memory.from_buffer_copy(memory)
        self._terminate = False
        self._note_time(self.time)

    def _allocate(self) -> None:
        counts = [(_count(i, "ContinuousStates"), _count(i, "EventIndicators")) for i in self.instances.values()]
        self._counts = counts
        self.n_states = sum(n for n, _ in counts)
        n, n_indicators = max(self.n_states, 1), sum(z for _, z in counts)
        self._x, self._nominal = np.zeros(n), np.ones(n)
        self._indicators, self._positive = np.zeros(n_indicators + 1), np.zeros(n_indicators + 1, dtype=np.int8)
        self._work, self._at, self._pivots = np.zeros((14 + 2 * n) * n), np.zeros(2 * n), np.zeros(n, dtype=np.uintp)
        members = zip(self.instances.items(), counts, strict=True)
        self._members = (_Member * len(self.instances))(*(self._member(*each, *count) for each, count in members))
        self._group = _Group(
            members=ctypes.addressof(self._members),
            n_members=len(self._members),
            n=n,
            links=ctypes.addressof(self._links),
            **{name: getattr(self, f"_{name}").ctypes.data for name in ("x", "indicators", "work", "at", "nominal")},
            **{name: getattr(self, f"_{name}").ctypes.data for name in ("pivots", "positive")},
            n_indicators=n_indicators,
            tolerance=self.tolerance,
        )

    def _member(self, name: str, instance: Instance, n_states: int, n_indicators: int) -> _Member:
        rates = "GetDerivatives" if instance.description.version <= 2 else "GetContinuousStateDerivatives"
        states = (instance.address("SetContinuousStates"), instance.address(rates)) if n_states else (None, None)
        return _Member(
            instance.component.value,
            instance.address("SetTime"),
            *states,
            instance.address("GetEventIndicators") if n_indicators else None,
            n_states,
            n_indicators,
            self._numbers[name],
        )

    def _integrate(self, end: float, least: float) -> None:
        """Up to the end, the next event or the end of an integrator step, with what has to be done there."""
        group, until = self._group, end
        if self.next_event is not None:
            until = min(until, max(self.next_event, self.time))
        if self.needs_completed_step:
            until = min(until, self.time + (group.memory.step or 0.01 * (end - self.time)))
        found = _DONE
        if until - self.time > least:
            found = self._library.exchange_integrate(ctypes.byref(group), Double(self.time), Double(until))
            if found not in (_DONE, _EVENT):
                raise ComponentError(self._explain(found))
            self._note_time(group.time)
        timed = self.next_event is not None and self.next_event - self.time <= least
        if self._completed() or found == _EVENT or timed:
            self._event()

    def _completed(self) -> bool:
        wants = False
        for instance in self.instances.values():
            if instance.interface.needs_completed_step:
                enter, stop = instance.completed_step()
                wants, self._terminate = wants or enter, self._terminate or stop
        return wants

    def _event(self) -> None:
        self.at_event()
        for instance in self.instances.values():
            instance.call("EnterEventMode")
        self._settle()

    def _settle(self) -> None:
        """Update discrete states until nothing changes, and go on with the equations that hold then."""
        for _ in range(_MOST_TURNS):
            events = [instance.update_discrete_states() for instance in self.instances.values()]
            self._terminate = self._terminate or any(event.terminate for event in events)
            before = self._signals.copy()
            self._pass_on()
            if not any(event.again for event in events) and np.array_equal(before, self._signals):
                break
        else:
            raise ComponentError(f"FMU '{', '.join(self.instances)}' finds no end of events at t = {self.time:.9g} s")
        times = [event.next_time for event in events if event.next_time is not None]
        self.next_event = min(times, default=None)
        first = 0
        for instance, (n, _) in zip(self.instances.values(), self._counts, strict=True):
            instance.call("EnterContinuousTimeMode")
            if n:
                for function, array in (
                    ("GetContinuousStates", self._x),
                    ("GetNominalsOfContinuousStates", self._nominal),
                ):
                    address = ctypes.c_void_p(array.ctypes.data + 8 * first)
                    instance.call(function, address, ctypes.c_size_t(n))
            first += n
        # A nominal value of zero or less says nothing.
        self._nominal[:] = np.where(self._nominal > 0.0, self._nominal, 1.0)
        self._check(self._library.exchange_begin(ctypes.byref(self._group), Double(self.time)))

    def _pass_on(self) -> None:
        if self._rows.entries:
            self._links.next = 0
            if self._library.loop_operations(ctypes.byref(self._links), Double(self.time)) != 0:
                raise ComponentError(self._explain_links())

    def _check(self, result: int) -> int:
        if result < 0:
            raise ComponentError(self._explain(_NOT_FINITE))
        return result

    def _note_time(self, time: float) -> None:
        self.time = time
        for instance in self.instances.values():
            instance.time = time

    def _explain(self, outcome: int) -> str:
        group = self._group
        time = float(group.time)
        if outcome == _NOT_FINITE and group.outcome:
            return self._explain_links()
        if outcome == _NOT_FINITE and group.status > 1:
            instance = list(self.instances.values())[group.failed]
            instance.time = time
            return instance.refused(_FUNCTIONS[group.function], group.status)
        name, state = self._state_name(int(group.culprit))
        why = {
            _NOT_FINITE: f"the derivative of {state} is not a finite number",
            _TOO_SMALL: f"the step became too small for {state}",
            _TOO_MANY: f"too many integrator steps; {state} limits them",
        }[outcome]
        return f"FMU '{name}' cannot be integrated on from t = {time:.9g} s: {why}; last good state is t = {self.time:.9g} s"

    def _explain_links(self) -> str:
        name = self._rows.entries[self._links.failed].operation.component
        return f"FMU '{name}' has no finite inputs or outputs at t = {self.time:.9g} s; last good state is t = {self.time:.9g} s"

    def _state_name(self, position: int) -> tuple[str, str]:
        for (name, instance), (n, _) in zip(self.instances.items(), self._counts, strict=True):
            if position < n:
                names = instance.description.state_names
                return name, f"'{names[position]}'" if len(names) == n else f"state {position + 1}"
            position -= n
        return ", ".join(self.instances), "time"


def _nothing() -> None:
    """Nobody looks at events."""


def _count(instance: Instance, what: str) -> int:
    """Number of states or indicators, which in FMI 3 can depend on structural parameters."""
    description = instance.description
    if not description.dimensions:
        return description.n_indicators if what == "EventIndicators" else description.n_states
    found = ctypes.c_size_t()
    instance.call(f"GetNumberOf{what}", ctypes.byref(found))
    return found.value
