"""A coupled system that cannot be one FMU, in the child process that otherwise runs one: the same calls, answered by a co-simulation."""

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fmus.errors import MisfitError
from orchestrator.blackbox.exposed import Exposed
from orchestrator.cosim.simulation import SavedPoint, Simulation
from orchestrator.cosim.system import Value, split_address
from orchestrator.cosim.wiring import OUTSIDE, Link, Slot

OK, ERROR = 0, 3
_REFERENCES, _DOUBLES = ctypes.POINTER(ctypes.c_uint), ctypes.POINTER(ctypes.c_double)
_VALUES = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, _REFERENCES, ctypes.c_size_t, _DOUBLES)
_STEP = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_double, ctypes.c_double, ctypes.c_int)


@dataclass
class _Handle:
    """What the caller of an FMU holds of it."""

    owner: "SystemInstance"
    component: int = 0

    def reset(self) -> None:
        self.owner.drop()


@dataclass
class SystemInstance:
    """A system with the calls of an FMI 2.0 co-simulation, for `runner.c`; run again and again."""

    exposed: Exposed
    second: bool = True
    cosimulation: bool = True
    interpolates: bool = False
    resets: bool | None = True
    _simulation: Simulation | None = None
    _points: dict[Any, SavedPoint] = field(default_factory=dict)
    _of: Any = None
    _sources: list[Slot] = field(default_factory=list)
    _driving: list[list[Link]] = field(default_factory=list)
    _last: dict[int, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.fmu = _Handle(self)
        self._set, self._get, self._step = _VALUES(self._write), _VALUES(self._read), _STEP(self._advance)

    def numbers(self, references: Sequence[int]) -> Sequence[int]:
        """They are those of the description."""
        return references

    def begin(
        self, time: float, settings: dict[int, list[float]], inputs: tuple[Sequence[int], Sequence[float]] = ((), ())
    ) -> None:
        """Start a run at a time, with start values and first inputs by reference; a start that was there before is returned to."""
        given = {**settings, **{r: [v] for r, v in zip(*inputs, strict=True)}}
        key = (time, tuple(sorted((r, tuple(v)) for r, v in given.items())))
        self._last = {}
        if self._simulation is not None and self._of == key and key in self._points:
            self._simulation.restore(self._points[key])
            return
        self.drop()
        first = len(self.exposed.inputs) + len(self.exposed.outputs)
        starts = {
            self.exposed.inputs[r] if r < first else self.exposed.starts[r - first]: Value(v[0])
            for r, v in given.items()
        }
        system = self.exposed.system.with_values(starts)
        self._simulation = Simulation(replace(system, run=replace(system.run, start=time, stop=None)), record=[])
        self._simulation.initialise()
        self._of = key
        wiring = self._simulation.coupling.wiring
        self._sources = [wiring.by_address[OUTSIDE, name] for name in self.exposed.inputs]
        self._driving = [[link for link in wiring.links if link.source is source] for source in self._sources]
        if all(component.can_save for component in self._simulation.coupling.components.values()):
            self._points = {key: self._simulation.save()}

    def set(self, references: Sequence[int], values: Sequence[float]) -> None:
        """Set inputs."""
        assert self._simulation is not None
        coupling, before = self._simulation.coupling, dict(self._last)
        for reference, value in zip(references, values, strict=True):
            if self._last.get(reference) == value:
                continue
            self._last[reference] = value
            coupling.store(self._sources[reference], value)
            for link in self._driving[reference]:
                coupling.copy([link])
                coupling.components[link.target.component].set([link.target.port.name], [coupling.fetch(link.target)])
        if self._last != before:
            self._simulation.evaluate()

    def get(self, references: Sequence[int], count: int) -> np.ndarray:
        """Values of outputs at the time reached, for the inputs set last."""
        assert self._simulation is not None
        components, first = self._simulation.coupling.components, len(self.exposed.inputs)
        wanted: dict[str, list[str]] = {}
        addresses = [split_address(self.exposed.outputs[reference - first]) for reference in references]
        for component, variable in addresses:
            wanted.setdefault(component, []).append(variable)
        found = {c: dict(zip(names, components[c].get(names), strict=True)) for c, names in wanted.items()}
        return np.array([found[component][variable] for component, variable in addresses], dtype=float)

    def states(self, count: int) -> np.ndarray:
        """None are shown."""
        return np.zeros(0)

    def address(self, second: str, third: str) -> int | None:
        """Address of the function that stands for one of FMI."""
        function = {"SetReal": self._set, "GetReal": self._get, "DoStep": self._step}[second]
        return ctypes.cast(function, ctypes.c_void_p).value

    def drop(self) -> None:
        """End the present simulation; after a failure it may not go on."""
        if self._simulation is not None:
            self._simulation.close()
        self._simulation, self._points, self._of = None, {}, None

    def _write(self, handle: Any, references: Any, count: int, values: Any) -> int:
        return self._guarded(lambda: self.set(references[:count], values[:count]))

    def _read(self, handle: Any, references: Any, count: int, values: Any) -> int:
        def read() -> None:
            for k, value in enumerate(self.get(references[:count], count)):
                values[k] = value

        return self._guarded(read)

    def _advance(self, handle: Any, time: float, size: float, keep: int) -> int:
        def advance() -> None:
            assert self._simulation is not None
            if not self._simulation.run(time + size):
                raise MisfitError(self._simulation.ended)

        return self._guarded(advance)

    def _guarded(self, call: Any) -> int:
        """Nothing may be raised through C."""
        try:
            call()
        except Exception:
            return ERROR
        return OK
