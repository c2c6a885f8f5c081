"""Why a run left the finite numbers: the time, the state that did, and the likely reason, found when the message is read."""

from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np

from fmus.errors import ComponentError
from fmus.symbolic.system import SymbolicSystem

# Runge and Kutta's steps h follow a time constant T while h/T stays below this.
STABLE = 2.78
# Beyond this size a state counts as lost, as a share of what it had been before.
LOST = 1e6
# A run that takes more steps is not repeated for its message.
MOST_STEPS = 100_000


class RunFailed(ComponentError):
    """A run that left the finite numbers; `explain` gives the message when it is asked for."""

    def __init__(self, explain: Callable[[], str]) -> None:
        super().__init__()
        self._explain = explain

    @cached_property
    def _text(self) -> str:
        with np.errstate(all="ignore"):
            return self._explain()

    def __str__(self) -> str:
        return self._text

    def __reduce__(self) -> tuple[type[ComponentError], tuple[str]]:
        """Travels to another process as its text."""
        return ComponentError, (str(self),)


def explained(
    system: SymbolicSystem,
    time: np.ndarray,
    inputs: np.ndarray,
    parameters: np.ndarray,
    start: np.ndarray,
    substeps: int,
    held: np.ndarray,
    outputs: Sequence[str],
    reached: int,
) -> str:
    """One line for a run of Runge's and Kutta's method that failed before sample `reached`.

    Args:
        system: the equations.
        time: (n,) in s.
        inputs: (n, nu).
        parameters: values of all parameters.
        start: (nx,), first values of the states.
        substeps: integration steps in a sample interval.
        held: which inputs (nu,) are held between samples.
        outputs: what the run was to give.
        reached: number of the sample that the run did not reach.
    """
    plain = f"{system.name} left the finite numbers at t = {time[max(reached, 0)]:.4g} s"
    if system.n_delays or system.contacts or not system.states or reached * substeps > MOST_STEPS:
        return plain
    run = _Run(system, time, inputs, parameters, substeps, held)
    at, before, after = run.to_the_end(np.asarray(start, dtype=float), outputs, reached)
    names = [v.name for v in system.states]
    if bad := run.no_number(at, before, outputs):
        values = ", ".join(f"{n} = {x:.4g}" for n, x in zip(names, before, strict=True))
        return (
            f"{plain}: {bad[0]} is no number at t = {at:.4g} s with {values}; look for a division by zero, a root or a "
            "logarithm of a negative number in its equation"
        )
    lost = int(np.argmax(np.where(np.isfinite(after), np.abs(after) / (1 + np.abs(before)), np.inf)))
    unit = system.states[lost].unit
    state = f"{names[lost]} = {before[lost]:.4g} {unit}".rstrip()
    speeds = np.linalg.eigvals(run.slopes(at, before)).real
    step = float(np.diff(time).max()) / substeps
    fastest, growing = float(-speeds.min(initial=0.0)), float(speeds.max(initial=0.0))
    if fastest * step > STABLE:
        return (
            f"{plain}: {state} was lost from t = {at:.4g} s on, where the model is stiff: a time constant of {1 / fastest:.2g} s "
            f"takes steps below {STABLE / fastest:.2g} s, these were {step:.2g} s; check the parameters that make it so fast"
        )
    if growing > 0:
        return (
            f"{plain}: {state} grows without bound from t = {at:.4g} s on, within {1 / growing:.2g} s by a factor of 2.7: the "
            "model is unstable there; check signs and start values"
        )
    return f"{plain}: {state} was lost from t = {at:.4g} s on; check start values and inputs there"


class _Run:
    """The same steps as the compiled run takes, one by one."""

    def __init__(
        self,
        system: SymbolicSystem,
        time: np.ndarray,
        inputs: np.ndarray,
        parameters: np.ndarray,
        substeps: int,
        held: np.ndarray,
    ) -> None:
        self.system, self.time, self.inputs, self.parameters = system, time, inputs, parameters
        self.substeps, self.held = substeps, np.asarray(held, dtype=bool)

    def _values(self, t: float, x: np.ndarray) -> list[np.ndarray]:
        """Rates and algebraic variables at a time."""
        return [np.array(part).ravel() for part in self.system.rhs(t, x, self._inputs(t), [], self.parameters)[:2]]

    def rate(self, t: float, x: np.ndarray) -> np.ndarray:
        """Rates (nx,) at a time."""
        return self._values(t, x)[0]

    def no_number(self, t: float, x: np.ndarray, outputs: Sequence[str]) -> list[str]:
        """Which rates and outputs are no numbers at a time."""
        rates, others = self._values(t, x)
        return [
            *(f"der({v.name})" for v, rate in zip(self.system.states, rates, strict=True) if not np.isfinite(rate)),
            *(
                v.name
                for v, value in zip(self.system.algebraics, others, strict=True)
                if v.name in outputs and not np.isfinite(value)
            ),
        ]

    def slopes(self, t: float, x: np.ndarray) -> np.ndarray:
        """Slopes of the rates in the states by differences, (nx, nx)."""
        here, columns = self.rate(t, x), []
        for k in range(len(x)):
            step = 1e-6 * (1 + abs(x[k]))
            columns.append((self.rate(t, x + step * np.eye(len(x))[k]) - here) / step)
        return np.nan_to_num(np.column_stack(columns))

    def to_the_end(self, x: np.ndarray, outputs: Sequence[str], reached: int) -> tuple[float, np.ndarray, np.ndarray]:
        """The time of the first step that loses a state or an output, and the states before and behind it."""
        sizes, t = np.abs(x), float(self.time[0])
        for k in range(max(reached, 1)):
            h = (self.time[min(k + 1, len(self.time) - 1)] - self.time[k]) / self.substeps
            for part in range(self.substeps):
                t = float(self.time[k] + part * h)
                if self.no_number(t, x, outputs):
                    return t, x, x
                after = self._step(t, x, h)
                if not np.isfinite(after).all() or np.any(np.abs(after) > LOST * (1 + sizes)):
                    return t, self._where(t, x, h), after
                sizes, x = np.maximum(sizes, np.minimum(np.abs(after), 1e3 * (1 + sizes))), after
        return t, x, x

    def _where(self, t: float, x: np.ndarray, h: float) -> np.ndarray:
        """The state within a step at which the rates are no numbers; its beginning if they are all through."""
        here, rates = x, self.rate(t, x)
        for reach in (0.5, 0.5, 1.0):
            if not np.isfinite(rates).all():
                return here
            here = x + reach * h * rates
            rates = self.rate(t + reach * h, here)
        return x if np.isfinite(rates).all() or not np.isfinite(here).all() else here

    def _step(self, t: float, x: np.ndarray, h: float) -> np.ndarray:
        one = self.rate(t, x)
        two = self.rate(t + h / 2, x + h / 2 * one)
        three = self.rate(t + h / 2, x + h / 2 * two)
        four = self.rate(t + h, x + h * three)
        return np.asarray(x + h / 6 * (one + 2 * two + 2 * three + four))

    def _inputs(self, t: float) -> np.ndarray:
        k = int(np.clip(np.searchsorted(self.time, t, side="right") - 1, 0, len(self.time) - 1))
        lines = np.array([np.interp(t, self.time, column) for column in self.inputs.T])
        return np.where(self.held, self.inputs[k], lines) if len(lines) else lines
