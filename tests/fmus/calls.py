"""Calls of an FMU's functions in any order with any arguments; run as a process of its own, which an FMU may crash.

`python calls.py FOLDER MODE SEEDS` prints what is wrong as a JSON list; MODE is `phases`, `arguments` or `random`.
"""

import ctypes
import itertools
import json
import math
import random
import sys
from collections.abc import Callable, Iterator
from ctypes import byref, c_bool, c_char, c_char_p, c_double, c_int, c_size_t, c_uint, c_void_p
from pathlib import Path
from typing import Any

import fmpy  # type: ignore[import-untyped]
from calls_tables import FMI2, FMI3, Table
from fmpy.fmi2 import fmi2CallbackFunctions, fmi2CallbackLoggerTYPE, fmi2EventInfo  # type: ignore[import-untyped]
from fmpy.fmi3 import fmi3LogMessageCallback  # type: ignore[import-untyped]

OK, WARNING, DISCARD, ERROR = range(4)
UNKNOWN = 4_000_000_000
NULL = c_void_p(None)


class Calls:
    """The library of an unpacked FMU, and messages of the instance in use."""

    def __init__(self, folder: Path) -> None:
        self.description = fmpy.read_model_description(str(folder))
        second = self.description.fmiVersion == "2.0"
        self.table: Table = FMI2 if second else FMI3
        self.boolean: Any = c_int if second else c_bool
        (binary,) = folder.glob(f"binaries/*/*{fmpy.sharedLibraryExtension}")
        self.library = ctypes.CDLL(str(binary))
        self.messages: list[str] = []
        variables = self.description.modelVariables
        self.input = next(v.valueReference for v in variables if v.causality == "input")
        self.output = next(v.valueReference for v in variables if v.causality == "output" and v.derivative is None)
        self.derivative = next(v.valueReference for v in variables if v.derivative is not None)
        self.indicators = self.description.numberOfEventIndicators
        self.logger: Any
        if second:
            self.logger = fmi2CallbackLoggerTYPE(lambda *a: self.messages.append(a[4].decode()))
            self.callbacks = fmi2CallbackFunctions(logger=self.logger)
        else:
            self.logger = fmi3LogMessageCallback(lambda *a: self.messages.append(a[3].decode()))

    def instance(self, kind: str) -> c_void_p:
        """A new instance for `exchange` or `stepping`."""
        self.messages.clear()
        token = self.description.guid.encode()
        if self.table is FMI2:
            create = self.library.fmi2Instantiate
            create.restype = c_void_p
            number = c_int(0 if kind == "exchange" else 1)
            return c_void_p(create(b"one", number, token, b"", byref(self.callbacks), c_int(0), c_int(0)))
        head: tuple[Any, ...] = (b"one", token, None, c_bool(False), c_bool(False))
        if kind == "exchange":
            create, middle = self.library.fmi3InstantiateModelExchange, ()
        else:
            create = self.library.fmi3InstantiateCoSimulation
            middle = (c_bool(self.indicators > 0), c_bool(True), None, c_size_t(0))
        create.restype = c_void_p
        tail = () if kind == "exchange" else (None,)
        return c_void_p(create(*head, *middle, None, self.logger, *tail))

    def in_phase(self, kind: str, phase: str) -> c_void_p:
        """A new instance that has been taken to a phase by allowed calls."""
        instance = self.instance(kind)
        event_mode = self.table is FMI3 and self.indicators > 0
        for name in self.table.way(kind, phase, event_mode):
            if self.call(instance, name, *self.good(name)) != OK:
                raise RuntimeError(f"{kind}: {name} on the way to {phase} failed: {self.messages}")
        self.messages.clear()
        return instance

    def call(self, instance: c_void_p, name: str, *arguments: Any) -> int:
        return int(getattr(self.library, name)(instance, *arguments))

    def free(self, instance: c_void_p) -> None:
        getattr(self.library, self.table.prefix + "FreeInstance")(instance)

    def good(self, name: str) -> list[Any]:
        return [self.values(kind)[0] for kind in self.table.arguments[name]]

    def values(self, kind: str) -> list[Any]:
        """A right argument of a kind, and wrong ones."""
        truth = self.boolean
        makers: dict[str, Callable[[], list[Any]]] = {
            "true": lambda: [truth(1)],
            "false": lambda: [truth(0)],
            "start": lambda: [c_double(0.0), c_double(math.nan), c_double(math.inf)],
            "stop": lambda: [c_double(10.0), c_double(-1.0), c_double(math.nan)],
            "tolerance": lambda: [c_double(1e-6), c_double(-1.0), c_double(math.nan), c_double(2.0)],
            "time": lambda: [c_double(0.0), c_double(math.nan), c_double(-math.inf)],
            "now": lambda: [c_double(0.0), c_double(5.0), c_double(math.nan)],
            "step": lambda: [c_double(0.1), c_double(-0.1), c_double(0.0), c_double(math.nan), c_double(1e9)],
            "one": lambda: [c_size_t(1)],
            "none": lambda: [c_size_t(0)],
            "inputs": lambda: [(c_uint * 1)(self.input), NULL, (c_uint * 1)(UNKNOWN)],
            "outputs": lambda: [(c_uint * 1)(self.output), NULL, (c_uint * 1)(UNKNOWN)],
            "known": lambda: [(c_uint * 1)(self.input), NULL, (c_uint * 1)(UNKNOWN), (c_uint * 1)(self.derivative)],
            "unknown": lambda: [(c_uint * 1)(self.derivative), NULL, (c_uint * 1)(UNKNOWN), (c_uint * 1)(self.input)],
            "value": lambda: [(c_double * 1)(0.5), NULL, (c_double * 1)(math.nan), (c_double * 1)(math.inf)],
            "orders": lambda: [(c_int * 1)(1), NULL, (c_int * 1)(2)],
            "room": lambda: [(c_double * 4)(), NULL],
            "space": lambda: [(c_double * 4)()],  # NULL is right where there is nothing to write
            "flag": lambda: [byref(truth(0)), NULL],
            "size": lambda: [byref(c_size_t(0)), NULL],
            "state_count": lambda: [c_size_t(1), c_size_t(2), c_size_t(0)],
            "indicator_count": lambda: [c_size_t(self.indicators), c_size_t(self.indicators + 1)],
            "info": lambda: [byref(fmi2EventInfo()), NULL],
            "new_state": lambda: [byref(c_void_p()), NULL, byref(c_void_p(0x1234))],
            "no_state": lambda: [byref(c_void_p()), NULL, byref(c_void_p(0x1234))],
            "state": lambda: [c_void_p(0x1234), NULL],
            "bytes": lambda: [(c_char * 4000)(), NULL],
            "byte_count": lambda: [c_size_t(4000), c_size_t(3)],
            "categories": lambda: [(c_char_p * 1)(b"logAll"), NULL, (c_char_p * 1)(b"nonsense"), (c_char_p * 1)(None)],
            "successful": lambda: [c_int(2)],
            "terminated": lambda: [c_int(3)],
        }
        return makers[kind]()


def wrong_phases(calls: Calls) -> Iterator[str]:
    """Calls in phases that the standard does not allow them in."""
    for kind, phase in calls.table.phases:
        for name, allowed in calls.table.allowed.items():
            instance = calls.in_phase(kind, phase)
            status = calls.call(instance, name, *calls.good(name))
            if phase in allowed.get(kind, ()):
                if status != OK:
                    yield f"{name} {kind} {phase}: status {status}, {calls.messages}"
            elif status != ERROR or not any(m.startswith(f"{name}: ") for m in calls.messages):
                yield f"{name} {kind} {phase}: not refused, status {status}, {calls.messages}"
            calls.free(instance)


def wrong_arguments(calls: Calls) -> Iterator[str]:
    """Allowed calls with one wrong argument, or without an instance."""
    for name, kinds in calls.table.arguments.items():
        if calls.call(NULL, name, *calls.good(name)) != ERROR:
            yield f"{name} without an instance is not an error"
        places = [(kind, phase) for kind, phases in calls.table.allowed.get(name, {}).items() for phase in phases]
        for (kind, phase), (position, argument) in itertools.product(places[:2], enumerate(kinds)):
            for wrong in range(1, len(calls.values(argument))):
                instance = calls.in_phase(kind, phase)
                arguments = calls.good(name)
                arguments[position] = calls.values(argument)[wrong]
                status = calls.call(instance, name, *arguments)
                refused = status == ERROR and any(m.startswith(f"{name}: ") for m in calls.messages)
                if not refused and (name, argument, wrong) not in calls.table.harmless:
                    yield f"{name} {kind} {phase}, argument {position + 1} ({argument}, {wrong}): status {status}"
                calls.free(instance)


def random_calls(calls: Calls, seeds: int) -> Iterator[str]:
    """Sequences of any calls; states are real, freed or made up."""
    names = list(calls.table.arguments)
    for seed in range(seeds):
        rng = random.Random(seed)
        kind, phase = rng.choice(calls.table.phases)
        instance = calls.in_phase(kind, phase)
        states = [c_void_p()]
        for _ in range(40):
            name = rng.choice(names)
            arguments = [_random_value(calls, rng, argument, states) for argument in calls.table.arguments[name]]
            status = calls.call(instance, name, *arguments)
            if status not in (OK, DISCARD, ERROR):
                yield f"seed {seed}: {name} gives status {status}"
        calls.free(instance)
    if calls.call(calls.in_phase("stepping", "initialization"), calls.table.prefix + "ExitInitializationMode") != OK:
        yield "after all that a new instance does not work"


def _random_value(calls: Calls, rng: random.Random, kind: str, states: list[c_void_p]) -> Any:
    if kind in ("state", "no_state", "new_state") and rng.random() < 0.9:
        if kind == "new_state":
            states.append(c_void_p())
            return byref(states[-1])
        kept = rng.choice(states)
        # A copy of the pointer: freeing must not make the list forget it.
        return byref(c_void_p(kept.value)) if kind == "no_state" else kept
    values = calls.values(kind)
    if kind == "step":
        values = values[:-1]  # a huge step is right, and long
    return values[0] if rng.random() < 0.85 else rng.choice(values)


if __name__ == "__main__":
    library = Calls(Path(sys.argv[1]))
    modes: dict[str, Callable[[], Iterator[str]]] = {
        "phases": lambda: wrong_phases(library),
        "arguments": lambda: wrong_arguments(library),
        "random": lambda: random_calls(library, int(sys.argv[3])),
    }
    print(json.dumps(list(modes[sys.argv[2]]())))
