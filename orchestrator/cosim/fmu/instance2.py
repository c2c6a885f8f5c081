"""FMI 2.0: an instance driven through its C functions."""

import ctypes
from collections.abc import Sequence
from typing import Any

from orchestrator.cosim.component import StepEnd
from orchestrator.cosim.fmu.description import CO_SIMULATION
from orchestrator.cosim.fmu.instance import DISCARD, ERROR, OK, Access, Double, Event, Instance, named
from orchestrator.cosim.fmu.messages import logger2
from orchestrator.cosim.fmu.unpacked import unpacked

_LAST_TIME, _TERMINATED = 2, 3
# The instance keeps pointers to the C library's own functions, which live as long as the process.
_libc = ctypes.CDLL(None)


def c_memory() -> tuple[ctypes.c_void_p, ctypes.c_void_p]:
    """Addresses of `calloc` and `free`."""
    return ctypes.cast(_libc.calloc, ctypes.c_void_p), ctypes.cast(_libc.free, ctypes.c_void_p)


class _Callbacks(ctypes.Structure):
    _fields_ = [(name, ctypes.c_void_p) for name in ("logger", "allocate", "free", "finished", "environment")]


class _EventInfo(ctypes.Structure):
    _fields_ = [
        *((name, ctypes.c_int) for name in ("again", "terminate", "nominals", "states", "defined")),
        ("next", Double),
    ]


class Instance2(Instance):
    """An instance of an FMU of version 2."""

    prefix = "fmi2"
    kinds = {
        "Float64": ("Real", ctypes.c_double),
        "Int32": ("Integer", ctypes.c_int),
        "Enumeration": ("Integer", ctypes.c_int),
        "Boolean": ("Boolean", ctypes.c_int),
        "String": ("String", ctypes.c_char_p),
    }

    def _instantiate(self) -> int | None:
        self._callbacks = _Callbacks(logger2(), *c_memory(), None, self.messages.environment)
        resources = unpacked(self.description) / "resources"
        address = self.function("Instantiate", ctypes.c_void_p)(
            self.name.encode(),
            1 if self.interface.kind == CO_SIMULATION else 0,
            self.description.token.encode(),
            resources.as_uri().encode(),
            ctypes.byref(self._callbacks),
            0,
            0,
        )
        return address if address is None else int(address)

    def _begin(self, time: float, stop: float | None, tolerance: float | None) -> None:
        self.call(
            "SetupExperiment",
            *(int(tolerance is not None), Double(tolerance or 0.0)),
            *(Double(time), int(stop is not None), Double(stop or 0.0)),
        )
        self.call("EnterInitializationMode")

    def read(self, access: Access) -> list[Any]:
        self.call(f"Get{self.kinds[access.kind][0]}", *_group(access), access.buffer, what=lambda: named(access))
        if access.kind == "String":
            return [(value or b"").decode("utf-8", "replace") for value in access.buffer]
        return [bool(v) for v in access.buffer] if access.kind == "Boolean" else list(access.buffer)

    def write(self, access: Access, values: Sequence[Any]) -> None:
        buffer = access.buffer
        buffer[:] = [value.encode() for value in values] if access.kind == "String" else list(values)
        self.call(f"Set{self.kinds[access.kind][0]}", *_group(access), buffer, what=lambda: named(access, values))

    def _state(self, verb: str) -> str:
        return f"{verb}FMUstate"

    def _directional(self, rows: Any, columns: Any, seed: Any, result: Any) -> None:
        sizes = ctypes.c_size_t(len(rows)), ctypes.c_size_t(len(columns))
        self.call("GetDirectionalDerivative", rows, sizes[0], columns, sizes[1], seed, result)

    def step(self, time: float, size: float) -> StepEnd:
        self.time = time
        status = self.call("DoStep", Double(time), Double(size), int(not self.rolls_back), allowed=ERROR)
        if status < DISCARD:
            self.time = time + size
            return StepEnd(self.time)
        return self.ended_early(status, time, size)

    def ended_early(self, status: int, time: float, size: float) -> StepEnd:
        """Ask how far a discarded step got, and whether the FMU wants to end the run."""
        terminated, last = ctypes.c_int(0), Double(time)
        if status == DISCARD:
            ends = self.function("GetBooleanStatus")(self.component, _TERMINATED, ctypes.byref(terminated)) == OK
            known = self.function("GetRealStatus")(self.component, _LAST_TIME, ctypes.byref(last)) == OK
            if (ends and terminated.value) or (known and last.value > time):
                self.time = last.value if known else time
                return StepEnd(self.time, early=True, terminated=bool(ends and terminated.value))
        raise self.refused_step(status, time, size)

    def slopes(self, references: Any, values: Sequence[float]) -> None:
        """Set the derivatives of inputs by time, for FMUs that interpolate their inputs."""
        n = len(references)
        orders = (ctypes.c_int * n)(*([1] * n))
        self.call("SetRealInputDerivatives", references, ctypes.c_size_t(n), orders, (Double * n)(*values))

    def update_discrete_states(self) -> Event:
        info = _EventInfo()
        self.call("NewDiscreteStates", ctypes.byref(info))
        return Event(bool(info.again), bool(info.terminate), bool(info.states), info.next if info.defined else None)

    def completed_step(self) -> tuple[bool, bool]:
        enter, stop = ctypes.c_int(), ctypes.c_int()
        self.call("CompletedIntegratorStep", 1, ctypes.byref(enter), ctypes.byref(stop))
        return bool(enter.value), bool(stop.value)


def _group(access: Access) -> tuple[Any, ctypes.c_size_t]:
    return access.references, ctypes.c_size_t(len(access.references))
