"""A linear controller in state space, continuous or sampled, such as those designed with python-control."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmus.errors import ComponentError, MisfitError
from orchestrator.cosim.component import Component, Port, StepEnd, Timed
from orchestrator.cosim.kinds.code import load_object, named_ports, told
from orchestrator.cosim.system import ComponentSpec
from orchestrator.measurements.wording import shown

Matrix = NDArray[np.float64]
_START = "x0"
# A step this close to a whole number of samples is one.
_SAME = 1e-6


def open_controller(spec: ComponentSpec, folder: Path) -> Component:
    """Make a controller of matrices in the options, or of the object that `source` names.

    `source` is `file.py:NAME` or `module:NAME` of a `control.StateSpace` or `TransferFunction`, or of a function that
    returns one. Options: `a`, `b`, `c`, `d`, lists of rows; `sample_time` in s, 0 or absent for a continuous one;
    `inputs` and `outputs`, names or a table of names and units (by default those of the object, else `u` and `y`, or
    `u1`, `u2`, ...).

    Raises:
        MisfitError: if the matrices do not fit each other, or the object is no linear system.
    """
    if spec.source:
        if any(key in spec.options for key in ("a", "b", "c", "d", "sample_time")):
            raise MisfitError(f"give either matrices or the source {spec.source}, not both")
        matrices, sample_time, names = _designed(spec.source, folder)
    else:
        matrices, names = _matrices(spec), {}
        sample_time = spec.options.get("sample_time", 0.0)
    if isinstance(sample_time, bool) or not isinstance(sample_time, int | float) or not 0.0 <= sample_time < np.inf:
        raise MisfitError(f"sample_time = {shown(sample_time)}; expected a time in s, or 0 for a continuous controller")
    sizes = {"inputs": matrices[1].shape[1], "outputs": matrices[2].shape[0]}
    ports = []
    for key, size in sizes.items():
        letter = "u" if key == "inputs" else "y"
        default = names.get(key) or ([letter] if size == 1 else [f"{letter}{k + 1}" for k in range(size)])
        found = named_ports(spec.options.get(key, default), key[:-1], key)
        if len(found) != size:
            raise MisfitError(f"{key} names {len(found)} signals, the matrices have {size}")
        ports.append(found)
    return LinearController(matrices, float(sample_time), ports[0], ports[1])


def _designed(source: str, folder: Path) -> tuple[tuple[Matrix, ...], float, dict[str, list[str]]]:
    import control

    made = load_object(source, folder)
    if callable(made) and not isinstance(made, control.StateSpace | control.TransferFunction):
        try:
            made = made()
        except Exception as error:  # whatever the user's function raises
            raise MisfitError(f"{source} failed: {told(error)}") from error
    if isinstance(made, control.TransferFunction):
        made = control.ss(made)
    if not isinstance(made, control.StateSpace):
        raise MisfitError(f"{source} is a {type(made).__name__}, expected a control.StateSpace or TransferFunction")
    if made.dt is True:
        raise MisfitError(f"{source} is sampled, but with no sample time; give it one, such as dt=0.01")
    matrices = tuple(np.asarray(each, dtype=float) for each in (made.A, made.B, made.C, made.D))
    # Without names of its own, the library numbers signals as u[0], u[1].
    labels = {"inputs": list(made.input_labels), "outputs": list(made.output_labels)}
    named = {key: found for key, found in labels.items() if not any(label.endswith("]") for label in found)}
    return matrices, float(made.dt or 0.0), named


def _matrices(spec: ComponentSpec) -> tuple[Matrix, ...]:
    given: dict[str, Any] = {key: spec.options.get(key) for key in "abcd"}
    if given["d"] is None and None in (given["b"], given["c"]):
        raise MisfitError("no matrices; expected a, b, c and d as lists of rows, or d alone for a gain")
    try:
        found = {key: np.array(value, dtype=float, ndmin=2) for key, value in given.items() if value is not None}
    except (TypeError, ValueError) as error:
        raise MisfitError(
            f"the matrices a, b, c, d are lists of rows of numbers, such as a = [[-1.0]] ({error})"
        ) from error
    if "a" not in found:
        found["a"] = np.zeros((0, 0))
        found["b"], found["c"] = np.zeros((0, found["d"].shape[1])), np.zeros((found["d"].shape[0], 0))
    for key in ("b", "c"):
        if key not in found:
            raise MisfitError(f"there is a matrix a, but no {key}")
    n, m, p = found["a"].shape[0], found["b"].shape[1], found["c"].shape[0]
    found.setdefault("d", np.zeros((p, m)))
    for key, shape in (("a", (n, n)), ("b", (n, m)), ("c", (p, n)), ("d", (p, m))):
        if found[key].shape != shape:
            raise MisfitError(f"matrix {key} has the shape {found[key].shape}, expected {shape} beside the others")
    return tuple(found[key] for key in "abcd")


class LinearController(Timed):
    """`y = c x + d u` with `dx/dt = a x + b u`, or `x(t + sample_time) = a x + b u` where it is sampled.

    A continuous controller is advanced exactly for inputs that are constant over the step (matrix exponential). The
    parameter `x0` holds the first state, (n,).
    """

    kind = "controller"
    can_differentiate = True

    def __init__(
        self, matrices: Sequence[Matrix], sample_time: float, inputs: Sequence[Port], outputs: Sequence[Port]
    ) -> None:
        self.matrices, self.sample_time = tuple(matrices), sample_time
        self._a, self._b, self._c, self._d = matrices
        self._inputs, self._outputs = (tuple(port.name for port in ports) for ports in (inputs, outputs))
        n = self._a.shape[0]
        start = Port(_START, "parameter", shape=(n,), variability="fixed", start=np.zeros(n), initial="exact")
        self.ports = (*inputs, *outputs, *([start] if n else []))
        self.feedthrough = {
            name: tuple(self._inputs[k] for k in np.flatnonzero(row))
            for name, row in zip(self._outputs, self._d, strict=True)
        }
        self.variable_step, self.own_step = (False, sample_time) if sample_time else (True, None)
        self._u, self._x = np.zeros(len(self._inputs)), np.zeros(n)
        self._exact: dict[float, tuple[Matrix, Matrix]] = {}

    def set(self, names: Sequence[str], values: Sequence[Any]) -> None:
        """Keep inputs, or the first state."""
        for name, value in zip(names, values, strict=True):
            if name == _START:
                self._x = np.array(value, dtype=float)
            else:
                self._u[self._inputs.index(name)] = value

    def get(self, names: Sequence[str]) -> list[Any]:
        """Values of outputs, inputs and the state."""
        y = self._c @ self._x + self._d @ self._u
        found = {**dict(zip(self._inputs, self._u, strict=True)), **dict(zip(self._outputs, y, strict=True))}
        return [self._x.copy() if name == _START else float(found[name]) for name in names]

    def step(self, time: float, size: float) -> StepEnd:
        """Advance with the inputs held; a sampled controller by a whole number of samples."""
        if not self.sample_time:
            a, b = self.exact_step(size)
            self._x = a @ self._x + b @ self._u
            return StepEnd(time + size)
        samples = size / self.sample_time
        if abs(samples - round(samples)) > _SAME or round(samples) == 0:
            raise ComponentError(
                f"a controller sampled every {self.sample_time:g} s cannot step by {size:g} s; let its step be a multiple"
            )
        for _ in range(round(samples)):
            self._x = self._a @ self._x + self._b @ self._u
        return StepEnd(time + size)

    def save(self) -> object:
        """State and inputs."""
        return self._x.copy(), self._u.copy()

    def restore(self, state: object) -> None:
        """Go back to a state."""
        assert isinstance(state, tuple)
        self._x, self._u = state[0].copy(), state[1].copy()

    def derivative(self, outputs: Sequence[str], inputs: Sequence[str], seed: Sequence[float]) -> list[float]:
        """Columns of `d` times the seed."""
        direction = np.zeros(len(self._inputs))
        for name, value in zip(inputs, seed, strict=True):
            direction[self._inputs.index(name)] = value
        found = self._d @ direction
        return [float(found[self._outputs.index(name)]) for name in outputs]

    def exact_step(self, size: float) -> tuple[Matrix, Matrix]:
        """exp([[a, b], [0, 0]] size), whose upper blocks advance the state (van Loan 1978); kept for the last sizes."""
        if size not in self._exact:
            from scipy.linalg import expm

            n, m = self._b.shape
            block = np.zeros((n + m, n + m))
            block[:n, :n], block[:n, n:] = self._a, self._b
            whole = expm(block * size)
            if len(self._exact) >= 8:
                self._exact.pop(next(iter(self._exact)))
            self._exact[size] = whole[:n, :n], whole[:n, n:]
        return self._exact[size]
