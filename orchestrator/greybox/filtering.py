"""Extended Kalman filter of a model whose balance equations are disturbed by white noise: innovations and their slopes.

The model is dx = f(x, u, theta) dt + S dw, y = h(x) + e. With the innovations and their variances goes the likelihood of
theta, S and the sensors' noise (Schweppe 1965; Kristensen, Madsen, Jorgensen, Automatica 40, 2004, for grey boxes).
"""

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from pathlib import Path

import casadi as ca
import numpy as np

from fmus.errors import ComponentError
from fmus.symbolic.system import SymbolicSystem
from orchestrator.models.compiled import FOR_LOOPS, SIMULATOR, CompiledModel, _Problem, build_library

_SOURCE = Path(__file__).with_name("filter.c")


class _FilterProblem(ctypes.Structure):
    """Mirror of `filter_problem` in filter.c."""

    _fields_ = [(name, ctypes.c_longlong) for name in ("nb", "sensitivities")] + [
        (name, ctypes.c_void_p)
        for name in (
            "measured",
            "start",
            "spread",
            "intensity",
            "noise",
            "steps",
            "innovation",
            "variance",
            "slope",
            "ahead",
            "mean",
            "transition",
            "ahead_covariance",
            "covariance",
            "push",
            "reading",
            "missed",
            "halved",
        )
    ]


@dataclass(frozen=True, eq=False)
class Trial:
    """A trial for the filter: `time` (n,) s, `inputs` (n, nu), `measured` (n, ny) with NaN where nothing was measured.

    `start` and `spread` (nx,) are mean and standard deviation of the states at the first sample, `steps` (n,) the integration
    steps in the interval that ends at a sample, one in each without it.
    """

    name: str
    time: np.ndarray
    inputs: np.ndarray
    measured: np.ndarray
    start: np.ndarray
    spread: np.ndarray
    steps: np.ndarray | None = None

    @property
    def parts(self) -> np.ndarray:
        """Integration steps in the interval that ends at a sample, (n,)."""
        return np.ones(len(self.time), dtype=np.longlong) if self.steps is None else self.steps

    def in_steps(self, steps: np.ndarray | int) -> "Trial":
        """The trial with so many integration steps in each interval."""
        return replace(self, steps=np.full(len(self.time), steps, dtype=np.longlong))


@dataclass(frozen=True, eq=False)
class Filtered:
    """What a filter found along a trial.

    `innovation` and `variance` (n, ny): one-step prediction errors, channel after channel, and their variances (0 where
    nothing was measured). `slope` (n, ny, ntheta): d(innovation)/d(theta) at frozen gains. `ahead`, `mean` (n, nx): states
    before and after the measurements of an instant. Matrices (n, nx, nx) are there if they were asked for.
    """

    innovation: np.ndarray
    variance: np.ndarray
    slope: np.ndarray
    ahead: np.ndarray
    mean: np.ndarray
    transition: np.ndarray | None = None
    ahead_covariance: np.ndarray | None = None
    covariance: np.ndarray | None = None

    @property
    def log_likelihood(self) -> float:
        """Of the measurements, up to a constant."""
        seen = self.variance > 0
        with np.errstate(all="ignore"):  # a model that fails may leave the range of numbers
            return self._log_likelihood(seen)

    def _log_likelihood(self, seen: np.ndarray) -> float:
        return -0.5 * float(np.sum(self.innovation[seen] ** 2 / self.variance[seen] + np.log(self.variance[seen])))


@dataclass(frozen=True, eq=False)
class InLines:
    """A model in lines about a run of the filter, for the likelihood of a trial with other noise, at a sixth of a run's cost or less.

    `transition` (n, nx, nx), `push` (n, nx, nb), `reading` (n, ny, nx) and `missed` (n, ny) are the slopes and errors of that run,
    `moved` (n, nx) by how much measurements moved its states, `spread` (nx,) of the first ones.
    """

    time: np.ndarray
    transition: np.ndarray
    push: np.ndarray
    reading: np.ndarray
    missed: np.ndarray
    moved: np.ndarray
    spread: np.ndarray

    def log_likelihood(self, intensity: np.ndarray, noise: np.ndarray) -> float:
        """Of the measurements, up to a constant; minus infinity where the filter fails."""
        return self._asked(intensity, noise)

    def slopes(self, intensity: np.ndarray, noise: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        """The log likelihood, its gradient (nb + ny,) by the logarithms of intensities and noise, and the information about them
        (nb + ny, nb + ny) without what neighbouring samples share; for about three times the cost of the first alone.

        Gradient and information are 0 where the filter fails.
        """
        size = len(intensity) + len(noise)
        gradient, information = np.zeros(size), np.zeros((size, size))
        value = self._asked(intensity, noise, gradient, information)
        if not np.isfinite(value):
            return value, np.zeros(size), np.zeros((size, size))
        return value, gradient, information

    def _asked(
        self,
        intensity: np.ndarray,
        noise: np.ndarray,
        gradient: np.ndarray | None = None,
        information: np.ndarray | None = None,
    ) -> float:
        n, nx, nb = self.push.shape
        sizes = np.array([n, nx, nb, self.missed.shape[1]], dtype=np.longlong)
        own = [np.ascontiguousarray(part, dtype=float) for part in (self.spread, intensity, noise)]
        parts = (
            sizes,
            *(self.time, self.transition, self.push, self.reading, self.missed, self.moved),
            *own,
            gradient,
            information,
        )
        places = [None if part is None else ctypes.c_void_p(part.ctypes.data) for part in parts]
        return -0.5 * float(_library().misfit_relinearised(*places))


class GreyBox:
    """A model with its balance inputs and free parameters, compiled for the filter.

    `begin(t, x, u, d, p)` says what the states start with that candidates bring with them, zero without it, and `unsure` by how
    much they may differ from that (standard deviations).
    """

    def __init__(
        self,
        system: SymbolicSystem,
        outputs: Sequence[str],
        balances: Sequence[str],
        theta: Sequence[str],
        held: Sequence[str] = (),
        begin: ca.Function | None = None,
        unsure: Sequence[float] = (),
    ):
        self.system, self.outputs, self.balances, self.theta = system, tuple(outputs), tuple(balances), tuple(theta)
        self.begin, self.unsure = begin, np.array(unsure, dtype=float)
        self.compiled = CompiledModel(system, outputs, (*balances, *theta), held=held)
        # Of each run so far, also those of other threads: integration steps times the operations of one, about the squared number of
        # states and two, of states and slopes, and those of the model's own rates.
        self.work: list[int] = []
        self._of_rates = system.rhs.n_instructions()

    def run(
        self,
        trial: Trial,
        theta: np.ndarray,
        intensity: np.ndarray,
        noise: np.ndarray,
        *,
        slopes: bool = False,
        covariances: bool = False,
    ) -> Filtered:
        """Filter a trial.

        Args:
            theta: (ntheta,) values of the free parameters.
            intensity: (nb,) of the white force on each balance, its unit times the root of a second.
            noise: (ny,) standard deviation of each sensor.

        Raises:
            ComponentError: if a value stops being finite, with the time.
        """
        n, nx = len(trial.time), len(self.system.states)
        matrices = [np.zeros((n, nx, nx)) for _ in range(3)] if covariances else []
        result = self._filtered(trial, theta, intensity, noise, slopes, matrices)
        return Filtered(*result, *matrices)

    def off_by_steps(self, trial: Trial, theta: np.ndarray, intensity: np.ndarray, noise: np.ndarray) -> np.ndarray:
        """The most that steps of half the length would move a state in each interval, (n,), in standard deviations of it ahead.

        Arguments as of `run`.

        Raises:
            ComponentError: if a value stops being finite, with the time.
        """
        halved = np.zeros(len(trial.time))
        self._filtered(trial, theta, intensity, noise, False, [None] * 6 + [halved])
        return halved

    def in_lines(self, trial: Trial, theta: np.ndarray, intensity: np.ndarray, noise: np.ndarray) -> InLines:
        """The model in lines about the run of a trial; arguments as of `run`.

        Raises:
            ComponentError: if a value stops being finite, with the time.
        """
        n, nx, ny, nb = len(trial.time), len(self.system.states), len(self.outputs), len(self.balances)
        shapes = ((n, nx, nx), (n, nx, nb), (n, ny, nx), (n, ny))
        transition, push, reading, missed = (np.zeros(shape) for shape in shapes)
        matrices = [transition, None, None, push, reading, missed]
        *_, ahead, mean = self._filtered(trial, theta, intensity, noise, False, matrices)
        time = np.ascontiguousarray(trial.time, dtype=float)
        return InLines(time, transition, push, reading, missed, mean - ahead, self._spread(trial))

    def _filtered(
        self,
        trial: Trial,
        theta: np.ndarray,
        intensity: np.ndarray,
        noise: np.ndarray,
        slopes: bool,
        matrices: Sequence[np.ndarray | None],
    ) -> list[np.ndarray]:
        """Innovations, variances, slopes, states before and after; `matrices` are filled, in the order of filter.c."""
        compiled, system = self.compiled, self.system
        n, nx, ny, nt = len(trial.time), len(system.states), len(self.outputs), len(self.theta) if slopes else 0
        values = compiled.with_values([*np.zeros(len(self.balances)), *theta])
        given = (
            trial.time,
            trial.inputs,
            *compiled._delays(trial.time, trial.inputs, values),
            np.zeros((1, 0)),
            values,
        )
        keep = [np.ascontiguousarray(part, dtype=float) for part in given]
        sizes = (n, nx, len(system.inputs), system.n_delays, ny, len(compiled.free), 1, 1, 0)
        code = compiled._machine_code
        problem = _Problem(*sizes, *(part.ctypes.data for part in (*keep, compiled._marks)), 0.0, *code.with_slopes)
        start = np.concatenate([trial.start, self._begun(trial, values)])
        parts = (trial.measured, start, self._spread(trial), intensity, noise)
        own = [np.ascontiguousarray(part, dtype=float) for part in parts]
        steps = np.ascontiguousarray(trial.parts, dtype=np.longlong)
        result = [np.empty((n, ny)), np.empty((n, ny)), np.empty((n, ny, nt)), np.empty((n, nx)), np.empty((n, nx))]
        wanted = [None if part is None else part.ctypes.data for part in matrices]
        places = [*(a.ctypes.data for a in (*own, steps, *result)), *wanted, *[None] * (7 - len(wanted))]
        request = _FilterProblem(len(self.balances), int(slopes), *places)
        self.work.append(int(trial.parts.sum()) * ((nx + 2) ** 2 + nx * nt + self._of_rates))
        reached = _library().misfit_filter_greybox(ctypes.byref(problem), ctypes.byref(request))
        if reached != n:
            raise ComponentError(f"{system.name} left the finite numbers at t = {trial.time[max(reached, 0)]:.4g} s")
        return result

    def _spread(self, trial: Trial) -> np.ndarray:
        """Standard deviations of the first states, those that candidates bring with them included."""
        more = len(self.system.states) - len(trial.spread)
        return np.concatenate([trial.spread, self.unsure if len(self.unsure) else np.zeros(more)])

    @cached_property
    def _begins_at_zero(self) -> bool:
        """Whether all that candidates bring with them begins at zero, which costs no call."""
        return self.begin is None or self.begin.nnz_out(0) == 0

    def _begun(self, trial: Trial, values: np.ndarray) -> np.ndarray:
        """States that candidates bring with them, at the first sample."""
        more = len(self.system.states) - len(trial.start)
        if not more or self.begin is None or self._begins_at_zero:
            return np.zeros(more)
        time, given = trial.time[0], trial.inputs[0]
        delayed = self.system.history(time, given, values)[0]
        return np.array(self.begin(time, trial.start, given, delayed, values)).ravel()


@cache
def _library() -> ctypes.CDLL:
    library = ctypes.CDLL(str(build_library(SIMULATOR.read_text() + _SOURCE.read_text(), level=FOR_LOOPS)))
    library.misfit_relinearised.restype = ctypes.c_double
    return library
