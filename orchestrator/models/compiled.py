"""Compile a model's functions to machine code and run it along a trial's inputs."""

import ctypes
import hashlib
import os
import re
import shutil
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from fmus.children import run_tool
from fmus.errors import MisfitError
from fmus.files import cache_folder
from fmus.symbolic.system import SymbolicSystem
from orchestrator.models.failure import RunFailed, explained

SIMULATOR = Path(__file__).with_name("simulator.c")
FLAGS = ("-fPIC", "-shared", "-std=c99", "-ffp-contract=off")
# Generated code is long and runs once for each stage of a step; what loops over sensitivities is short and must be fast.
FOR_MODELS, FOR_LOOPS = "-O1", "-O3"
# A model with long sums in it, such as a Gaussian process, whose exponentials are evaluated several at a time; the last
# bits differ.
FOR_LONG_SUMS = "-O2 -ftree-vectorize -ffast-math -nostartfiles"
# Four at a time instead of two, where the processor can: 1.5 times as fast.
WIDE, CPU = "-mavx2 -mfma", Path("/proc/cpuinfo")
# Trials of which a model with delays remembers what it delays.
KEPT_TRIALS = 8
# Error of a step of a system that makes and breaks contact, as a share of the largest value of each state so far. Steps of
# an eighth of a millisecond left the true play of two masses at 0.41 in a metric in which it can be 0.32; these leave 0.33.
CONTACT_TOLERANCE = 1e-8
NOTHING_BEFORE = np.zeros((1, 0))


class _Function(ctypes.Structure):
    """Mirror of `function` in simulator.c."""

    _fields_ = [(name, ctypes.c_void_p) for name in ("call", "work", "place", "column", "first", "other")] + [
        ("entries", ctypes.c_longlong)
    ]


class _Problem(ctypes.Structure):
    """Mirror of `problem` in simulator.c."""

    _fields_ = [
        *(
            (name, ctypes.c_longlong)
            for name in ("n", "nx", "nu", "nd", "ny", "nfree", "substeps", "sensitivities", "nodes")
        ),
        *((name, ctypes.c_void_p) for name in ("t", "u", "source", "delay", "delay_slope", "before", "p", "held")),
        ("tolerance", ctypes.c_double),
        ("rate", _Function),
        ("output", _Function),
    ]


@dataclass(frozen=True)
class FreeRun:
    """Outputs of shape (n, ny), and their derivatives of shape (n, ny, nx + nfree) if asked for.

    The derivatives are with respect to the start values of the states, then the free parameters.
    """

    outputs: np.ndarray
    sensitivities: np.ndarray | None


class CompiledModel:
    """Machine code of one system for a chosen tuple of outputs and of free parameters."""

    # Whether it chooses its steps itself, as a coupled system does, so that a sample interval is one step.
    has_own_steps = False

    def __init__(
        self,
        system: SymbolicSystem,
        outputs: Sequence[str],
        free: Sequence[str] = (),
        level: str = FOR_MODELS,
        held: Sequence[str] = (),
    ) -> None:
        self.system, self.outputs, self.free, self._level = system, tuple(outputs), tuple(free), level
        self.tolerance = CONTACT_TOLERANCE if system.contacts else 0.0
        names = [parameter.name for parameter in system.parameters]
        self._free_positions = [names.index(name) for name in free]
        self.parameters = np.array([parameter.start for parameter in system.parameters], dtype=float)
        self.held = tuple(held)
        self._held = np.array([variable.name in held for variable in system.inputs], dtype=np.uint8)
        self._compiled: _MachineCode | None = None
        self._histories: tuple[tuple[np.ndarray, np.ndarray, np.ndarray], ...] = ()

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
        before: np.ndarray = NOTHING_BEFORE,
    ) -> FreeRun:
        """Simulate from `start` along inputs that are linear between samples, or stay at each sample's value if they
        are `held`.

        Args:
            time: (n,) s, increasing, at least two samples.
            inputs: (n, nu).
            parameters: all parameters, in the system's order.
            start: (nx,) states at the first sample.
            substeps: Runge-Kutta steps in a sample interval; a system with contacts halves them where it must.
            before: (nd, k) by how much each delayed quantity was off its first sample before it, k times at equal
                distances up to its delay time, linear in between; not at all if left out.

        Raises:
            ComponentError: if a value stops being finite, with the time.
        """
        system, n, nx, nfree = self.system, len(time), len(self.system.states), len(self.free)
        keep = [np.ascontiguousarray(a, dtype=float) for a in (time, inputs, *self._delays(time, inputs, parameters))]
        keep += [np.ascontiguousarray(part, dtype=float) for part in (before, parameters)]
        sizes = (n, nx, len(system.inputs), system.n_delays, len(self.outputs), nfree, substeps, int(sensitivities))
        code = self._machine_code  # kept until the run ends: what its functions point to belongs to it
        functions = code.with_slopes if sensitivities else code.plain
        keep.append(self._marks)
        problem = _Problem(*sizes, before.shape[1], *(a.ctypes.data for a in keep), self.tolerance, *functions)
        outputs = np.empty((n, len(self.outputs)))
        slopes = np.empty((n, len(self.outputs), nx + nfree)) if sensitivities else None
        first = np.ascontiguousarray(start, dtype=float)
        reached = _simulator().misfit_simulate(
            ctypes.byref(problem),
            first.ctypes.data_as(ctypes.c_void_p),
            outputs.ctypes.data_as(ctypes.c_void_p),
            None if slopes is None else slopes.ctypes.data_as(ctypes.c_void_p),
        )
        if reached != n:
            run = (time, inputs, parameters, start, substeps, self._held, self.outputs, reached)
            raise RunFailed(lambda: explained(system, *run))
        return FreeRun(outputs, slopes)

    @property
    def operations(self) -> int:
        """About how many operations one evaluation of the rates with their slopes takes, as written; 0 if nobody knows."""
        return self._machine_code.operations

    def delayed(self, time: np.ndarray, inputs: np.ndarray, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Delayed quantities (n, nd) at the samples and their delay times (nd,) s.

        Args:
            time: (n,) in s.
            inputs: (n, nu).
            parameters: values of all parameters.
        """
        if not self.system.n_delays:
            return np.zeros((len(time), 0)), np.zeros(0)
        sources, delays, _ = self._delays(time, inputs, parameters)
        return sources, delays

    def _delays(self, time: np.ndarray, inputs: np.ndarray, parameters: np.ndarray) -> tuple[np.ndarray, ...]:
        """Delayed quantities at the samples, the delay times, and their slopes in the free parameters."""
        if not self.system.n_delays:
            return np.zeros((1, 1)), np.zeros(1), np.zeros((1, 1))
        slope = self._delay_jacobian(parameters).full()[:, self._free_positions]
        _, delays = self.system.history(time[0], inputs[0], ca.DM(parameters))
        return self._sources(time, inputs, parameters), delays.full()[:, 0], slope

    @cached_property
    def _marks(self) -> np.ndarray:
        """Marks (nu + nd,) of inputs that are held, and of delayed quantities that stay as they do: those of held inputs alone."""
        if not (self.system.n_delays and self._held.any()):
            return np.concatenate([self._held, np.zeros(self.system.n_delays, dtype=np.uint8)])
        t, u = ca.SX.sym("t"), ca.SX.sym("u", len(self.system.inputs))
        source, _ = self.system.history(t, u, ca.DM(self.parameters))
        depends = np.array(ca.DM(ca.jacobian(source, ca.vertcat(t, u)).sparsity(), 1)) != 0
        given = np.concatenate([[0], self._held])
        stays = depends.any(axis=1) & ~(depends & (given == 0)).any(axis=1)
        return np.concatenate([self._held, stays.astype(np.uint8)])

    def _sources(self, time: np.ndarray, inputs: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        """Delayed quantities (n, nd) at the samples; kept for the last trials, as they depend on no parameter."""
        for known_time, known_inputs, known in self._histories:
            if np.array_equal(known_time, time) and np.array_equal(known_inputs, inputs):
                return known
        found = np.ascontiguousarray(self.system.history(time[None, :], inputs.T, ca.DM(parameters))[0].full().T)
        self._histories = (*self._histories[1 - KEPT_TRIALS :], (time.copy(), inputs.copy(), found))
        return found

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

    @property
    def _machine_code(self) -> "_MachineCode":
        if self._compiled is None:  # not a cached_property, whose lock lets one thread compile at a time
            self._compiled = self._compile()
        return self._compiled

    def _compile(self) -> "_MachineCode":
        plain = self._functions()
        functions = [_without_repetitions(function) for function in plain]
        generator = ca.CodeGenerator("model.c", {"with_header": False, "main": False})
        for function in functions:
            generator.add(function)
        library = ctypes.CDLL(str(build_library(_inlined(str(generator.dump())), level=self._level)))
        return _MachineCode.of(library, functions, operations=plain[1].n_instructions())

    def _functions(self) -> list[ca.Function]:
        """Rates and outputs, each alone and with its Jacobian: the four functions that simulator.c calls."""
        system = self.system
        # Equations that are solved by iteration are calls inside the function, which scalar symbols cannot express.
        symbol: Any = ca.SX.sym if system.rhs.is_a("SXFunction") else ca.MX.sym
        sizes = (1, len(system.states), len(system.inputs), system.n_delays, len(system.parameters))
        t, x, u, d, p = (symbol(name, size) for name, size in zip("txudp", sizes, strict=True))
        dx, z = system.rhs(t, x, u, d, p)
        named = {v.name: x[i] for i, v in enumerate(system.states)}
        named |= {v.name: z[i] for i, v in enumerate(system.algebraics)}
        y = ca.vertcat(*[named[name] for name in self.outputs])
        arguments = [t, x, u, d, p]
        found = []
        for name, value in (("model_f", dx), ("model_y", y)):
            found.append(ca.Function(name, arguments, [ca.densify(value)]))
            jacobian = _forward_jacobian(value, x, d, p, self._free_positions)
            found.append(ca.Function(name + "j", arguments, [ca.densify(value), jacobian]))
        return found


@dataclass(frozen=True)
class _MachineCode:
    """The compiled functions as simulator.c takes them: rates and outputs, without and with their Jacobians."""

    plain: tuple[_Function, _Function]
    with_slopes: tuple[_Function, _Function]
    keep: tuple[object, ...]
    operations: int

    @staticmethod
    def of(library: ctypes.CDLL, functions: Sequence[ca.Function], operations: int) -> "_MachineCode":
        """Look the functions up in their library; the result keeps alive what it points to."""
        found, keep = list[_Function](), list[object]([library])
        for function in functions:
            name = function.name()
            addresses = [ctypes.cast(library[name + suffix], ctypes.c_void_p) for suffix in ("", "_work")]
            layout = _layout(function)
            keep += layout
            found.append(_Function(*addresses, *(part.ctypes.data for part in layout), len(layout[0])))
        f, fj, y, yj = found
        return _MachineCode((f, y), (fj, yj), tuple(keep), operations)


def _without_repetitions(function: ca.Function) -> ca.Function:
    """The same function, in which what a derivative has in common with its function is computed once."""
    arguments: Any = function.sx_in() if function.is_a("SXFunction") else function.mx_in()
    results: Any = function.call(arguments)
    return ca.Function(function.name(), arguments, results, {"cse": True})


def _layout(function: ca.Function) -> list[np.ndarray]:
    """The entries of a function's Jacobian by rows, and in each by columns, as simulator.c takes them.

    Where each is stored, its column, where each row begins (and the last one ends), and where in a row the columns of
    states end. A function without a Jacobian has no entries.
    """
    if function.n_out() < 2:
        return [np.zeros(0, dtype=np.longlong)] * 4
    row, column = (np.array(part, dtype=np.longlong) for part in function.sparsity_out(1).get_triplet())
    place = np.lexsort((column, row))
    rows, states = np.arange(function.size1_out(1) + 1), function.size1_in(1)
    first = np.searchsorted(row[place], rows)
    other = first[:-1] + np.bincount(row[column < states], minlength=len(rows) - 1)
    return [np.ascontiguousarray(part, dtype=np.longlong) for part in (place, column[place], first, other)]


def _inlined(source: str) -> str:
    """Generated C whose helpers (squares, least and largest values) cost no call, with the same results to the last bit.

    They are made public functions, which a shared library may not inline, and calls of the mathematical library.
    """
    for name, sign in (("fmin", "<"), ("fmax", ">")):
        source = source.replace(f"return {name}(x, y);", f"return x {sign} y || y != y ? x : y;")
    return re.sub(r"^casadi_real casadi_", "static inline casadi_real casadi_", source, flags=re.MULTILINE)


def _forward_jacobian(value: Any, x: Any, d: Any, p: Any, free: Sequence[int]) -> Any:
    """Jacobian with respect to states, delayed quantities and free parameters, side by side."""
    by_parameters = ca.jacobian(value, p)
    return ca.horzcat(ca.jacobian(value, x), ca.jacobian(value, d), *[by_parameters[:, i] for i in free])


def linear_answer(
    half: np.ndarray, step: np.ndarray, push: np.ndarray, show: np.ndarray, direct: np.ndarray, changes: np.ndarray
) -> np.ndarray:
    """Outputs (n, ny, k) of a linear time-varying system from rest, for k histories (n, nu, k) of its inputs.

    x(i+1) = step(i) (x(i) + half(i) push(i) u(i)) + half(i) push(i+1) u(i+1), y(i) = show(i) x(i) + direct(i) u(i): the
    trapezoidal rule over sample intervals of length 2 half(i), where step(i) carries the state over one.

    Args:
        half: (n - 1,) s. step: (n - 1, nx, nx). push: (n, nx, nu). show: (n, ny, nx). direct: (n, ny, nu).
    """
    keep = [np.ascontiguousarray(part, dtype=float) for part in (half, step, push, show, direct, changes)]
    n, nu, k = changes.shape
    sizes = np.array([n, step.shape[1], nu, show.shape[1], k], dtype=np.longlong)
    answers = np.empty((n, show.shape[1], k))
    pointers = [ctypes.c_void_p(part.ctypes.data) for part in (sizes, *keep, answers)]
    if _simulator().misfit_answer(*pointers) != 0:
        raise MemoryError(f"no memory for {k} histories of {step.shape[1]} states")
    return answers


@cache
def _simulator() -> ctypes.CDLL:
    return ctypes.CDLL(str(build_library(SIMULATOR.read_text(), level=FOR_LOOPS)))


@cache
def level_for_long_sums(cpu: Path = CPU) -> str:
    """Flags of the compiler for a model with long sums in it, on the processor that `cpu` describes: code is compiled where it runs."""
    found = re.search(r"^flags\s*:(.*)$", cpu.read_text() if cpu.is_file() else "", flags=re.MULTILINE)
    return f"{FOR_LONG_SUMS} {WIDE}" if found and {"avx2", "fma"} <= set(found[1].split()) else FOR_LONG_SUMS


def build_library(source: str, driver: Path | None = None, *, level: str = FOR_MODELS) -> Path:
    """Compile C source, with the C file that calls it if there is one, once for each content.

    Args:
        source: the C source.
        driver: a C file that calls it.
        level: options of the compiler that say how much it optimises.

    Returns:
        The shared library, in the cache.

    Raises:
        MisfitError: without a C compiler, or if it fails.
    """
    compiler = os.environ.get("CC") or shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        raise MisfitError("no C compiler found; install one (Debian: apt-get install gcc libc6-dev)")
    flags = (*level.split(), *FLAGS)
    text = source + (driver.read_text() if driver else "")
    key = hashlib.sha256(" ".join((compiler, *flags, text)).encode()).hexdigest()
    target = cache_folder("compiled") / f"{key}.so"
    if target.is_file():
        return target
    with tempfile.TemporaryDirectory(dir=target.parent) as folder:
        generated, built = Path(folder) / "model.c", Path(folder) / "model.so"
        generated.write_text(source)
        files = [str(generated), *([str(driver)] if driver else [])]
        command = [compiler, *flags, "-o", str(built), *files, "-lm"]
        done = run_tool(command)
        if done.returncode != 0:
            raise MisfitError(
                f"the C compiler failed: {done.stderr.strip().splitlines()[0] if done.stderr else command}"
            )
        os.replace(built, target)  # a concurrent build of the same content gives the same file
    return target
