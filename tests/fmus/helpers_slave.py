"""An FMU driven through its C interface, without a wrapper that would catch bad calls first."""

import ctypes
from collections.abc import Sequence
from ctypes import byref, c_char_p, c_double, c_int, c_size_t, c_uint, c_void_p
from pathlib import Path
from types import TracebackType
from typing import Self

import fmpy  # type: ignore[import-untyped]
from fmpy.fmi2 import fmi2CallbackFunctions, fmi2CallbackLoggerTYPE  # type: ignore[import-untyped]

from fmus.archive import extract_fmu

OK, DISCARD, ERROR = 0, 2, 3
MODEL_EXCHANGE, CO_SIMULATION = 0, 1


class Slave:
    """One instance; `call` gives the status, the other methods insist on success."""

    def __init__(self, fmu: Path, folder: Path, kind: int = CO_SIMULATION) -> None:
        if not folder.exists():  # a second instance is to share the library of the first
            extract_fmu(fmu, folder)
        description = fmpy.read_model_description(str(folder))
        self.references = {v.name: v.valueReference for v in description.modelVariables}
        identifier = description.coSimulation.modelIdentifier
        self.library = ctypes.CDLL(str(folder / f"binaries/{fmpy.platform}/{identifier}.so"))
        self.messages: list[str] = []
        self.logged: list[tuple[int, str]] = []  # status and category of each message
        self.callbacks = fmi2CallbackFunctions(logger=fmi2CallbackLoggerTYPE(self._log))
        self.library.fmi2Instantiate.restype = c_void_p
        self.component = c_void_p(self.instantiate(description.guid, kind))
        self.time = 0.0

    def _log(self, _: object, name: bytes, status: int, category: bytes, message: bytes) -> None:
        self.logged.append((status, category.decode()))
        self.messages.append(message.decode())

    def instantiate(self, guid: str, kind: int = CO_SIMULATION) -> int | None:
        address: int | None = self.library.fmi2Instantiate(
            b"slave", kind, guid.encode(), b"", byref(self.callbacks), 0, 0
        )
        return address

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.library.fmi2FreeInstance(self.component)

    def call(self, function: str, *arguments: object) -> int:
        return int(getattr(self.library, function)(self.component, *arguments))

    def insist(self, function: str, *arguments: object) -> None:
        assert self.call(function, *arguments) == OK, self.messages

    def start(self, tolerance: float = 1e-8, **values: float) -> Self:
        self.insist(
            "fmi2SetupExperiment",
            1,
            c_double(tolerance),
            c_double(0.0),
            0,
            c_double(0.0),
        )
        self.set(**values)
        self.insist("fmi2EnterInitializationMode")
        self.insist("fmi2ExitInitializationMode")
        return self

    def set(self, **values: float) -> None:
        for name, value in values.items():
            self.insist("fmi2SetReal", *self.one(name), byref(c_double(value)))

    def slope(self, **values: float) -> None:
        for name, value in values.items():
            self.insist(
                "fmi2SetRealInputDerivatives",
                *self.one(name),
                byref(c_int(1)),
                byref(c_double(value)),
            )

    def get(self, name: str) -> float:
        value = c_double()
        self.insist("fmi2GetReal", *self.one(name), byref(value))
        return value.value

    def one(self, name: str) -> tuple[object, c_size_t]:
        return byref(c_uint(self.references[name])), c_size_t(1)

    def directional(self, unknowns: Sequence[str], knowns: Sequence[str], seed: Sequence[float]) -> list[float]:
        """Change of the unknowns when the knowns change by `seed`."""
        change = (c_double * len(unknowns))()
        self.insist(
            "fmi2GetDirectionalDerivative",
            (c_uint * len(unknowns))(*(self.references[name] for name in unknowns)),
            c_size_t(len(unknowns)),
            (c_uint * len(knowns))(*(self.references[name] for name in knowns)),
            c_size_t(len(knowns)),
            (c_double * len(knowns))(*seed),
            change,
        )
        return list(change)

    def step(self, size: float) -> None:
        self.insist("fmi2DoStep", c_double(self.time), c_double(size), 1)
        self.time += size

    def save(self) -> c_void_p:
        state = c_void_p()
        self.insist("fmi2GetFMUstate", byref(state))
        return state

    def to_bytes(self, state: c_void_p) -> bytes:
        size = c_size_t()
        self.insist("fmi2SerializedFMUstateSize", state, byref(size))
        content = ctypes.create_string_buffer(size.value)
        self.insist("fmi2SerializeFMUstate", state, content, size)
        return content.raw

    def from_bytes(self, content: bytes) -> c_void_p:
        state = c_void_p()
        self.insist(
            "fmi2DeSerializeFMUstate",
            c_char_p(content),
            c_size_t(len(content)),
            byref(state),
        )
        return state
