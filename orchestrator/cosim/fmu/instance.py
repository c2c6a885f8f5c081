"""One instance of an FMU, with what FMI 2 and 3 have in common: calls, their failures, the messages of the FMU."""

import ctypes
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from fmus.errors import ComponentError
from fmus.units import after_number
from orchestrator.cosim.component import Port, StepEnd
from orchestrator.cosim.fmu.description import FmuDescription, Interface
from orchestrator.cosim.fmu.messages import Messages
from orchestrator.cosim.fmu.unpacked import load_binary

OK, WARNING, DISCARD, ERROR, FATAL, PENDING = range(6)
STATUS = ("OK", "Warning", "Discard", "Error", "Fatal", "Pending")
Double = ctypes.c_double


@dataclass(frozen=True)
class Event:
    """What an update of discrete states says: whether to repeat it, whether to stop, and the next event's time in s."""

    again: bool
    terminate: bool
    states_changed: bool
    next_time: float | None


@dataclass(frozen=True)
class Access:
    """Variables of one type that are read or written by one call."""

    kind: str
    ports: tuple[Port, ...]
    references: Any
    buffer: Any
    size: int


class Instance(ABC):
    """An instantiated FMU; every method raises ComponentError with the FMU's name, the time and what it says."""

    prefix: ClassVar[str]
    kinds: ClassVar[dict[str, tuple[str, Any]]]  # type -> ending of get and set, C type
    asks_within_steps: ClassVar[bool] = False

    def __init__(
        self, name: str, description: FmuDescription, interface: Interface, early_return: bool = False
    ) -> None:
        self.name, self.description, self.interface = name, description, interface
        self.early_return, self.rolls_back = early_return, False
        self.time = 0.0
        self.messages = Messages()
        # Values of structural parameters, which are sizes of arrays.
        self.structure = {p.name: int(p.start or 0) for p in description.ports if p.causality == "structuralParameter"}
        self.library = load_binary(description, interface)
        self._functions: dict[str, Callable[..., Any]] = {}
        self._running = self._failed = self._dead = False
        self.component = ctypes.c_void_p(self._instantiate())
        if not self.component.value:
            raise ComponentError(self._words("could not be instantiated"))

    def function(self, name: str, result: Any = ctypes.c_int) -> Callable[..., Any]:
        """The C function, without `fmi2` or `fmi3` in front."""
        found = self._functions.get(name)
        if found is None:
            full = self.prefix + name
            # Sources for static linking may carry the identifier in front.
            for symbol in (full, f"{self.interface.identifier}_{full}"):
                try:
                    found = self.library[symbol]
                except AttributeError:
                    continue
                found.restype = result
                self._functions[name] = found
                return found
            raise ComponentError(
                f"FMU '{self.name}' lacks the function {full}, which its description promises; ask its maker"
            )
        return found

    def address(self, name: str) -> int:
        """Address of a C function."""
        return ctypes.cast(self.function(name), ctypes.c_void_p).value or 0  # type: ignore[arg-type]

    def call(self, name: str, *arguments: Any, what: Callable[[], str] | None = None, allowed: int = WARNING) -> int:
        """Call a function of the instance; `what` gives the words behind its name in an error, `allowed` is the worst
        status.

        Args:
            name: name of the function, without `fmi2` or `fmi3`.
            arguments: behind the instance itself.
            what: gives the words behind the name in an error.
            allowed: the worst status that is none.

        Returns:
            The status.

        Raises:
            ComponentError: for a worse one.
        """
        if self._dead:
            raise ComponentError(
                f"FMU '{self.name}' cannot be used any more at t = {self.time:.9g} s: it failed fatally before"
            )
        status = int(self.function(name)(self.component, *arguments))
        if status >= ERROR:
            self.fail(status)
        if status > allowed:
            of = f" of {what()}" if what else ""
            raise ComponentError(
                self._words(f"refused {self.prefix}{name}{of} at t = {self.time:.9g} s: status {_status(status)}")
            )
        return status

    def fail(self, status: int) -> None:
        """Note that a call failed: after an error an FMU may only be freed, after a fatal one not even that."""
        self._failed = self._failed or status >= ERROR
        self._dead = self._dead or status == FATAL

    def refused_step(self, status: int, time: float, size: float) -> ComponentError:
        """The error for a step that failed.

        Args:
            status: what the FMU returned.
            time: beginning of the step, in s.
            size: of the step, in s.
        """
        self.fail(status)
        return ComponentError(
            self._words(
                f"refused the step at t = {time:.9g} s (step {size:.9g} s): status {_status(status)}; "
                f"last good state is t = {time:.9g} s"
            )
        )

    def refused(self, what: str, status: int) -> str:
        """The message for a call that failed elsewhere, in C."""
        self.fail(status)
        return self._words(f"refused {what} at t = {self.time:.9g} s: status {_status(status)}")

    def refused_values(self, verb: str, names: Sequence[str], values: Sequence[Any], status: int) -> str:
        """The message for a read or write of variables of one type that failed elsewhere, in C.

        Args:
            verb: "Get" or "Set".
            names: variables of one type.
            values: what they were to be set to.
            status: what the FMU returned.
        """
        access = self.access(names)[0][0]
        of = named(access, values if verb == "Set" else None)
        function = f"{self.prefix}{verb}{self.kinds[access.kind][0]}"
        return self.refused(f"{function} of {of}", status)

    def ended_early(self, status: int, time: float, size: float) -> StepEnd:
        """What it means that a step was discarded.

        Args:
            status: what the FMU returned.
            time: beginning of the step, in s.
            size: of the step, in s.

        Raises:
            ComponentError: if it means that the FMU cannot do it.
        """
        raise self.refused_step(status, time, size)

    def _words(self, words: str) -> str:
        said = self.messages.last()
        return f"FMU '{self.name}' {words}" + (f"; it says: {said}" if said else "")

    def access(self, names: Sequence[str]) -> list[tuple[Access, list[int]]]:
        """Group variables by type: for each group its buffer and the positions of its variables among `names`."""
        groups: dict[str, list[int]] = {}
        for position, name in enumerate(names):
            try:
                kind = self.description.by_name[name][0].type
            except KeyError:
                raise ComponentError(f"FMU '{self.name}' has no variable {name!r}; see its description") from None
            if kind not in self.kinds:
                raise ComponentError(
                    f"FMU '{self.name}': {name} is a {kind}, which cannot be get or set here; leave it out"
                )
            groups.setdefault(kind, []).append(position)
        found = []
        for kind, positions in groups.items():
            ports = tuple(self.description.by_name[names[k]][0] for k in positions)
            vrs = [self.description.by_name[names[k]][1] for k in positions]
            size = sum(math.prod(self.shape(port)) for port in ports)
            buffer = (self.kinds[kind][1] * size)()
            found.append((Access(kind, ports, (ctypes.c_uint32 * len(vrs))(*vrs), buffer, size), positions))
        return found

    def shape(self, port: Port) -> tuple[int, ...]:
        """Sizes of an array at present, which depend on structural parameters."""
        if not port.shape:
            return ()
        sizes = self.description.dimensions.get(port.name, port.shape)
        return tuple(part if isinstance(part, int) else int(self.structure[part]) for part in sizes)

    def begin(self, time: float, stop: float | None, tolerance: float | None) -> None:
        """Enter initialisation.

        Args:
            time: beginning of the run, in s.
            stop: its end, in s, if it is known.
            tolerance: relative tolerance, if there is one.
        """
        self.time = time
        self._begin(time, stop, tolerance)

    def terminate(self) -> None:
        """End the run where there is one and nothing failed, and free the instance."""
        if self.component.value and self._running and not self._failed:
            self.function("Terminate")(self.component)
        self.free()

    def free(self) -> None:
        """Free the instance; after a fatal failure it can only be forgotten."""
        if self.component.value and not self._dead:
            self.function("FreeInstance", None)(self.component)
        self.component = ctypes.c_void_p()
        self.messages.close()

    def save(self) -> ctypes.c_void_p:
        """The state of the FMU; give it back to `release` when it is not needed any more."""
        state = ctypes.c_void_p()
        self.rolls_back = True
        self.call(self._state("Get"), ctypes.byref(state))
        return state

    def restore(self, state: ctypes.c_void_p) -> None:
        """Set the state of the FMU to a saved one."""
        self.call(self._state("Set"), state)

    def release(self, state: ctypes.c_void_p) -> None:
        """Free a saved state."""
        if self.component.value and not self._dead and state.value:
            self.function(self._state("Free"))(self.component, ctypes.byref(state))

    def directional(self, unknowns: Sequence[str], knowns: Sequence[str], seed: Sequence[float]) -> list[float]:
        """Directional derivative of scalar unknowns by scalar knowns, in a direction.

        Args:
            unknowns: names of n outputs or derivatives.
            knowns: names of m inputs or states.
            seed: the direction, (m,), in their units.

        Returns:
            The change of each unknown, (n,), in its unit.
        """
        rows, columns = ([self.description.by_name[name][1] for name in names] for names in (unknowns, knowns))
        return self.directional_by_reference(rows, columns, seed)

    def directional_by_reference(
        self, unknowns: Sequence[int], knowns: Sequence[int], seed: Sequence[float]
    ) -> list[float]:
        """The same for variables by their value references.

        Args:
            unknowns: value references of n outputs or derivatives.
            knowns: value references of m inputs or states.
            seed: the direction, (m,), in their units.
        """
        rows, columns = ((ctypes.c_uint32 * len(part))(*part) for part in (unknowns, knowns))
        result = (Double * len(unknowns))()
        self._directional(rows, columns, (Double * len(seed))(*seed), result)
        return list(result)

    def reset(self) -> None:
        """Go back to what the instance was when it was made."""
        self.call("Reset")
        self._running = self._failed = False

    @abstractmethod
    def _instantiate(self) -> int | None: ...

    @abstractmethod
    def _begin(self, time: float, stop: float | None, tolerance: float | None) -> None: ...

    @abstractmethod
    def _state(self, verb: str) -> str: ...

    @abstractmethod
    def _directional(self, rows: Any, columns: Any, seed: Any, result: Any) -> None: ...

    def finish_initialisation(self) -> None:
        """Leave initialisation."""
        self.call("ExitInitializationMode")
        self._running = True

    @abstractmethod
    def read(self, access: Access) -> list[Any]:
        """Values of variables: scalars, and arrays of their shape."""

    @abstractmethod
    def write(self, access: Access, values: Sequence[Any]) -> None:
        """Set variables."""

    @abstractmethod
    def step(self, time: float, size: float) -> StepEnd:
        """Advance a co-simulation FMU."""

    @abstractmethod
    def update_discrete_states(self) -> Event:
        """One turn of the event iteration."""

    @abstractmethod
    def completed_step(self) -> tuple[bool, bool]:
        """Tell that an integrator step is done: whether the FMU wants event mode, whether it wants to stop."""


def named(access: Access, values: Sequence[Any] | None = None) -> str:
    """The variables of a call, the first three, with their values where they are given."""
    texts = [f"'{port.name}'" for port in access.ports[:3]]
    if values is not None:
        units = [port.unit for port in access.ports]
        texts = [
            f"{text} = {value!r}{after_number(unit)}" for text, value, unit in zip(texts, values, units, strict=False)
        ]
    rest = len(access.ports) - len(texts)
    return ", ".join(texts) + (f" and {rest} more" if rest else "")


def _status(status: int) -> str:
    return STATUS[status] if 0 <= status < len(STATUS) else str(status)
