"""What a child process does that runs one FMU, so that a crash or a hang in its native code does not take the host along."""

import ctypes
import os
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from fmus.errors import ComponentError, MisfitError
from orchestrator.cosim.fmu.base import instantiate
from orchestrator.cosim.fmu.description import CO_SIMULATION, MODEL_EXCHANGE, read_description

NUDGE = 1e-6


@dataclass(frozen=True)
class Wiring:
    """Value references to set and to get, and how many scalars they stand for.

    `differenced` names, for each sensed value that the FMU does not give, the sensed value whose rate it is.
    """

    inputs: tuple[int, ...]
    n_inputs: int
    sensed: tuple[int, ...]
    n_sensed: int
    differenced: tuple[int, ...]
    outputs: tuple[int, ...]
    n_outputs: int


@dataclass(frozen=True)
class Variant:
    """What differs between runs along the same inputs: parameters, delayed inputs (n, nd), start values.

    `start` holds the FMU's states (model exchange only) and those of the effects; `settings` are values that are set
    before the run, by value reference.
    """

    parameters: np.ndarray
    delayed: np.ndarray
    start: np.ndarray
    settings: dict[int, list[float]]


@dataclass(frozen=True)
class RunRequest:
    """Free runs with effects: `library` is the compiled runner, `n_results` its number of outputs, `n_states` those of
    the FMU, `n_added` the number of rates to which effects add; `held` tells which inputs stay until the next sample."""

    library: Path
    wiring: Wiring
    time: np.ndarray
    inputs: np.ndarray
    n_states: int
    n_results: int
    substeps: int
    variants: tuple[Variant, ...]
    n_added: int = 0
    held: tuple[bool, ...] = ()


@dataclass(frozen=True)
class ProbeRequest:
    """Ask for states and derivatives after initialisation, at given inputs: references of states, rates and outputs."""

    wiring: Wiring
    states: tuple[int, ...]
    rates: tuple[int, ...]
    inputs: np.ndarray
    start: np.ndarray | None
    directional: bool


@dataclass(frozen=True)
class RatesRequest:
    """Ask for the rates at given times (n,), states (n, nx) and inputs (n, nu); model exchange only."""

    wiring: Wiring
    time: np.ndarray
    states: np.ndarray
    inputs: np.ndarray


@dataclass(frozen=True)
class PathRequest:
    """Ask for the Jacobians along a free run from `start` (nx,), without effects; model exchange only."""

    wiring: Wiring
    states: tuple[int, ...]
    rates: tuple[int, ...]
    time: np.ndarray
    inputs: np.ndarray
    start: np.ndarray
    substeps: int
    directional: bool
    held: tuple[bool, ...] = ()


@dataclass(frozen=True)
class SlopesRequest:
    """Ask for rates and outputs with their Jacobians at given times (n,), states (n, nx) and inputs (n, nu), with
    values set before the run by value reference; model exchange only."""

    wiring: Wiring
    states: tuple[int, ...]
    rates: tuple[int, ...]
    time: np.ndarray
    at: np.ndarray
    inputs: np.ndarray
    settings: dict[int, list[float]]
    directional: bool


# References of inputs, and their values.
Inputs = tuple[Sequence[int], Sequence[float]]


class _Problem(ctypes.Structure):
    """Mirror of `problem` in runner.c."""

    _fields_ = [
        *(
            (name, ctypes.c_int)
            for name in (
                *(
                    "version",
                    "cosimulation",
                    "n",
                    "nx",
                    "ne",
                    "nu",
                    "nv",
                    "ns",
                    "n_read",
                    "ny",
                    "nz",
                    "nd",
                    "substeps",
                    "n_added",
                ),
                *("n_in", "n_sensed", "n_out"),
            )
        ),
        *(
            (name, ctypes.c_void_p)
            for name in (
                *("component", "set_time", "set_states", "get_rates", "set_real", "get_real", "do_step"),
                *(
                    "completed_step",
                    "set_slopes",
                    "in_refs",
                    "sensed_refs",
                    "out_refs",
                    "differenced",
                    "t",
                    "u",
                    "d",
                    "p",
                    "held",
                ),
            )
        ),
    ]


class _Instance:
    """One instance of either FMI version and kind, run again and again."""

    def __init__(self, path: Path, cosimulation: bool) -> None:
        description = read_description(path)
        interface = description.interface(CO_SIMULATION if cosimulation else MODEL_EXCHANGE)
        self.interface = interface
        self.resets: bool | None = None if cosimulation else True
        self.fmu = instantiate(path.name, description, interface)
        self.description = description
        self.second, self.cosimulation = description.version == 2, cosimulation
        self.interpolates = interface.interpolates_inputs
        self.waits_for_events = False
        self._used = False
        ports = description.by_name.values()
        self._parameters = {
            reference for port, reference, *_ in ports if port.causality == "parameter" and port.type == "Float64"
        }

    def begin(self, time: float, settings: dict[int, list[float]], inputs: Inputs = ((), ())) -> None:
        """Reset, set start values and the inputs that they may follow from, initialise."""
        if self._used:
            self.fresh()
        self._used = True
        self.set(*inputs)
        for reference, values in settings.items():
            self.set([reference], values)
        self.fmu.begin(time, None, None)
        for reference, values in settings.items():  # some tools set parameters back here
            if reference in self._parameters and not np.array_equal(self.get([reference], len(values)), values):
                self.set([reference], values)
        self.fmu.finish_initialisation()
        if not self.cosimulation:
            while (event := self.fmu.update_discrete_states()).again:
                pass
            self.waits_for_events = event.next_time is not None
            self.fmu.call("EnterContinuousTimeMode")

    def set_time(self, time: float) -> None:
        self.fmu.call("SetTime", ctypes.c_double(time))

    def fresh(self) -> None:
        """Make it as it was when it was new: by a reset, or a new instance of what a reset does not make so."""
        if self.resets:
            self.fmu.reset()
        else:
            self.fmu.free()
            self.fmu = instantiate(self.fmu.name, self.description, self.interface)

    def numbers(self, references: Sequence[int]) -> Sequence[int]:
        """The FMU's own references of variables."""
        return references

    def set(self, references: Sequence[int], values: Sequence[float]) -> None:
        if references:
            self._values("Set", references, np.array(values, dtype=float))

    def get(self, references: Sequence[int], count: int) -> np.ndarray:
        return self._values("Get", references, np.zeros(count)) if references else np.zeros(0)

    def states(self, count: int) -> np.ndarray:
        return self._vector("GetContinuousStates", np.zeros(count))

    def set_states(self, values: np.ndarray) -> None:
        self._vector("SetContinuousStates", np.ascontiguousarray(values, dtype=float))

    def rates(self, count: int) -> np.ndarray:
        return self._vector("GetDerivatives" if self.second else "GetContinuousStateDerivatives", np.zeros(count))

    def address(self, second: str, third: str) -> int | None:
        return self.fmu.address(second if self.second else third)

    def _vector(self, function: str, values: np.ndarray) -> np.ndarray:
        self.fmu.call(function, values.ctypes.data_as(ctypes.c_void_p), ctypes.c_size_t(len(values)))
        return values

    def _values(self, verb: str, references: Sequence[int], values: np.ndarray) -> np.ndarray:
        numbers = (ctypes.c_uint32 * len(references))(*references), ctypes.c_size_t(len(references))
        count = () if self.second else (ctypes.c_size_t(len(values)),)
        function = f"{verb}{self.fmu.kinds['Float64'][0]}"
        self.fmu.call(function, *numbers, values.ctypes.data_as(ctypes.c_void_p), *count)
        return values


class _Joined(_Instance):
    """A coupled system in one FMU, whose variables have the places in `names` as references."""

    def __init__(self, path: Path, names: Sequence[str]) -> None:
        super().__init__(path, True)
        self._own = [self.description.by_name[name][1] for name in names]

    def begin(self, time: float, settings: dict[int, list[float]], inputs: Inputs = ((), ())) -> None:
        """As of any FMU."""
        super().begin(time, {self._own[reference]: values for reference, values in settings.items()}, inputs)

    def numbers(self, references: Sequence[int]) -> Sequence[int]:
        """The FMU's own references of variables."""
        return [self._own[reference] for reference in references]


def _run(instance: _Instance, request: RunRequest) -> list[tuple[int, np.ndarray]]:
    """Number of samples reached and outputs (n, nz) of each variant; see runner.c for what negative numbers mean.

    The first request shows whether an FMU that is stepped does after a reset what it did before: with some tools it does not.
    """
    if instance.resets is None:
        first = replace(request, variants=request.variants[:1])
        try:
            new, again = (_answers(instance, first)[0] for instance.resets in (False, True))
            instance.resets = new[0] == again[0] and np.allclose(new[1], again[1], rtol=1e-6, atol=0.0, equal_nan=True)
        except ComponentError:  # the request itself shows whether it is the reset that fails
            instance.resets = False
    return _answers(instance, request)


def _answers(instance: _Instance, request: RunRequest) -> list[tuple[int, np.ndarray]]:
    wiring, n = request.wiring, len(request.time)
    library = ctypes.CDLL(str(request.library))
    kept: list[Any] = [
        *(
            (ctypes.c_uint * max(len(r), 1))(*instance.numbers(r))
            for r in (wiring.inputs, wiring.sensed, wiring.outputs)
        ),
        (ctypes.c_int * max(len(wiring.differenced), 1))(*wiring.differenced),
        (ctypes.c_int * max(request.inputs.shape[1], 1))(*request.held),
    ]
    time, inputs = (np.ascontiguousarray(part, dtype=float) for part in (request.time, request.inputs))
    stepped = instance.cosimulation
    found = []
    for variant in request.variants:
        instance.begin(float(time[0]), variant.settings, (instance.numbers(wiring.inputs), inputs[0].tolist()))
        functions = [
            None if stepped else instance.address("SetTime", "SetTime"),
            None if stepped else instance.address("SetContinuousStates", "SetContinuousStates"),
            None if stepped else instance.address("GetDerivatives", "GetContinuousStateDerivatives"),
            instance.address("SetReal", "SetFloat64"),
            instance.address("GetReal", "GetFloat64"),
            instance.address("DoStep", "DoStep") if stepped else None,
            None if stepped else instance.address("CompletedIntegratorStep", "CompletedIntegratorStep"),
            instance.address("SetRealInputDerivatives", "") if instance.interpolates else None,
        ]
        p, d, start = (
            np.ascontiguousarray(part, dtype=float) for part in (variant.parameters, variant.delayed, variant.start)
        )
        nx = request.n_states
        problem = _Problem(
            *(2 if instance.second else 3, int(stepped), n, nx, len(start) - nx, inputs.shape[1], wiring.n_inputs),
            *(wiring.n_sensed + len(wiring.differenced), wiring.n_sensed, wiring.n_outputs, request.n_results),
            *(
                d.shape[1],
                request.substeps,
                request.n_added,
                len(wiring.inputs),
                len(wiring.sensed),
                len(wiring.outputs),
            ),
            instance.fmu.component,
            *functions,
            *(ctypes.addressof(part) for part in kept[:-1]),
            *(part.ctypes.data for part in (time, inputs, d, p)),
            ctypes.addressof(kept[-1]),
        )
        outputs = np.zeros((n, request.n_results))
        reached = library.run_with_effects(
            ctypes.byref(problem), start.ctypes.data_as(ctypes.c_void_p), outputs.ctypes.data_as(ctypes.c_void_p)
        )
        found.append((int(reached), outputs))
        if reached < -1:  # after an error an instance may only be reset or freed
            instance.fmu.reset()
    return found


@dataclass(frozen=True)
class Probe:
    """States after initialisation, outputs and Jacobians at the asked states and inputs.

    `waits_for_events` tells that a time was announced at which something jumps.
    """

    states: np.ndarray
    outputs: np.ndarray
    rates_by_states: np.ndarray
    rates_by_inputs: np.ndarray
    outputs_by_states: np.ndarray
    outputs_by_inputs: np.ndarray
    waits_for_events: bool = False


def _jacobian(
    instance: _Instance, request: "ProbeRequest | PathRequest | SlopesRequest", x: np.ndarray, inputs: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Rates and outputs, and their Jacobian in states and inputs: asked for, or by differences."""
    wiring, nx = request.wiring, len(request.states)

    def values(at: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        if nx:
            instance.set_states(at)
        instance.set(wiring.inputs, inputs.tolist())
        rates = instance.rates(nx) if nx else np.zeros(0)
        return np.concatenate([rates, instance.get(wiring.outputs, wiring.n_outputs)])

    here = values(x, inputs)
    if request.directional:
        unknown = [*request.rates, *wiring.outputs]
        columns = [
            np.array(instance.fmu.directional_by_reference(unknown, [known], [1.0]))
            for known in (*request.states, *wiring.inputs)
        ]
    else:
        columns = []
        for k in range(nx + len(inputs)):
            ahead = [x.copy(), inputs.copy()]
            part, place = (ahead[0], k) if k < nx else (ahead[1], k - nx)
            step = NUDGE * max(abs(part[place]), 1.0)
            part[place] += step
            columns.append((values(*ahead) - here) / step)
    return here, np.column_stack(columns) if columns else np.zeros((len(here), 0))


def _path(instance: _Instance, request: PathRequest) -> np.ndarray:
    """Jacobians (n, nx + outputs, nx + inputs) at the samples of a free run (Runge-Kutta, inputs linear between samples, or held)."""
    time, inputs, x = request.time, request.inputs, request.start
    held = np.array(request.held or [False] * inputs.shape[1])
    instance.begin(float(time[0]), {})

    def rate(k: int, at: float, x: np.ndarray) -> np.ndarray:
        instance.set_time(at)
        instance.set_states(x)
        lines = np.array([np.interp(at, time, column) for column in inputs.T])
        instance.set(request.wiring.inputs, np.where(held, inputs[k], lines).tolist())
        return instance.rates(len(x))

    found = []
    for k, at in enumerate(time):
        instance.set_time(float(at))
        found.append(_jacobian(instance, request, x, inputs[k])[1])
        h = (time[min(k + 1, len(time) - 1)] - at) / request.substeps
        for j in range(request.substeps if h > 0 else 0):
            t = float(at + j * h)
            k1 = rate(k, t, x)
            k2 = rate(k, t + h / 2, x + h / 2 * k1)
            k3 = rate(k, t + h / 2, x + h / 2 * k2)
            k4 = rate(k, t + h, x + h * k3)
            x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return np.array(found)


def _probe(instance: _Instance, request: ProbeRequest) -> Probe:
    instance.begin(0.0, {})
    nx = len(request.states)
    base = instance.states(nx) if nx else np.zeros(0)
    x = base if request.start is None else request.start

    here, jacobian = _jacobian(instance, request, x, request.inputs)
    by_states, by_inputs = jacobian[:, :nx], jacobian[:, nx:]
    return Probe(
        base, here[nx:], by_states[:nx], by_inputs[:nx], by_states[nx:], by_inputs[nx:], instance.waits_for_events
    )


def _rates(instance: _Instance, request: RatesRequest) -> np.ndarray:
    """Rates (n, nx), each sample by itself."""
    instance.begin(float(request.time[0]), {})
    found = np.zeros_like(request.states)
    for k, (time, states, inputs) in enumerate(zip(request.time, request.states, request.inputs, strict=True)):
        instance.set_time(float(time))
        instance.set_states(states)
        instance.set(request.wiring.inputs, inputs.tolist())
        found[k] = instance.rates(states.size)
    return found


def _slopes(instance: _Instance, request: SlopesRequest) -> tuple[np.ndarray, np.ndarray]:
    """Rates and outputs (n, nx + outputs), and Jacobians (n, nx + outputs, nx + inputs), each sample by itself."""
    instance.begin(float(request.time[0]), request.settings)
    values, slopes = [], []
    for time, states, inputs in zip(request.time, request.at, request.inputs, strict=True):
        instance.set_time(float(time))
        here, jacobian = _jacobian(instance, request, states, inputs)
        values.append(here)
        slopes.append(jacobian)
    return np.array(values), np.array(slopes)


ANSWERS: dict[type, Any] = {
    RunRequest: _run,
    ProbeRequest: _probe,
    RatesRequest: _rates,
    PathRequest: _path,
    SlopesRequest: _slopes,
}


def answer(path: Path, cosimulation: bool, join_forces: bool, request: Any) -> tuple[bool, Any]:
    """Whether the FMU or system at `path` could answer a request, and the answer, else what went wrong in words.

    Args:
        path: of the FMU or the system file, which stays open for the next request.
        cosimulation: whether an FMU is stepped, rather than its equations integrated.
        join_forces: whether forces of a system are joined.
        request: one of the classes in `ANSWERS`.
    """
    try:
        return True, ANSWERS[type(request)](_opened(path, cosimulation, join_forces), request)
    except Exception as error:  # whatever native wrappers raise becomes a message for the host
        return False, " ".join(str(error).split()) or type(error).__name__


@cache
def _opened(path: Path, cosimulation: bool, join_forces: bool) -> Any:
    """The FMU, or the coupled system that stands in its place."""
    silence = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):  # what an FMU prints belongs to nobody's result
        os.dup2(silence, stream)
    if path.suffix == ".fmu":
        return _Instance(path, cosimulation)
    return opened_system(path, join_forces)


def opened_system(path: Path, join_forces: bool) -> Any:
    """A coupled system as one FMU, which runs in C; or step by step in Python, if it holds what no FMU can hold."""
    from orchestrator.blackbox.exposed import exposed
    from orchestrator.blackbox.system_runs import SystemInstance
    from orchestrator.cosim.container import container_of
    from orchestrator.cosim.load import load_system

    seen = exposed(load_system(path), path.name, join_forces=join_forces)
    # What is shown by its own name is so in the FMU without being asked for.
    named = {name: address for name, address in seen.system.outputs.items() if name != address}
    with tempfile.TemporaryDirectory() as folder:
        try:
            files, _ = container_of(replace(seen.system, outputs=named), "system", Path(folder))
        except MisfitError:
            return SystemInstance(seen)
        return _Joined(files[0], [*seen.inputs, *seen.system.outputs, *seen.starts])
