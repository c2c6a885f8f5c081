"""FMI 1.0 for co-simulation: an instance driven through its C functions, most of which are those of FMI 2.0 by other names."""

import ctypes
from collections.abc import Callable
from typing import Any

from orchestrator.cosim.component import StepEnd
from orchestrator.cosim.fmu.instance import Double, Instance
from orchestrator.cosim.fmu.instance2 import Instance2, c_memory
from orchestrator.cosim.fmu.messages import logger1, shared_record
from orchestrator.cosim.fmu.unpacked import unpacked

_NAMES = {"Terminate": "TerminateSlave", "FreeInstance": "FreeSlaveInstance"}


class _Callbacks(ctypes.Structure):
    _fields_ = [(name, ctypes.c_void_p) for name in ("logger", "allocate", "free", "finished")]


class Instance1(Instance2):
    """An instance of an FMU of version 1.

    It has no initialisation mode: it is initialised when that begins, and outputs may follow inputs in a step only. Its
    logger is not told whose message it gets, so the last message may be that of another FMU of version 1.
    """

    prefix = "fmi"
    kinds = {**Instance2.kinds, "Boolean": ("Boolean", ctypes.c_byte)}

    def function(self, name: str, result: Any = ctypes.c_int) -> Callable[..., Any]:
        """The C function, without `fmi` in front."""
        return super().function(_NAMES.get(name, name), result)

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
