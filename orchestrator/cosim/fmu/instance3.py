"""FMI 3.0: an instance driven through its C functions."""

import ctypes
import math
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np

from fmus.errors import ComponentError
from orchestrator.cosim.component import StepEnd
from orchestrator.cosim.fmu.clocks import Clock
from orchestrator.cosim.fmu.description import CO_SIMULATION
from orchestrator.cosim.fmu.instance import DISCARD, ERROR, Access, Double, Event, Instance, named
from orchestrator.cosim.fmu.messages import logger3
from orchestrator.cosim.fmu.unpacked import unpacked

_INTEGERS = {
    f"{sign}Int{bits}": getattr(ctypes, f"c_{sign.lower()}int{bits}") for sign in ("", "U") for bits in (8, 16, 32, 64)
}
Size = ctypes.c_size_t


class Instance3(Instance):
    """An instance of an FMU of version 3."""

    prefix = "fmi3"
    uses_event_mode: ClassVar[bool] = False
    wants_event = False
    kinds = {
        "Float64": ("Float64", ctypes.c_double),
        "Float32": ("Float32", ctypes.c_float),
        **{name: (name, kind) for name, kind in _INTEGERS.items()},
        "Enumeration": ("Int64", ctypes.c_int64),
        "Boolean": ("Boolean", ctypes.c_bool),
        "String": ("String", ctypes.c_char_p),
        "Binary": ("Binary", ctypes.c_void_p),
    }

    def _instantiate(self) -> int | None:
        clocks = [port.name for port in self.description.ports if port.type == "Clock"]
        stepping = self.interface.kind == CO_SIMULATION
        if clocks and not stepping:
            raise ComponentError(
                f"FMU '{self.name}' has clocks ({', '.join(clocks[:3])}), which model exchange cannot use here; run it by co-simulation"
            )
        resources = unpacked(self.description) / "resources"
        # FMI 3 wants the separator at the end.
        folder = f"{resources}/".encode() if resources.is_dir() else None
        head = (self.name.encode(), self.description.token.encode(), folder, ctypes.c_bool(False), ctypes.c_bool(False))
        # Without event mode the FMU handles its events itself.
        flags = (ctypes.c_bool(self.uses_event_mode), ctypes.c_bool(self.early_return)) if stepping else ()
        *wanted, asked = self._intermediate() if stepping else (None,)
        tail = (self.messages.environment, logger3(), *((asked,) if stepping else ()))
        address = self.function(f"Instantiate{self.interface.kind}", ctypes.c_void_p)(*head, *flags, *wanted, *tail)
        return address if address is None else int(address)

    def _intermediate(self) -> tuple[Any, Any, Any]:
        """Variables that are wanted within steps, how many, and what the FMU calls there: nothing."""
        return None, Size(0), None

    def configure(self, names: Sequence[str], values: Sequence[int]) -> None:
        """Set structural parameters, before initialisation; arrays change their sizes."""
        self.call("EnterConfigurationMode")
        for access, positions in self.access(names):
            self.write(access, [values[k] for k in positions])
        self.call("ExitConfigurationMode")
        self.structure.update(zip(names, map(int, values), strict=True))

    def _begin(self, time: float, stop: float | None, tolerance: float | None) -> None:
        self.call(
            "EnterInitializationMode",
            *(ctypes.c_bool(tolerance is not None), Double(tolerance or 0.0)),
            *(Double(time), ctypes.c_bool(stop is not None), Double(stop or 0.0)),
        )

    def read(self, access: Access) -> list[Any]:
        sizes = (Size * access.size)() if access.kind == "Binary" else None
        self._call("Get", access, access.buffer, sizes, None)
        flat: list[Any]
        if sizes is not None:
            flat = [ctypes.string_at(p, n) if p else b"" for p, n in zip(access.buffer, sizes, strict=True)]
        elif access.kind == "String":
            flat = [(value or b"").decode("utf-8", "replace") for value in access.buffer]
        else:
            flat = list(access.buffer)
        return (
            flat
            if access.size == len(access.ports) and not any(p.shape for p in access.ports)
            else self._shaped(access, flat)
        )

    def _shaped(self, access: Access, flat: list[Any]) -> list[Any]:
        values: list[Any] = []
        first = 0
        for port in access.ports:
            shape = self.shape(port)
            count = math.prod(shape)
            kind = object if access.kind in ("String", "Binary") else None
            part = flat[first : first + count]
            values.append(np.array(part, dtype=kind).reshape(shape) if port.shape else part[0])
            first += count
        return values

    def write(self, access: Access, values: Sequence[Any]) -> None:
        flat: list[Any] = []
        for port, value in zip(access.ports, values, strict=True):
            if not port.shape:
                flat.append(value)
                continue
            part = np.broadcast_to(np.asarray(value), self.shape(port)) if np.ndim(value) == 0 else np.asarray(value)
            flat += part.ravel().tolist()
        if len(flat) != access.size:
            raise ComponentError(
                f"FMU '{self.name}': {named(access)} has {access.size} elements, got {len(flat)}; give an array of its shape"
            )
        buffer, sizes = access.buffer, None
        if access.kind == "Binary":
            kept = [ctypes.create_string_buffer(value, max(len(value), 1)) for value in flat]
            buffer[:] = [ctypes.addressof(part) for part in kept]
            sizes = (Size * access.size)(*(len(value) for value in flat))
        else:
            buffer[:] = [value.encode() for value in flat] if access.kind == "String" else flat
        self._call("Set", access, buffer, sizes, values)

    def _call(self, verb: str, access: Access, buffer: Any, sizes: Any, values: Sequence[Any] | None) -> None:
        middle = () if sizes is None else (sizes,)
        self.call(
            f"{verb}{self.kinds[access.kind][0]}",
            *(access.references, Size(len(access.references)), *middle, buffer, Size(access.size)),
            what=lambda: named(access, values),
        )

    def _state(self, verb: str) -> str:
        return f"{verb}FMUState"

    def _directional(self, rows: Any, columns: Any, seed: Any, result: Any) -> None:
        n, m = Size(len(rows)), Size(len(columns))
        self.call("GetDirectionalDerivative", rows, n, columns, m, seed, m, result, n)

    def step(self, time: float, size: float) -> StepEnd:
        event, terminate, early = ctypes.c_bool(), ctypes.c_bool(), ctypes.c_bool()
        last = Double(time)
        self.time = time
        results = (ctypes.byref(part) for part in (event, terminate, early, last))
        forward = ctypes.c_bool(not self.rolls_back)
        status = self.call("DoStep", Double(time), Double(size), forward, *results, allowed=ERROR)
        if status >= DISCARD and not (status == DISCARD and terminate.value):
            raise self.refused_step(status, time, size)
        self.wants_event = event.value
        short = early.value and last.value < time + size
        self.time = last.value if short or terminate.value else time + size
        return StepEnd(self.time, early=short, terminated=terminate.value)

    def interval(self, clock: Clock) -> tuple[float, int]:
        """Interval of a clock in s and its qualifier: not yet known, unchanged or changed."""
        reference, found, qualifier = ctypes.c_uint32(clock.reference), Double(), ctypes.c_int()
        places = ctypes.byref(reference), Size(1), ctypes.byref(found), ctypes.byref(qualifier)
        self.call("GetIntervalDecimal", *places, what=lambda: f"'{clock.name}'")
        return found.value, qualifier.value

    def update_discrete_states(self) -> Event:
        flags = [ctypes.c_bool() for _ in range(5)]
        next_time = Double()
        self.call("UpdateDiscreteStates", *(ctypes.byref(flag) for flag in flags), ctypes.byref(next_time))
        again, terminate, _, changed, defined = (flag.value for flag in flags)
        return Event(again, terminate, changed, next_time.value if defined else None)

    def completed_step(self) -> tuple[bool, bool]:
        enter, stop = ctypes.c_bool(), ctypes.c_bool()
        self.call("CompletedIntegratorStep", ctypes.c_bool(True), ctypes.byref(enter), ctypes.byref(stop))
        return enter.value, stop.value
