"""One running instance of either FMI version, through FMPy."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from ctypes import c_double, c_uint
from typing import Any

from fmus.checks.subject import Numbers, Subject


class Instance:
    """An instance in initialization mode; `initialized` brings it to the mode in which it runs."""

    def __init__(self, subject: Subject, kind: str, tolerance: float | None = None) -> None:
        from fmpy import instantiate_fmu  # type: ignore[import-untyped]

        self.subject, self.kind = subject, kind
        self.events = kind == "CoSimulation" and subject.has_clocks
        more = {"event_mode_used": True} if self.events else {}
        self.fmu = instantiate_fmu(str(subject.folder), subject.description, fmi_type=kind, **more)
        self.second = subject.description.fmiVersion == "2.0"
        if self.second:
            self.fmu.setupExperiment(startTime=subject.start, tolerance=tolerance)
            self.fmu.enterInitializationMode()
        else:
            self.fmu.enterInitializationMode(startTime=subject.start, tolerance=tolerance)

    def initialized(self) -> "Instance":
        """Leave initialization; model exchange goes on to continuous time."""
        self.fmu.exitInitializationMode()
        if self.kind == "ModelExchange" or self.events:
            self._settle()
        return self

    def _settle(self) -> None:
        """End the event mode, in which no clock ticks here but those of the FMU itself."""
        update = self.fmu.newDiscreteStates if self.second else self.fmu.updateDiscreteStates
        while update()[0]:
            pass
        if self.events:
            self.fmu.enterStepMode()
        else:
            self.fmu.enterContinuousTimeMode()

    def get(self, numbers: Sequence[Numbers]) -> list[float]:
        """Values of all elements, one after the other."""
        references = [n.variable.valueReference for n in numbers]
        if not references:
            return []
        if self.second:
            return list(self.fmu.getReal(references))
        return list(self.fmu.getFloat64(references, sum(n.size for n in numbers)))

    def set(self, number: Numbers, values: Sequence[float]) -> None:
        """Set all elements of one variable."""
        write = self.fmu.setReal if self.second else self.fmu.setFloat64
        write([number.variable.valueReference], list(values))

    def step(self, time: float, size: float) -> None:
        """Advance co-simulation by `size` s, in several calls where the FMU returns early."""
        end = time + size
        while time < end - 1e-9 * size:
            result = self.fmu.doStep(time, end - time)
            if self.events and result[0]:
                self.fmu.enterEventMode()
                self._settle()
            if self.second or result is None or not result[2]:
                return
            time = float(result[3])

    def states(self) -> list[float]:
        """Continuous states."""
        n = self.number_of_states
        values = (c_double * n)()
        self.fmu.getContinuousStates(values, n)
        return list(values)

    def set_states(self, values: Sequence[float]) -> None:
        """Set the continuous states."""
        self.fmu.setContinuousStates((c_double * len(values))(*values), len(values))

    @property
    def number_of_states(self) -> int:
        """Number of continuous states, arrays counted by element."""
        return int(self.subject.description.numberOfContinuousStates)

    def directional(self, unknowns: Sequence[Numbers], known: Numbers, seed: Sequence[float]) -> list[float]:
        """Change of all elements of the unknowns when one variable changes by `seed`."""
        references = [n.variable.valueReference for n in unknowns]
        result = (c_double * sum(n.size for n in unknowns))()
        rows, column = (c_uint * len(references))(*references), (c_uint * 1)(known.variable.valueReference)
        given = (c_double * len(seed))(*seed)
        component = self.fmu.component
        if self.second:
            self.fmu.fmi2GetDirectionalDerivative(component, rows, len(rows), column, 1, given, result)
        else:
            sizes = (len(seed), result, len(result))
            self.fmu.fmi3GetDirectionalDerivative(component, rows, len(rows), column, 1, given, *sizes)
        return list(result)

    def save(self) -> Any:
        """A snapshot."""
        return self.fmu.getFMUstate() if self.second else self.fmu.getFMUState()

    def restore(self, state: Any) -> None:
        """Go back to a snapshot and free it."""
        if self.second:
            self.fmu.setFMUstate(state)
            self.fmu.freeFMUstate(state)
        else:
            self.fmu.setFMUState(state)
            self.fmu.freeFMUState(state)

    def to_bytes(self) -> bytes:
        """The present state, serialised."""
        state = self.save()
        content: bytes = self.fmu.serializeFMUstate(state) if self.second else self.fmu.serializeFMUState(state)
        (self.fmu.freeFMUstate if self.second else self.fmu.freeFMUState)(state)
        return content

    def from_bytes(self, content: bytes) -> None:
        """Go to a serialised state."""
        read = self.fmu.deSerializeFMUstate if self.second else self.fmu.deserializeFMUState
        self.restore(read(content))

    def end(self) -> None:
        """Terminate and free."""
        self.fmu.terminate()
        self.fmu.freeInstance()


@contextmanager
def running(subject: Subject, kind: str, tolerance: float | None = None) -> Iterator[Instance]:
    """An initialized instance, freed at the end unless something went wrong with it."""
    instance = Instance(subject, kind, tolerance).initialized()
    yield instance
    instance.end()
