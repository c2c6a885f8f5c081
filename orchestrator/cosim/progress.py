"""Which component is called, and at what simulated time: written before every call, readable from another process."""

import ctypes
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

CALLS = ("nothing", "load", "instantiate", "initialise", "start", "set", "get", "step", "save", "restore", "terminate")
NUMBERS = {name: number for number, name in enumerate(CALLS)}


class ProgressWord(ctypes.Structure):
    """64 bytes that C and Python share; the engine's C code has the same struct.

    `component` counts through the system's components from 0, -1 for the master itself; `call` is a number of `CALLS`;
    `time` is the simulated time of the call and `last_good` the last communication point that was completed, both in s.
    `calls` grows with every call: who watches from outside knows from it that something moves. `rows` is how many rows
    of the result buffer are complete, `stop` a wish to end from outside.
    """

    _fields_ = [
        ("component", ctypes.c_int32),
        ("call", ctypes.c_int32),
        ("time", ctypes.c_double),
        ("last_good", ctypes.c_double),
        ("calls", ctypes.c_uint64),
        ("rows", ctypes.c_uint64),
        ("stop", ctypes.c_int32),
        ("unused", ctypes.c_int32 * 5),
    ]


assert ctypes.sizeof(ProgressWord) == 64


def plain_buffer(rows: int, columns: int) -> NDArray[np.float64]:
    """Result buffer in ordinary memory, (rows, columns)."""
    return np.zeros((rows, columns))


class Progress:
    """The word, and where the result buffer comes from: ordinary memory, or memory that a watching host shares."""

    def __init__(self, memory: Any = None, buffer: Callable[[int, int], NDArray[np.float64]] = plain_buffer) -> None:
        self.word = ProgressWord() if memory is None else ProgressWord.from_buffer(memory)
        self.word.component = -1
        self.buffer = buffer

    @property
    def address(self) -> int:
        """Address of the word, for C."""
        return ctypes.addressof(self.word)

    def enter(self, component: int, call: str, time: float) -> None:
        """Note that a component is about to be called."""
        word = self.word
        word.component, word.call, word.time = component, NUMBERS[call], time
        word.calls += 1

    def leave(self) -> None:
        """Note that the master itself is at work."""
        self.word.component, self.word.call = -1, 0
        self.word.calls += 1
