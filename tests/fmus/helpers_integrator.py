"""The runtime's integrator alone, compiled and driven with right-hand sides written in Python."""

import ctypes
import subprocess
from collections.abc import Callable, Sequence
from ctypes import POINTER, Structure, c_double, c_int, c_size_t, c_void_p
from importlib import resources
from pathlib import Path

import numpy as np

from fmus.runtime.compiler import find_compiler

SOURCES = ("integrator", "dormand_prince", "rosenbrock", "linear", "crossing")
AUTOMATIC, EXPLICIT, IMPLICIT = 0, 1, 2
EVENT = 1  # outcome of a run

Rhs = Callable[[float, list[float]], Sequence[float]]
ByState = Callable[[float, list[float]], np.ndarray]

DERIVATIVES = ctypes.CFUNCTYPE(c_int, c_void_p, c_double, POINTER(c_double), POINTER(c_double))
JACOBIAN = ctypes.CFUNCTYPE(c_int, c_void_p, c_double, POINTER(c_double), POINTER(c_double), POINTER(c_double))
MARGIN = ctypes.CFUNCTYPE(c_int, c_void_p, c_double, POINTER(c_double), POINTER(c_double))


class StepMemory(Structure):
    _fields_ = (("step", c_double), ("error", c_double), ("implicit", c_int), ("evidence", c_int))


class Integration(Structure):
    _fields_ = (
        ("n", c_size_t),
        ("derivatives", DERIVATIVES),
        ("jacobian", JACOBIAN),
        ("margin", MARGIN),
        ("context", c_void_p),
        ("choice", c_int),
        ("tolerance", c_double),
        ("nominal", POINTER(c_double)),
        ("work", POINTER(c_double)),
        ("pivots", POINTER(c_size_t)),
        ("jacobian_known", c_int),
        ("culprit", c_size_t),
        ("time", c_double),
    )


def compiled_integrator(folder: Path) -> ctypes.CDLL:
    """The integrator as a shared library in `folder`."""
    runtime = resources.files("fmus.runtime")
    units = [str(runtime / f"{name}.c") for name in SOURCES]
    target = folder / "integrator.so"
    flags = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-fPIC", "-shared"]
    subprocess.run([*find_compiler(), *flags, "-o", str(target), *units, "-lm"], check=True)
    library = ctypes.CDLL(str(target))
    library.integrate.argtypes = [
        POINTER(Integration),
        POINTER(StepMemory),
        c_double,
        c_double,
        POINTER(c_double),
        c_int,
    ]
    return library


class Solver:
    """One problem; counts the evaluations of its right-hand side and of its Jacobian.

    `by_time` is the derivative of the right-hand side by t, zero when not given; an event is where `margin` gets to 0.
    """

    def __init__(
        self,
        library: ctypes.CDLL,
        rhs: Rhs,
        by_state: ByState,
        x: Sequence[float],
        *,
        tolerance: float = 1e-8,
        choice: int = AUTOMATIC,
        by_time: Rhs | None = None,
        nominal: float = 1.0,
        margin: Callable[[float, list[float]], float] | None = None,
    ) -> None:
        n = len(x)
        self.library, self.x, self.evaluations, self.jacobians = library, (c_double * n)(*x), 0, 0

        def derivatives(_: object, t: float, state: object, dx: object) -> int:
            self.evaluations += 1
            for i, value in enumerate(rhs(t, state[:n])):  # type: ignore[index]
                dx[i] = value  # type: ignore[index]
            return 0

        def jacobian(_: object, t: float, state: object, matrix: object, time_part: object) -> int:
            self.jacobians += 1
            columns = np.asarray(by_state(t, state[:n])).T.ravel()  # type: ignore[index]
            for i, value in enumerate(columns):
                matrix[i] = value  # type: ignore[index]
            for i, value in enumerate(by_time(t, state[:n]) if by_time else [0.0] * n):  # type: ignore[index]
                time_part[i] = value  # type: ignore[index]
            return 0

        def least(_: object, t: float, state: object, result: object) -> int:
            assert margin is not None
            result[0] = margin(t, state[:n])  # type: ignore[index]
            return 0

        self.memory = StepMemory()
        self.run = Integration(
            n=n,
            derivatives=DERIVATIVES(derivatives),
            jacobian=JACOBIAN(jacobian),
            margin=MARGIN(least) if margin else MARGIN(),
            choice=choice,
            tolerance=tolerance,
            nominal=(c_double * n)(*[nominal] * n),
            work=(c_double * ((14 + 2 * n) * n))(),
            pivots=(c_size_t * n)(),
        )

    def advance(self, t: float, t_end: float) -> list[float]:
        """The state at `t_end`; fails when the integrator gives up."""
        outcome = self.library.integrate(ctypes.byref(self.run), ctypes.byref(self.memory), t, t_end, self.x, 0)
        assert outcome == 0, (outcome, self.run.time)
        return list(self.x)

    def event(self, t: float, t_end: float) -> float:
        """Time of the first event."""
        outcome = self.library.integrate(ctypes.byref(self.run), ctypes.byref(self.memory), t, t_end, self.x, 0)
        assert outcome == EVENT, (outcome, self.run.time)
        return float(self.run.time)

    def fixed(self, t_end: float, steps: int) -> list[float]:
        """The state at `t_end` after equal steps from 0, whatever their error."""
        self.run.tolerance = 1e300
        for k in range(steps):
            self.memory.step = t_end / steps
            self.advance(t_end * k / steps, t_end * (k + 1) / steps)
        return list(self.x)
