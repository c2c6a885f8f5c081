"""FMI 1.0: instances driven through their C functions, most of which are those of FMI 2.0 by other names."""

import ctypes
from collections.abc import Callable, Mapping
from typing import Any, ClassVar

from orchestrator.cosim.component import StepEnd
from orchestrator.cosim.fmu.instance import OK, Double, Event, Instance
from orchestrator.cosim.fmu.instance2 import Instance2, c_memory
from orchestrator.cosim.fmu.messages import logger1, shared_record
from orchestrator.cosim.fmu.unpacked import unpacked

_NAMES = {"Terminate": "TerminateSlave", "FreeInstance": "FreeSlaveInstance"}
_EXCHANGE_NAMES = {"FreeInstance": "FreeModelInstance", "GetNominalsOfContinuousStates": "GetNominalContinuousStates"}
_MODES = ("EnterEventMode", "EnterContinuousTimeMode")


class _Callbacks(ctypes.Structure):
    _fields_ = [(name, ctypes.c_void_p) for name in ("logger", "allocate", "free", "finished")]


class _ExchangeCallbacks(ctypes.Structure):
    _fields_ = _Callbacks._fields_[:3]


class _EventInfo(ctypes.Structure):
    _fields_ = [
        *((name, ctypes.c_byte) for name in ("converged", "references", "states", "terminate", "defined")),
        ("next", Double),
    ]


class Instance1(Instance2):
    """An instance of an FMU of version 1, for co-simulation.

    It has no initialisation mode: it is initialised when that begins, and outputs may follow inputs in a step only. Its
    logger is not told whose message it gets, so the last message may be that of another FMU of version 1.
    """

    prefix = "fmi"
    names: ClassVar[Mapping[str, str]] = _NAMES
    kinds = {**Instance2.kinds, "Boolean": ("Boolean", ctypes.c_byte)}

    def function(self, name: str, result: Any = ctypes.c_int) -> Callable[..., Any]:
        """The C function, without `fmi` in front."""
        return super().function(self.names.get(name, name), result)

    def _instantiate(self) -> int | None:
        self.messages.record = shared_record()
        allocate, free = c_memory()
        address = self.function("InstantiateSlave", ctypes.c_void_p)(
            self.name.encode(),
            self.description.token.encode(),
            unpacked(self.description).as_uri().encode(),
            b"application/x-fmu-sharedlibrary",
            Double(0.0),
            ctypes.c_byte(0),
            ctypes.c_byte(0),
            _Callbacks(logger1(), allocate, free, None),
            ctypes.c_byte(0),
        )
        return address if address is None else int(address)

    def _begin(self, time: float, stop: float | None, tolerance: float | None) -> None:
        self.call("InitializeSlave", Double(time), ctypes.c_byte(stop is not None), Double(stop or 0.0))

    def finish_initialisation(self) -> None:
        """Nothing to do: there is no mode to leave."""
        self._running = True

    def ended_early(self, status: int, time: float, size: float) -> StepEnd:
        """An FMU of version 1 has no way to say that it wants to end."""
        return Instance.ended_early(self, status, time, size)


class ExchangeInstance1(Instance1):
    """An instance of an FMU of version 1, for model exchange.

    It has no modes either, and initialising it deals with the first event.
    """

    names = _EXCHANGE_NAMES

    def call(self, name: str, *arguments: Any, **more: Any) -> int:
        """Call a function of the instance; those that change a mode which it does not have are left out."""
        return OK if name in _MODES else super().call(name, *arguments, **more)

    def _instantiate(self) -> int | None:
        self.messages.record = shared_record()
        self._first: _EventInfo | None = None
        callbacks = _ExchangeCallbacks(logger1(), *c_memory())
        address = self.function("InstantiateModel", ctypes.c_void_p)(
            self.name.encode(), self.description.token.encode(), callbacks, ctypes.c_byte(0)
        )
        return address if address is None else int(address)

    def _begin(self, time: float, stop: float | None, tolerance: float | None) -> None:
        self._first = _EventInfo()
        self.call("SetTime", Double(time))
        given = ctypes.c_byte(tolerance is not None), Double(tolerance or 0.0)
        self.call("Initialize", *given, ctypes.byref(self._first))

    def update_discrete_states(self) -> Event:
        """Deal with an event; the first one is that of the initialisation."""
        info, self._first = self._first, None
        if info is None:
            info = _EventInfo()
            self.call("EventUpdate", ctypes.c_byte(0), ctypes.byref(info))
        return Event(not info.converged, bool(info.terminate), bool(info.states), info.next if info.defined else None)

    def completed_step(self) -> tuple[bool, bool]:
        """Tell that an integrator step is done."""
        enter = ctypes.c_byte()
        self.call("CompletedIntegratorStep", ctypes.byref(enter))
        return bool(enter.value), False
