"""Compile a model's functions to machine code and run it along a trial's inputs."""

import ctypes
import hashlib
import os
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from fmus.errors import ComponentError, MisfitError
from fmus.files import cache_folder
from fmus.symbolic.system import SymbolicSystem

SIMULATOR = Path(__file__).with_name("simulator.c")
FLAGS = ("-O1", "-fPIC", "-shared", "-std=c99", "-ffp-contract=off")


class _Problem(ctypes.Structure):
    """Mirror of `problem` in simulator.c."""

    _fields_ = [
        (name, ctypes.c_int) for name in ("n", "nx", "nu", "nd", "ny", "nfree", "substeps", "sensitivities")
    ] + [(name, ctypes.c_void_p) for name in ("t", "u", "source", "delay", "delay_slope", "p")]


@dataclass(frozen=True)
class FreeRun:
    """Outputs of shape (n, ny), and their derivatives of shape (n, ny, nx + nfree) if asked for.

    The derivatives are with respect to the start values of the states, then the free parameters.
    """

    outputs: np.ndarray
    sensitivities: np.ndarray | None


class CompiledModel:
    """Machine code of one system for a chosen tuple of outputs and of free parameters."""

    def __init__(self, system: SymbolicSystem, outputs: Sequence[str], free: Sequence[str] = ()) -> None:
        self.system, self.outputs, self.free = system, tuple(outputs), tuple(free)
        names = [parameter.name for parameter in system.parameters]
        self._free_positions = [names.index(name) for name in free]
        self.parameters = np.array([parameter.start for parameter in system.parameters], dtype=float)

    def with_values(self, values: ArrayLike) -> np.ndarray:
        """Return the vector of all parameters with the free ones set to `values`."""
        result = self.parameters.copy()
        result[self._free_positions] = values
        return result

    def run(
        self,
        time: np.ndarray,
        inputs: np.ndarray,
        parameters: np.ndarray,
        start: np.ndarray,
        *,
        substeps: int = 1,
        sensitivities: bool = False,
    ) -> FreeRun:
        """Simulate from `start` along inputs that are linear between samples.

        Args:
            time: (n,) s, increasing, at least two samples.
            inputs: (n, nu).
            parameters: all parameters, in the system's order.
            start: (nx,) states at the first sample.
            substeps: Runge-Kutta steps in a sample interval.

        Raises:
            ComponentError: if a value stops being finite, with the time.
        """
        system, n, nx, nfree = self.system, len(time), len(self.system.states), len(self.free)
        keep = [np.ascontiguousarray(a, dtype=float) for a in (time, inputs, *self._delays(time, inputs, parameters))]
        keep.append(np.ascontiguousarray(parameters, dtype=float))
        sizes = (n, nx, len(system.inputs), system.n_delays, len(self.outputs), nfree, substeps, int(sensitivities))
        problem = _Problem(*sizes, *(a.ctypes.data for a in keep))
        outputs = np.empty((n, len(self.outputs)))
        slopes = np.empty((n, nx + nfree, len(self.outputs))) if sensitivities else None
        first = np.ascontiguousarray(start, dtype=float)
        reached = self._library.misfit_simulate(
            ctypes.byref(problem),
            first.ctypes.data_as(ctypes.c_void_p),
            outputs.ctypes.data_as(ctypes.c_void_p),
            None if slopes is None else slopes.ctypes.data_as(ctypes.c_void_p),
        )
        if reached != n:
            raise ComponentError(f"{system.name} left the finite numbers at t = {time[max(reached, 0)]:.4g} s")
        return FreeRun(outputs, None if slopes is None else slopes.transpose(0, 2, 1))

    def _delays(self, time: np.ndarray, inputs: np.ndarray, parameters: np.ndarray) -> tuple[np.ndarray, ...]:
        """Delayed quantities at the samples, the delay times, and their slopes in the free parameters."""
        if not self.system.n_delays:
            return np.zeros((1, 1)), np.zeros(1), np.zeros((1, 1))
        sources, delays = self.system.history(time[None, :], inputs.T, ca.DM(parameters))
        slope = self._delay_jacobian(parameters).full()[:, self._free_positions]
        return np.array(sources).T, np.array(delays)[:, 0], slope

    @cached_property
    def _delay_jacobian(self) -> ca.Function:
        p = ca.SX.sym("p", len(self.system.parameters))
        u = ca.SX.sym("u", len(self.system.inputs))
        source, delay = self.system.history(0, u, p)
        if ca.depends_on(source, p):
            raise MisfitError(
                f"{self.system.name}: a delayed quantity depends on parameters, which fits do not support"
            )
        return ca.Function("delay_jacobian", [p], [ca.densify(ca.jacobian(delay, p))])

    @cached_property
    def _library(self) -> ctypes.CDLL:
        return ctypes.CDLL(str(build_library(self._generate(), SIMULATOR)))

    def _generate(self) -> str:
        """C source of the four functions that simulator.c calls."""
        system = self.system
        # Equations that are solved by iteration are calls inside the function, which scalar symbols cannot express.
        symbol: Any = ca.SX.sym if system.rhs.is_a("SXFunction") else ca.MX.sym
        sizes = (1, len(system.states), len(system.inputs), system.n_delays, len(system.parameters))
        t, x, u, d, p = (symbol(name, size) for name, size in zip("txudp", sizes, strict=True))
        dx, z = system.rhs(t, x, u, d, p)
        named = {v.name: x[i] for i, v in enumerate(system.states)}
        named |= {v.name: z[i] for i, v in enumerate(system.algebraics)}
        y = ca.vertcat(*[named[name] for name in self.outputs])
        generator = ca.CodeGenerator("model.c", {"with_header": False, "main": False})
        arguments = [t, x, u, d, p]
        for name, value in (("model_f", dx), ("model_y", y)):
            generator.add(ca.Function(name, arguments, [ca.densify(value)]))
            jacobian = _forward_jacobian(value, x, d, p, self._free_positions)
            generator.add(ca.Function(name + "j", arguments, [ca.densify(value), ca.densify(jacobian)]))
        return str(generator.dump())


def _forward_jacobian(value: Any, x: Any, d: Any, p: Any, free: Sequence[int]) -> Any:
    """Jacobian with respect to states, delayed quantities and free parameters, side by side."""
    by_parameters = ca.jacobian(value, p)
    return ca.horzcat(ca.jacobian(value, x), ca.jacobian(value, d), *[by_parameters[:, i] for i in free])


def build_library(source: str, driver: Path) -> Path:
    """Compile generated C with the C file that calls it, once for each content.

    Raises:
        MisfitError: without a C compiler, or if it fails.
    """
    compiler = os.environ.get("CC") or shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        raise MisfitError("no C compiler found; install one (Debian: apt-get install gcc libc6-dev)")
    text = source + driver.read_text()
    key = hashlib.sha256(" ".join((compiler, *FLAGS, text)).encode()).hexdigest()
    target = cache_folder("compiled") / f"{key}.so"
    if target.is_file():
        return target
    with tempfile.TemporaryDirectory(dir=target.parent) as folder:
        generated, built = Path(folder) / "model.c", Path(folder) / "model.so"
        generated.write_text(source)
        command = [compiler, *FLAGS, "-o", str(built), str(generated), str(driver), "-lm"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise MisfitError(
                f"the C compiler failed: {done.stderr.strip().splitlines()[0] if done.stderr else command}"
            )
        os.replace(built, target)  # a concurrent build of the same content gives the same file
    return target
