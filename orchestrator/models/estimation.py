"""Least-squares fit of free runs to measured trials: shared parameters, and start values of each trial."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
import scipy
from numpy.typing import ArrayLike

from fmus.errors import ComponentError
from orchestrator.models.compiled import NOTHING_BEFORE, CompiledModel, FreeRun
from orchestrator.models.held_back import answers_to, likeliest, ways_before, whitened
from orchestrator.models.threads import on_idle_threads

# Beyond this a run depends on its start as a diverging one does, and normal equations would overflow.
STEEPEST = 1e30
# A failed run must look worse than any run that ends, without being infinite.
FAILED = 1e6
# A fit evaluates all free runs at most so often, and a rough one.
MOST_EVALUATIONS, MOST_IF_ROUGH, FEWEST = 60, 25, 8
# Operations (see CompiledModel.operations) after which a fit is given up, some ten seconds: a stiff effect that does not
# converge must not hold up a search. Seconds themselves would make results depend on the machine.
MOST_OPERATIONS = 2e10
# Integration steps in a sample interval that two masses with play take.
STEPS_WITH_CONTACTS = 20
Z90 = 1.6449
# Start values are first guessed at least this share of their range off their bounds: steps of the trust-region reflective
# method shrink with the distance to a bound, and end there.
OFF_BOUNDS = 0.05
# A value without bounds counts as if its range were so many times its first guess: what lies within 1e-4 of that is at a bound.
MANY = 50.0
# Clocks are off by at most so many standard deviations.
MOST_SHIFT = 2.0

Reduce = Callable[[np.ndarray], np.ndarray]


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

    def off_bounds(self, start: np.ndarray) -> np.ndarray:
        """Start values (nx,), those at their bounds, or near them, moved off these, so that a fit is not stuck there."""
        span = self.start_high - self.start_low
        margin = np.where(np.isfinite(span), OFF_BOUNDS * span, 0.0)
        return np.clip(start, self.start_low + margin, self.start_high - margin)


@dataclass(frozen=True)
class Prior:
    """What is known before a fit: free parameters lie within `std` (n_free,) of `mean`, infinite where nothing is known.

    Outputs were sampled later than inputs by a constant of zero mean and standard deviation `shift_std` s, and at most
    twice that; 0 if the clocks agree.
    """

    mean: np.ndarray
    std: np.ndarray
    shift_std: float = 0.0


@dataclass(frozen=True)
class Fit:
    """Result of a fit: parameter values with standard deviations (n_free,), and start values of each trial.

    `cost` is the mean square of the weighted residuals over all `rows` of them, `prior_cost` the sum of squares of the
    departures from priors; `at_bound` tells which parameters ended at a bound; `shift` is by how many seconds the
    outputs are late; `converged` is false if the fit was given up before the cost stopped changing. `correlation`
    (n_free, n_free) is that of the errors of the values, none (0, 0) where it is unknown. `held_back` is by how much what
    a model delays was off its first sample before each trial, as runs take it; empty without delays. `operations` is how many
    its runs took.
    """

    values: np.ndarray
    std: np.ndarray
    starts: tuple[np.ndarray, ...]
    cost: float
    at_bound: np.ndarray
    rows: int
    prior_cost: float = 0.0
    shift: float = 0.0
    converged: bool = True
    correlation: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    held_back: tuple[np.ndarray, ...] = ()
    operations: float = 0.0

    def before(self, trial: int) -> np.ndarray:
        """What was held back when a trial began."""
        return self.held_back[trial] if self.held_back else NOTHING_BEFORE

    @property
    def misfit(self) -> float:
        """Sum of squares of weighted residuals and of departures from priors: minus twice the log likelihood."""
        return self.cost * self.rows + self.prior_cost


def fit(
    model: CompiledModel,
    records: Sequence[Record],
    noise: np.ndarray,
    first: ArrayLike,
    low: ArrayLike,
    high: ArrayLike,
    *,
    substeps: int,
    prior: Prior | None = None,
    reduce: Reduce | Sequence[Reduce] = lambda series: series,
    tolerance: float = 1e-7,
    earlier: Fit | None = None,
) -> Fit:
    """Fit the model's free parameters and every trial's start values.

    Minimises the sum of squares of reduce(simulated - measured)/noise, with gradients from the sensitivities of the
    compiled model (trust-region reflective, scipy). Standard deviations come from the sandwich estimator over blocks
    of samples, so that residuals that are correlated in time do not make intervals too narrow.

    Args:
        noise: (ny,) weight of each output, in its unit.
        first, low, high: start value and bounds of each free parameter.
        prior: what is known about parameters and clocks; nothing if left out.
        reduce: linear map along the first axis, such as a filter, applied to residuals and gradients alike; one for all
            trials, or one for each.
        tolerance: iterate until the cost changes by less than this share.
        earlier: a fit of the same model to the same records, where the search for start values and shift begins.

    Raises:
        ComponentError: if the model fails already at the first guess.
    """
    first, low, high = (np.asarray(part, dtype=float) for part in (first, low, high))
    prior = Prior(np.zeros(len(first)), np.full(len(first), np.inf)) if prior is None else prior
    problem = _Problem(model, records, noise, substeps, reduce, prior)
    reach = MOST_SHIFT * prior.shift_std
    bounds = (
        problem.join(low, -reach, [r.start_low for r in records]),
        problem.join(high, reach, [r.start_high for r in records]),
    )
    shift, starts = (
        (0.0, [r.off_bounds(r.start) for r in records]) if earlier is None else (earlier.shift, earlier.starts)
    )
    guess = np.clip(problem.join(first, shift, starts), *bounds)
    residual, jacobian = problem.evaluate(guess, strict=guess.size > 0)
    # What a value without bounds, begun at zero, must be to change a run by as much as is left.
    explains = np.linalg.norm(residual) / np.maximum(np.linalg.norm(jacobian[:, : len(first)], axis=0), 1e-300)
    size = np.where(first != 0, np.abs(first), np.where(explains < 1e150, explains, 1.0))
    span = np.where(np.isfinite(high - low), high - low, MANY * size)
    scale = np.maximum(np.abs(first), 1e-3 * span)
    scale = np.where(np.isfinite(prior.std), prior.std, scale)
    if not jacobian[: problem.data_rows].any():  # nothing to fit, or nothing that the data depend on
        values, _, starts = problem.split(guess)
        cost = float(np.mean(residual[: problem.data_rows] ** 2))
        blind = np.where(np.isfinite(prior.std), prior.std, np.inf)
        return Fit(values, blind, starts, cost, np.zeros(len(values), bool), problem.data_rows)
    with np.errstate(all="ignore"):  # a step into a region where the run fails overflows and is rejected
        found = scipy.optimize.least_squares(
            problem.residual,
            guess,
            problem.jacobian,
            bounds=bounds,
            x_scale=problem.join(
                scale, prior.shift_std, [np.where(np.isfinite(r.start_std), r.start_std, 0.1) for r in records]
            ),
            ftol=tolerance,
            xtol=0.01 * tolerance,
            gtol=None,
            max_nfev=problem.most_evaluations(MOST_EVALUATIONS if tolerance < 1e-3 else MOST_IF_ROUGH),
        )
    values, shift, starts = problem.split(found.x)
    residual, jacobian = problem.evaluate(found.x)
    n_data = problem.data_rows
    std, correlation = _sandwich(residual, jacobian, problem.block_edges, len(values))
    # A small value is not at its bound if the data tell it apart from the bound.
    distance = np.minimum(values - low, high - values)
    at_bound = (distance < 1e-4 * span) & (distance < 3 * std)
    return Fit(
        values,
        std,
        starts,
        float(np.mean(residual[:n_data] ** 2)),
        at_bound,
        n_data,
        float(np.sum(residual[n_data:] ** 2)),
        shift,
        found.status > 0,
        correlation,
        problem.held_back(found.x),
        problem.evaluations * operations_of_runs(model, records, substeps),
    )


def linearise(
    model: CompiledModel,
    records: Sequence[Record],
    noise: np.ndarray,
    found: Fit,
    *,
    substeps: int,
    prior: Prior,
    reduce: Reduce | Sequence[Reduce],
) -> tuple[np.ndarray, np.ndarray]:
    """Weighted residuals of a fit, of data and then of priors, and their slopes in all that was fitted.

    The columns are the free parameters, the shift if there is one, and the start values of trial 1, 2, ...

    Args:
        model: the compiled model.
        records: the trials, with what is expected of their start values.
        noise: (ny,), standard deviation of each output.
        found: the fit.
        substeps: integration steps in a sample interval.
        prior: what is expected of free parameters and of the shift.
        reduce: weighs the errors (n, ny) of a trial, one for all or one each.

    Returns:
        Residuals (m,) and slopes (m, k).

    Raises:
        ComponentError: if a run fails.
    """
    problem = _Problem(model, records, noise, substeps, reduce, prior)
    return problem.evaluate(problem.join(found.values, found.shift, found.starts), strict=True)


def affordable_evaluations(model: CompiledModel, records: Sequence[Record], substeps: int) -> float:
    """Evaluations of all free runs after which a fit is given up, however few steps it has made; arguments as of
    `operations_of_runs`."""
    return MOST_OPERATIONS / max(operations_of_runs(model, records, substeps), 1)


def operations_of_runs(model: CompiledModel, records: Sequence[Record], substeps: int) -> float:
    """Operations of one run along each trial.

    Args:
        model: the compiled model.
        records: the trials.
        substeps: integration steps in a sample interval.
    """
    steps = max(substeps, STEPS_WITH_CONTACTS) if model.system.contacts else substeps
    return 4 * steps * sum(len(r.time) for r in records) * model.operations


class _Problem:
    """Residuals and Jacobian as functions of one vector [free parameters, shift if any, start values of trial 1, ...]."""

    def __init__(
        self,
        model: CompiledModel,
        records: Sequence[Record],
        noise: np.ndarray,
        substeps: int,
        reduce: Reduce | Sequence[Reduce],
        prior: Prior,
    ) -> None:
        self.model, self.records, self.noise, self.substeps = model, records, noise, substeps
        self.reduces = [reduce] * len(records) if callable(reduce) else list(reduce)
        self.n_free, self.nx = len(model.free), len(model.system.states)
        self.prior, self.known = prior, [int(k) for k in np.flatnonzero(np.isfinite(prior.std))]
        self.n_shared = self.n_free + int(prior.shift_std > 0)
        self.data_rows = self.evaluations = 0
        self.block_edges: list[int] = []
        self._last: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None

    def join(self, free: np.ndarray, shift: float, starts: Sequence[np.ndarray]) -> np.ndarray:
        return np.concatenate([free, np.full(self.n_shared - self.n_free, shift), *starts])

    def split(self, vector: np.ndarray) -> tuple[np.ndarray, float, tuple[np.ndarray, ...]]:
        starts = vector[self.n_shared :].reshape(len(self.records), self.nx)
        shift = float(vector[self.n_free]) if self.n_shared > self.n_free else 0.0
        return vector[: self.n_free], shift, tuple(starts)

    def most_evaluations(self, usual: int) -> int:
        """Evaluations of all free runs until a fit is given up: fewer than `usual` where they take long."""
        return int(min(usual, max(FEWEST, affordable_evaluations(self.model, self.records, self.substeps))))

    def residual(self, vector: np.ndarray) -> np.ndarray:
        return self.evaluate(vector)[0]

    def jacobian(self, vector: np.ndarray) -> np.ndarray:
        return self.evaluate(vector)[1]

    def evaluate(self, vector: np.ndarray, strict: bool = False) -> tuple[np.ndarray, np.ndarray]:
        """Weighted residuals (data of all trials, then priors) and their Jacobian; kept for the last vector."""
        if self._last is not None and np.array_equal(self._last[0], vector):
            return self._last[1], self._last[2]
        self.evaluations += 1
        free, shift, starts = self.split(vector)
        parameters = self.model.with_values(free)
        trials = list(zip(self.records, self.reduces, starts, strict=True))

        def one(trial: tuple[Record, Reduce, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
            return self._trial(*trial[:2], parameters, trial[2], shift, strict)

        # The compiled model runs without the interpreter's lock.
        residuals, jacobian = self._assemble(on_idle_threads(one, trials), vector)
        self._last = (vector.copy(), residuals, jacobian)
        return residuals, jacobian

    def _trial(
        self,
        record: Record,
        reduce: Reduce,
        parameters: np.ndarray,
        start: np.ndarray,
        shift: float,
        strict: bool,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Weighted residual of a trial, and its slopes in [start values, free parameters, shift]."""
        try:
            table, unseen = self._table(record, reduce, parameters, start, shift)
        except ComponentError:
            if strict:
                raise
            rows = reduce(np.zeros((len(record.time), len(self.model.outputs)))).size
            return np.full(rows, FAILED), np.zeros((rows, self.nx + self.n_shared))
        reduced = whitened(table, unseen)
        return reduced[:, -1], reduced[:, :-1]

    def _table(
        self, record: Record, reduce: Reduce, parameters: np.ndarray, start: np.ndarray, shift: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Slopes and, last, errors of a trial, reduced (rows, columns); answers to what delays may have held back (rows, q)."""
        about = (record.time, record.inputs, parameters)
        run = self.model.run(*about, start, substeps=self.substeps, sensitivities=True)
        assert run.sensitivities is not None
        if not np.all(np.abs(run.sensitivities) < STEEPEST):
            raise ComponentError(self._lost(record.time, run))
        outputs, columns = run.outputs, [run.sensitivities]
        if self.n_shared > self.n_free:
            rate = np.gradient(outputs, record.time, axis=0)
            outputs = outputs - shift * rate
            columns.append(-rate[:, :, None])
        ways = ways_before(self.model, *about)
        unseen = answers_to(ways, self.model, *about, start, run.outputs, self.substeps)
        # Side by side, so that reducing them is one pass.
        columns += [(outputs - record.measured)[:, :, None], unseen]
        table = np.concatenate(columns, axis=2)
        table /= self.noise[None, :, None]
        reduced = reduce(table)
        reduced = reduced.reshape(-1, reduced.shape[-1])
        kept = reduced.shape[-1] - len(ways)
        return reduced[:, :kept], reduced[:, kept:]

    def _lost(self, time: np.ndarray, run: FreeRun) -> str:
        """Where and on what the first output depends without bound."""
        assert run.sensitivities is not None
        sample, output, column = np.argwhere(~(np.abs(run.sensitivities) < STEEPEST))[0]
        names = [*(f"the start value of {v.name}" for v in self.model.system.states), *self.model.free]
        name, value = self.model.outputs[output], run.outputs[sample, output]
        return (
            f"{self.model.system.name}: from t = {time[sample]:.4g} s on, where {name} = {value:.4g}, a free run depends on "
            f"{names[column]} without bound; the model is unstable or divides by zero there: check signs, start values and inputs"
        )

    def held_back(self, vector: np.ndarray) -> tuple[np.ndarray, ...]:
        """By how much delayed quantities were likeliest off before each trial; nothing without delays."""
        if not self.model.system.n_delays:
            return ()
        free, shift, starts = self.split(vector)
        parameters, found = self.model.with_values(free), list[np.ndarray]()
        for record, reduce, start in zip(self.records, self.reduces, starts, strict=True):
            table, unseen = self._table(record, reduce, parameters, start, shift)
            ways = ways_before(self.model, record.time, record.inputs, parameters)
            found.append(np.tensordot(likeliest(-table[:, -1], unseen), ways, 1))
        return tuple(found)

    def _assemble(
        self, parts: list[tuple[np.ndarray, np.ndarray]], vector: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        free, shift, starts = self.split(vector)
        self.data_rows = sum(len(residual) for residual, _ in parts)
        known = [
            (k, float((free[k] - self.prior.mean[k]) / self.prior.std[k]), float(1 / self.prior.std[k]))
            for k in self.known
        ]
        if self.n_shared > self.n_free:
            known.append((self.n_free, shift / self.prior.shift_std, 1 / self.prior.shift_std))
        size = self.data_rows + self.nx * len(parts) + len(known)
        residuals, jacobian = np.zeros(size), np.zeros((size, len(vector)))
        row, self.block_edges = 0, [0]
        for k, (residual, slopes) in enumerate(parts):
            columns = slice(self.n_shared + k * self.nx, self.n_shared + (k + 1) * self.nx)
            rows = slice(row, row + len(residual))
            residuals[rows] = residual
            jacobian[rows, columns], jacobian[rows, : self.n_shared] = slopes[:, : self.nx], slopes[:, self.nx :]
            self.block_edges += [row + int(e) for e in np.linspace(0, len(residual), 21)[1:]]
            row += len(residual)
            prior = slice(self.data_rows + k * self.nx, self.data_rows + (k + 1) * self.nx)
            residuals[prior] = (starts[k] - self.records[k].start) / self.records[k].start_std
            jacobian[prior, columns] = np.diag(1 / self.records[k].start_std)
        for row, (column, departure, slope) in enumerate(known, start=size - len(known)):
            residuals[row], jacobian[row, column] = departure, slope
        return residuals, jacobian


def _sandwich(
    residual: np.ndarray, jacobian: np.ndarray, edges: Sequence[int], n_free: int
) -> tuple[np.ndarray, np.ndarray]:
    """Standard deviations of the first `n_free` unknowns, and the correlation of their errors as curvature gives it.

    H^-1 (sum of g_b g_b') H^-1 over blocks b of samples, times B/(B - k) for B blocks and k unknowns, which a fit has
    drawn towards the data; never less than for white residuals, as few blocks can agree by chance. Residuals larger than
    declared make the data weigh less, but not what is known beforehand.
    """
    data = edges[-1]
    rms = max(float(np.sqrt(np.mean(residual[:data] ** 2))), 1e-300)
    known = jacobian[data:] if data < len(jacobian) else np.zeros((0, jacobian.shape[1]))
    weighted = np.vstack([jacobian[:data] / rms, known])
    # Columns of very different size would be cut off as dependent ones; squares of the largest may be no numbers any more.
    largest = np.max(np.abs(weighted), axis=0)
    weighted /= np.where(largest > 0, largest, 1.0)
    relative = np.linalg.norm(weighted, axis=0)
    weighted /= np.where(relative > 0, relative, 1.0)
    length = largest * relative
    inverse = np.linalg.pinv(weighted.T @ weighted, hermitian=True)
    blocks = list(zip(edges[:-1], edges[1:], strict=True))
    gradients = np.array([weighted[a:b].T @ residual[a:b] / rms for a, b in blocks])
    used = len(blocks) / max(len(blocks) - jacobian.shape[1], 1)
    spread = used * gradients.T @ gradients + weighted[data:].T @ weighted[data:]
    correlated = np.diag(inverse @ spread @ inverse)
    variance = np.maximum(correlated, np.diag(inverse))[:n_free]
    with np.errstate(divide="ignore", invalid="ignore"):
        std = np.asarray(np.where((length[:n_free] > 0) & (variance >= 0), np.sqrt(variance) / length[:n_free], np.inf))
    return std, _correlation(inverse[:n_free, :n_free])


def _correlation(covariance: np.ndarray) -> np.ndarray:
    """Correlations (k, k); none of what depends on others so closely that rounding leaves no variance, or less.

    >>> _correlation(np.array([[4.0, 1.0], [1.0, 1.0]])).tolist()
    [[1.0, 0.5], [0.5, 1.0]]
    >>> _correlation(np.array([[4.0, 1e-9], [1e-9, -1e-9]])).tolist()
    [[1.0, 0.0], [0.0, 0.0]]
    """
    variance = np.diag(covariance)
    known = variance > 0
    size = np.sqrt(np.where(known, variance, 1.0))
    return np.asarray(np.where(np.outer(known, known), covariance / np.outer(size, size), 0.0))
