"""Least-squares fit of free runs to measured trials: shared parameters, and start values of each trial."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from fmus.errors import ComponentError
from orchestrator.models.compiled import CompiledModel

# Beyond this a run depends on its start as a diverging one does, and normal equations would overflow.
STEEPEST = 1e30
# A failed run must look worse than any run that ends, without being infinite.
FAILED = 1e6
Z90 = 1.6449


@dataclass(frozen=True)
class Record:
    """One trial as the fit sees it: samples at `time` (n,) s, `inputs` (n, nu), `measured` (n, ny).

    `start` (nx,) is the first guess of the start values; `start_std` (nx,) how far they may lie from it (infinite
    where nothing is known), `start_low` and `start_high` bound them.
    """

    time: np.ndarray
    inputs: np.ndarray
    measured: np.ndarray
    start: np.ndarray
    start_std: np.ndarray
    start_low: np.ndarray
    start_high: np.ndarray


@dataclass(frozen=True)
class Fit:
    """Result of a fit: parameter values with standard deviations (n_free,), and start values of each trial.

    `cost` is the mean square of the weighted residuals; `at_bound` tells which parameters ended at a bound.
    """

    values: np.ndarray
    std: np.ndarray
    starts: tuple[np.ndarray, ...]
    cost: float
    at_bound: np.ndarray


def fit(
    model: CompiledModel,
    records: Sequence[Record],
    noise: np.ndarray,
    first: ArrayLike,
    low: ArrayLike,
    high: ArrayLike,
    *,
    substeps: int,
    reduce: Callable[[np.ndarray], np.ndarray] = lambda series: series,
    precise: bool = True,
    threads: int = 2,
) -> Fit:
    """Fit the model's free parameters and every trial's start values.

    Minimises the sum of squares of reduce(simulated - measured)/noise, with gradients from the sensitivities of the
    compiled model (trust-region reflective, scipy). Standard deviations come from the sandwich estimator over blocks
    of samples, so that residuals that are correlated in time do not make intervals too narrow.

    Args:
        noise: (ny,) weight of each output, in its unit.
        first, low, high: start value and bounds of each free parameter.
        reduce: linear map along the first axis, such as a filter; applied to residuals and gradients alike.
        precise: iterate to full accuracy, else until the cost changes by less than 0.1 %.

    Raises:
        ComponentError: if the model fails already at the first guess.
    """
    problem = _Problem(model, records, noise, substeps, reduce, threads)
    first, low, high = (np.asarray(part, dtype=float) for part in (first, low, high))
    scale = np.maximum(np.abs(first), 1e-3 * (high - low))
    bounds = problem.join(low, [r.start_low for r in records]), problem.join(high, [r.start_high for r in records])
    guess = np.clip(problem.join(first, [r.start for r in records]), *bounds)
    residual, jacobian = problem.evaluate(guess, strict=guess.size > 0)
    if not jacobian.any():  # nothing to fit, or nothing that the data depend on
        values, starts = problem.split(guess)
        cost = float(np.mean(residual[: problem.data_rows] ** 2))
        return Fit(values, np.full(len(values), np.inf), starts, cost, np.zeros(len(values), bool))
    tolerance = 1e-7 if precise else 1e-3
    with np.errstate(all="ignore"):  # a step into a region where the run fails overflows and is rejected
        found = least_squares(
            problem.residual,
            guess,
            problem.jacobian,
            bounds=bounds,
            x_scale=problem.join(scale, [np.where(np.isfinite(r.start_std), r.start_std, 0.1) for r in records]),
            ftol=tolerance,
            xtol=1e-9 if precise else 1e-4,
            gtol=None,
            max_nfev=60 if precise else 25,
        )
    values, starts = problem.split(found.x)
    residual, jacobian = problem.evaluate(found.x)
    n_data = problem.data_rows
    std = _sandwich_std(residual, jacobian, problem.block_edges, len(values))
    # A small value is not at its bound if the data tell it apart from the bound.
    distance = np.minimum(values - low, high - values)
    at_bound = (distance < 1e-4 * (high - low)) & (distance < 3 * std)
    return Fit(
        values,
        std,
        starts,
        float(np.mean(residual[:n_data] ** 2)),
        at_bound,
    )


class _Problem:
    """Residuals and Jacobian as functions of one vector [free parameters, start values of trial 1, 2, ...]."""

    def __init__(
        self,
        model: CompiledModel,
        records: Sequence[Record],
        noise: np.ndarray,
        substeps: int,
        reduce: Callable[[np.ndarray], np.ndarray],
        threads: int,
    ) -> None:
        self.model, self.records, self.noise, self.substeps = model, records, noise, substeps
        self.reduce, self.threads = reduce, threads
        self.n_free, self.nx = len(model.free), len(model.system.states)
        self.data_rows = 0
        self.block_edges: list[int] = []
        self._last: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None

    def join(self, free: np.ndarray, starts: Sequence[np.ndarray]) -> np.ndarray:
        return np.concatenate([free, *starts])

    def split(self, vector: np.ndarray) -> tuple[np.ndarray, tuple[np.ndarray, ...]]:
        starts = vector[self.n_free :].reshape(len(self.records), self.nx)
        return vector[: self.n_free], tuple(starts)

    def residual(self, vector: np.ndarray) -> np.ndarray:
        return self.evaluate(vector)[0]

    def jacobian(self, vector: np.ndarray) -> np.ndarray:
        return self.evaluate(vector)[1]

    def evaluate(self, vector: np.ndarray, strict: bool = False) -> tuple[np.ndarray, np.ndarray]:
        """Weighted residuals (data of all trials, then priors) and their Jacobian; kept for the last vector."""
        if self._last is not None and np.array_equal(self._last[0], vector):
            return self._last[1], self._last[2]
        free, starts = self.split(vector)
        parameters = self.model.with_values(free)
        with ThreadPoolExecutor(self.threads) as pool:  # the compiled model runs without the interpreter's lock
            jobs = [
                pool.submit(self._trial, r, parameters, s, strict) for r, s in zip(self.records, starts, strict=True)
            ]
            parts = [job.result() for job in jobs]
        residuals, jacobian = self._assemble(parts, starts, len(vector))
        self._last = (vector.copy(), residuals, jacobian)
        return residuals, jacobian

    def _trial(
        self, record: Record, parameters: np.ndarray, start: np.ndarray, strict: bool
    ) -> tuple[np.ndarray, np.ndarray]:
        ny = len(self.model.outputs)
        try:
            run = self.model.run(
                record.time, record.inputs, parameters, start, substeps=self.substeps, sensitivities=True
            )
            assert run.sensitivities is not None
            if not np.all(np.abs(run.sensitivities) < STEEPEST):
                raise ComponentError(f"{self.model.system.name}: the sensitivities of a free run overflow")
        except ComponentError:
            if strict:
                raise
            rows = self.reduce(np.zeros((len(record.time), ny))).size
            return np.full(rows, FAILED), np.zeros((rows, self.nx + self.n_free))
        residual = self.reduce((run.outputs - record.measured) / self.noise)
        slopes = self.reduce(run.sensitivities / self.noise[None, :, None])
        return residual.ravel(), slopes.reshape(residual.size, -1)

    def _assemble(
        self, parts: list[tuple[np.ndarray, np.ndarray]], starts: tuple[np.ndarray, ...], width: int
    ) -> tuple[np.ndarray, np.ndarray]:
        self.data_rows = sum(len(residual) for residual, _ in parts)
        prior_rows = self.nx * len(parts)
        residuals, jacobian = np.zeros(self.data_rows + prior_rows), np.zeros((self.data_rows + prior_rows, width))
        row, self.block_edges = 0, [0]
        for k, (residual, slopes) in enumerate(parts):
            columns = slice(self.n_free + k * self.nx, self.n_free + (k + 1) * self.nx)
            rows = slice(row, row + len(residual))
            residuals[rows] = residual
            jacobian[rows, columns], jacobian[rows, : self.n_free] = slopes[:, : self.nx], slopes[:, self.nx :]
            self.block_edges += [row + int(e) for e in np.linspace(0, len(residual), 21)[1:]]
            row += len(residual)
            prior = slice(self.data_rows + k * self.nx, self.data_rows + (k + 1) * self.nx)
            residuals[prior] = (starts[k] - self.records[k].start) / self.records[k].start_std
            jacobian[prior, columns] = np.diag(1 / self.records[k].start_std)
        return residuals, jacobian


def _sandwich_std(residual: np.ndarray, jacobian: np.ndarray, edges: Sequence[int], n_free: int) -> np.ndarray:
    """Standard deviations of the first `n_free` unknowns.

    H^-1 (sum of g_b g_b') H^-1 over blocks b of samples, times B/(B - k) for B blocks and k unknowns, which a fit has
    drawn towards the data; never less than for white residuals, as few blocks can agree by chance.
    """
    inverse = np.linalg.pinv(jacobian.T @ jacobian, hermitian=True)
    blocks = list(zip(edges[:-1], edges[1:], strict=True))
    gradients = np.array([jacobian[a:b].T @ residual[a:b] for a, b in blocks])
    used = len(blocks) / max(len(blocks) - jacobian.shape[1], 1)
    correlated = used * np.diag(inverse @ (gradients.T @ gradients) @ inverse)
    white = np.diag(inverse) * float(np.mean(residual[: edges[-1]] ** 2))
    return np.sqrt(np.maximum(correlated, white)[:n_free])
