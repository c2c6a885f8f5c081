"""A model that is an FMU, from any vendor: simulated in a process of its own."""

import hashlib
import math
import multiprocessing
import threading
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from fmus.archive import read_archive
from fmus.errors import ComponentError, FmuError
from fmus.symbolic.system import Variable
from orchestrator.models.contract import FittedTrial
from orchestrator.models.fmu_worker import serve

TIME_LIMIT_S = 300.0
# Start values are fitted on this many samples; a run of the whole trial would cost much more and tell little.
START_SAMPLES = 400


class FmuModel:
    """An FMI 2.0 co-simulation FMU. States whose start values it lets one set are fitted to each trial.

    Raises:
        FmuError: if the file is not a usable FMU.
    """

    def __init__(self, path: Path) -> None:
        self.path, self.name = path, path.name
        self.content_hash = hashlib.sha256(self._content()).hexdigest()
        self._description = self._read()
        self._process: Any = None
        self._connection: Any = None
        self._lock = threading.Lock()

    @cached_property
    def inputs(self) -> Sequence[Variable]:
        return [_variable(v) for v in self._description.modelVariables if v.causality == "input" and v.type == "Real"]

    @cached_property
    def outputs(self) -> Sequence[Variable]:
        return [_variable(v) for v in self._description.modelVariables if v.causality == "output" and v.type == "Real"]

    @cached_property
    def states(self) -> Sequence[Variable]:
        """States whose start value can be set."""
        found = [unknown.variable.derivative for unknown in self._description.derivatives]
        return [_variable(v) for v in found if v is not None and v.initial in ("exact", "approx")]

    def simulate(
        self, time: np.ndarray, inputs: np.ndarray, names: Sequence[str], start: dict[str, float]
    ) -> np.ndarray:
        request = (time, inputs, [v.name for v in self.inputs], list(names), start)
        with self._lock:
            return self._ask(request)

    def follow(
        self, time: np.ndarray, inputs: np.ndarray, measured: np.ndarray, names: Sequence[str], noise: np.ndarray
    ) -> FittedTrial:
        states = [v.name for v in self.states]
        guess = np.array([v.start or 0.0 for v in self.states])
        n = min(len(time), START_SAMPLES)
        if states:
            residual = _StartResidual(self, time[:n], inputs[:n], measured[:n], names, noise, states)
            low = np.array([-np.inf if v.minimum is None else v.minimum for v in self.states])
            high = np.array([np.inf if v.maximum is None else v.maximum for v in self.states])
            guess = np.clip(guess, low, high)
            found = least_squares(residual, guess, bounds=(low, high), diff_step=1e-5, ftol=1e-6, max_nfev=15)
            guess = found.x
        start = dict(zip(states, map(float, guess), strict=True))
        return FittedTrial(self.simulate(time, inputs, names, start), start)

    def close(self) -> None:
        """End the child process."""
        if self._process is not None:
            self._connection.close()
            self._process.kill()
            self._process.join()
            self._process = None

    def _ask(self, request: tuple[Any, ...]) -> np.ndarray:
        if self._process is None:
            context = multiprocessing.get_context("spawn")
            self._connection, theirs = context.Pipe()
            self._process = context.Process(target=serve, args=(self.path, theirs), daemon=True)
            self._process.start()
            theirs.close()
        self._connection.send(request)
        try:
            if not self._connection.poll(TIME_LIMIT_S):
                self.close()
                raise ComponentError(f"FMU {self.name} gave no answer for {TIME_LIMIT_S:.0f} s and was stopped")
            kind, answer = self._connection.recv()
        except (EOFError, ConnectionError):
            self._process.join()
            code = self._process.exitcode
            self._process = None
            raise ComponentError(f"FMU {self.name} crashed its process (exit code {code})") from None
        if kind == "error":
            self.close()
            raise ComponentError(f"FMU {self.name} failed: {answer}")
        if not np.isfinite(answer).all():
            row = int(np.argmin(np.isfinite(answer).all(axis=1)))
            raise ComponentError(f"FMU {self.name} left the finite numbers at t = {request[0][row]:.4g} s")
        return answer

    def _content(self) -> bytes:
        try:
            return self.path.read_bytes()
        except OSError as error:
            raise FmuError(f"FMU {self.path} cannot be read: {error.strerror}") from error

    def _read(self) -> Any:
        import fmpy

        read_archive(self.path)  # refuses archives that are broken or unsafe
        try:
            description = fmpy.read_model_description(str(self.path))
        except Exception as error:  # fmpy raises many kinds for a broken description
            raise FmuError(
                f"FMU {self.name} has no usable model description: {' '.join(str(error).split())[:200]}"
            ) from error
        if description.fmiVersion != "2.0" or description.coSimulation is None:
            kind = "co-simulation" if description.coSimulation is not None else "model exchange only"
            raise FmuError(
                f"FMU {self.name} is FMI {description.fmiVersion} ({kind}); this command runs FMI 2.0 co-simulation"
            )
        return description


class _StartResidual:
    """Weighted residual over the first samples as a function of the start values."""

    def __init__(
        self,
        model: FmuModel,
        time: np.ndarray,
        inputs: np.ndarray,
        measured: np.ndarray,
        names: Sequence[str],
        noise: np.ndarray,
        states: Sequence[str],
    ) -> None:
        self.model, self.time, self.inputs, self.measured = model, time, inputs, measured
        self.names, self.noise, self.states = names, noise, states

    def __call__(self, values: np.ndarray) -> np.ndarray:
        start = dict(zip(self.states, map(float, values), strict=True))
        outputs = self.model.simulate(self.time, self.inputs, self.names, start)
        return ((outputs - self.measured) / self.noise).ravel()


def _variable(scalar: Any) -> Variable:
    unit = scalar.unit or (scalar.declaredType.unit if scalar.declaredType is not None else None) or ""
    return Variable(
        name=scalar.name,
        unit=unit,
        description=scalar.description or "",
        start=_number(scalar.start),
        minimum=_number(scalar.min),
        maximum=_number(scalar.max),
        nominal=_number(scalar.nominal),
    )


def _number(text: str | None) -> float | None:
    if text is None:
        return None
    value = float(text)
    return value if math.isfinite(value) else None
