"""What each candidate would do to the free runs of a fitted model, to first order, in the metric of the diagnosis."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from typing import Protocol, TypeVar

import numpy as np
from scipy.linalg import block_diag

from fmus.errors import MisfitError
from orchestrator.diagnosis.fit.candidates import EffectSet, can_join
from orchestrator.diagnosis.fit.evidence import LearningData, Refit, linearised
from orchestrator.diagnosis.linear.noise_free_motion import noise_free_motion
from orchestrator.diagnosis.linear.response import Response
from orchestrator.diagnosis.linear.thresholds import AT_END, BETWEEN_STD, BEYOND_SAMPLES, RANK, SHAPES
from orchestrator.diagnosis.linear.visible import over_noise
from orchestrator.diagnosis.noise.metric import concatenate
from orchestrator.library.cards import Candidate
from orchestrator.models.estimation import MOST_SHIFT, STEEPEST
from orchestrator.models.smoothing import SmoothedTrial
from orchestrator.models.symbolic import Motion, SymbolicModel

Item = TypeVar("Item")
Found = TypeVar("Found")


class SideBySide(Protocol):
    """Does work on items at the same time and returns the results in the order of the items."""

    def __call__(self, work: Callable[[Item], Found], items: Sequence[Item]) -> list[Found]: ...


@dataclass(frozen=True)
class Block:
    """A candidate at one point of its parameters: columns (m, k) that its parameters span, in the metric.

    `sizes` (k,) are the typical sizes of the columns' parameters (their first guesses less their absence, or less twice
    themselves where that is infinite); a column
    times its size is what the effect does when it is of typical size. `names` are the parameters of the columns, `powers`
    (k,) the sums of squares of what they do beyond start values, were clocks and the model's parameters known exactly.
    `point` are the values of the candidate's parameters at which the block is taken.
    """

    candidate: Candidate
    columns: np.ndarray
    sizes: np.ndarray
    meaningful: np.ndarray
    names: tuple[str, ...]
    powers: np.ndarray
    point: np.ndarray

    def is_meaningful(self, error: np.ndarray) -> bool:
        """Whether the block, fitted to an error to first order, has a parameter of meaningful size."""
        if self.names[0] == "":  # a share of the step from absence to the first guess
            share = float(self.columns[:, 0] @ error / (self.columns[:, 0] @ self.columns[:, 0]))
            return bool(np.any(np.abs(share * self.sizes[1:]) >= self.meaningful[1:]))
        found, *_ = np.linalg.lstsq(self.columns, error, rcond=1e-6)
        return bool(np.any(np.abs(found) >= self.meaningful))


class Tangent:
    """A fitted model, linearised: its error (m,), an orthonormal basis of its nuisances, and blocks of candidates.

    `recorded_error` is the error along the recorded inputs, before nuisances are taken away; `slopes` (m, k) are those
    of the error in the parameters of the effects that are in the model.

    Rows are the samples of all trials in the metric, then one row for each prior. Nuisances are start values, clocks,
    parameters with tolerances and the parameters of effects that are in the model already.
    """

    def __init__(self, base: Refit, nominal: SymbolicModel, learning: LearningData) -> None:
        self.base, self.nominal, self.learning = base, nominal, learning
        residual, _ = linearised(base, learning)
        self.recorded_error = residual
        noise_free = noise_free_motion(base, learning, residual, self.machine_states)
        self.response = Response(noise_free, [t.smoother for t in learning.trials])
        _, jacobian = linearised(noise_free, learning)
        slopes = jacobian[:, : base.size]
        if abs(base.fit.shift) > AT_END * MOST_SHIFT * learning.nuisances.shift_std > 0:
            # A clock at the end of what it may be off by goes no further: a delay of a sample and a half is not its doing.
            jacobian[:, base.fit.values.size] = 0.0
        self.data_rows = base.fit.rows
        between = self._between_samples()
        jacobian = block_diag(jacobian, np.eye(between.shape[1]) / BETWEEN_STD)
        jacobian[: self.data_rows, jacobian.shape[1] - between.shape[1] :] = between
        residual = np.r_[residual, np.zeros(between.shape[1])]
        self.slopes = np.concatenate([slopes, np.zeros((between.shape[1], base.size))])
        self.prior_rows = len(residual) - self.data_rows
        self.basis = orthonormal(jacobian, 1e-9)
        starts = jacobian.shape[1] - between.shape[1] - sum(map(len, base.fit.starts))
        self._starts = jacobian[:, starts : jacobian.shape[1] - between.shape[1]]
        given = [*range(base.size, starts), *range(jacobian.shape[1] - between.shape[1], jacobian.shape[1])]
        self._exact = orthonormal(np.delete(jacobian, given, axis=1), 1e-9) if given else self.basis
        self.error = self.project(-residual)
        self._between = self.error[len(residual) - between.shape[1] :]

    @property
    def is_between_samples(self) -> bool:
        """Whether what happens between samples can be what it must be for the error to be noise.

        A stiff joint that yields moves its motor by a share of the torque, as second differences of the torque do.
        """
        return bool(np.all(np.abs(self._between) <= BEYOND_SAMPLES))

    @property
    def machine_states(self) -> frozenset[str]:
        """Names of the states that are there without effects."""
        return frozenset(state.name for state in self.nominal.system.states)

    @property
    def rows_of_trials(self) -> list[int]:
        """Rows of data of each trial."""
        signals = len(self.base.model.signals)
        return [
            len(trial.time) // metric.stride * signals
            for metric, trial in zip(self.learning.metrics, self.learning.trials, strict=True)
        ]

    def over_noise(self, change: np.ndarray) -> float:
        """Rms of a change (m,) of the error over that of the noise, as the outputs show both beside start values."""
        total, rows, at, first = 0.0, 0, 0, 0
        for metric, count, start in zip(self.learning.metrics, self.rows_of_trials, self.base.fit.starts, strict=True):
            own = self._starts[at : at + count, first : first + len(start)]
            seen, samples = over_noise(change[at : at + count], own, metric)
            total, rows, at, first = total + seen, rows + samples, at + count, first + len(start)
        return float((total / max(rows, 1)) ** 0.5)

    def change_to(self, found: Refit) -> np.ndarray:
        """What another fitted set does to the error (m,) of this one; none in the rows of priors."""
        change = np.zeros(len(self.error))
        after, _ = linearised(found, self.learning)
        change[: self.data_rows] = self.recorded_error[: self.data_rows] - after[: self.data_rows]
        return change

    def project(self, columns: np.ndarray) -> np.ndarray:
        """Take away what nuisances explain; rows as in `error`."""
        return columns - self.basis @ (self.basis.T @ columns)

    def _between_samples(self) -> np.ndarray:
        """What second differences of measured inputs, and of outputs, do to the outputs (m, k).

        A hold, a straight line and a delay of part of a sample differ by them between samples, and so does a mean over a
        sample. They matter because whatever smooths a noisy input, or what it moves, takes away some of its noise, as if
        something were wrong with the model.
        """
        trials, response = self.learning.trials, self.response
        measured = [] if trials[0].input_noise is None else [int(i) for i in np.flatnonzero(trials[0].input_noise)]
        if not (measured and response.is_formula):
            return np.zeros((self.data_rows, 0))
        inputs = [
            [response.to_input(k, i, _second_difference(r.inputs[:, [i]])) for k, r in enumerate(response.base.records)]
            for i in measured
        ]
        own = np.eye(len(self.base.model.signals))
        outputs = [[_second_difference(y)[:, :, None] * each[:, None] for y in response.outputs] for each in own]
        return np.column_stack([self._of_data(per_trial) for per_trial in (*inputs, *outputs)])

    def _of_data(self, per_trial: Sequence[np.ndarray]) -> np.ndarray:
        """Outputs (n, ny, k) of each trial as columns of the rows of data."""
        return concatenate(self.learning.metrics, per_trial)

    def in_metric(self, per_trial: Sequence[np.ndarray]) -> np.ndarray:
        """Outputs (n, ny, k) of each trial as columns (m, k), before nuisances are taken away."""
        data = self._of_data(per_trial)
        return np.concatenate([data, np.zeros((self.prior_rows, data.shape[1]))])

    def blocks(self, candidates: Sequence[Candidate], slots: Sequence[str], side_by_side: SideBySide) -> list[Block]:
        """Blocks of all candidates that can join the effects of the model; those that cannot run have none.

        Args:
            candidates: the effects to look at.
            slots: the free slots of the model without effects.
            side_by_side: does work on items, several at a time.
        """
        inside = self.base.effects.candidates
        free = [c for c in candidates if can_join(inside, c, slots) is not None]
        groups = [list(group) for _, group in groupby(free, key=lambda c: (c.card.id, c.card.variant))]

        def one(group: list[Candidate]) -> list[Block]:
            try:
                return list(self._of_card(group, slots))
            except MisfitError:
                return []

        return [block for part in side_by_side(one, groups) for block in part]

    def _of_card(self, group: Sequence[Candidate], slots: Sequence[str]) -> Iterator[Block]:
        """Blocks of one card: candidates that differ only in their element share one model."""
        together = len(group) > 1 and len(group[0].card.parameters) == 1
        for part in [list(group)] if together else [[candidate] for candidate in group]:
            effects = EffectSet(self.base.effects.base, part, self.base.model.signals)
            through_forces = self.response.has_forces and effects.model.residual is not None
            slopes = self._by_forces if through_forces else self._by_runs(part, slots)
            for values, difference in points(effects):
                columns, starts = slopes(effects, values, difference)
                yield from self._blocks_at(effects, columns, starts, values, difference)

    def _blocks_at(
        self, effects: EffectSet, columns: np.ndarray, starts: np.ndarray, values: np.ndarray, difference: bool
    ) -> Iterator[Block]:
        absent, start = (np.array([getattr(p, name) for p in effects.card_parameters]) for name in ("absent", "start"))
        meaningful = np.array([p.meaningful for p in effects.card_parameters])
        # Of a time constant T that is infinite at absence, 1/T says the size: to first order a change of T by start^2/T.
        inverse = np.isinf(absent)
        meaningful = np.where(inverse & np.isfinite(meaningful), start**2 / meaningful, meaningful)
        # What a diverging linearisation says of an effect, a fit by free runs has to find.
        columns = np.where(np.all(np.abs(columns) < STEEPEST, axis=0), columns, 0.0)
        names = [v.name for v in effects.variables]
        owners = np.array(effects.owners())
        powers = np.sum(_beyond(columns, self._exact, starts) ** 2, axis=0)
        columns = _beyond(columns, self.basis, starts)
        sizes = np.where(inverse, -start, start - absent)
        for k, candidate in enumerate(effects.candidates):
            own = np.flatnonzero(owners == k)
            if not columns[:, own].any():
                continue
            chosen, size, least = columns[:, own], sizes[own], meaningful[own]
            labels, power = [names[i] for i in own], powers[own]
            if difference and len(effects.candidates) == 1:
                chosen, labels = np.column_stack([columns[:, -1], chosen]), ["", *labels]
                size, least, power = np.r_[1.0, size], np.r_[np.inf, least], np.r_[powers[-1], power]
            yield Block(candidate, chosen, size, least, tuple(labels), power, values[own])

    def _by_forces(self, effects: EffectSet, values: np.ndarray, difference: bool) -> tuple[np.ndarray, np.ndarray]:
        """Columns of an effect as the answer to the forces that it is equivalent to along the model's own motion.

        Start values of the effect's own states stay as they are: no columns for them.
        """
        model = effects.model
        parameters = self._with_nuisances(model, values)
        per_trial, substeps = list[np.ndarray](), 0
        for k, (trial, measured) in enumerate(zip(self.response.trials, self.learning.trials, strict=True)):
            start = _hidden_start(model, measured, parameters)
            substeps = substeps or model.residual_substeps(trial, parameters, start)
            forces = _forces(model, parameters, trial, start, substeps)
            if difference:
                forces = np.concatenate([forces[:, :, 1:], forces[:, :, :1] - self._without_effects[k]], axis=2)
            else:
                forces = forces[:, :, 1:]
            per_trial.append(self.response.to_forces(k, -forces))
        columns = self.in_metric(per_trial)
        return columns, columns[:, :0]

    @cached_property
    def _without_effects(self) -> list[np.ndarray]:
        """Correction residual (n, ny, 1) of the model as given along each trial."""
        plain, own = self.nominal, self._with_nuisances(self.nominal, np.zeros(0))
        pairs = zip(self.response.trials, self.learning.trials, strict=True)
        return [_forces(plain, own, trial, _hidden_start(plain, shown, own), 1)[:, :, :1] for trial, shown in pairs]

    def _with_nuisances(self, model: SymbolicModel, values: np.ndarray) -> np.ndarray:
        """All parameters of a model with effect parameters `values` and the fitted nuisances."""
        parameters = model.compiled.with_values(values)
        names = [v.name for v in model.system.parameters]
        for name, value in zip(self.learning.nuisances.names, self.base.fit.values[self.base.size :], strict=True):
            parameters[names.index(name)] = value
        return parameters

    def _by_runs(
        self, group: Sequence[Candidate], slots: Sequence[str]
    ) -> Callable[[EffectSet, np.ndarray, bool], tuple[np.ndarray, np.ndarray]]:
        """Columns from free runs of the model with the candidates in it, where they are no force.

        Beside them those of the start values of the candidates' own states, which a fit would move.
        """
        inside = self.base.effects.candidates
        placed = [can_join(inside, candidate, slots) for candidate in group]
        joined = EffectSet(self.base.effects.base, [*inside, *(c for c in placed if c)], self.base.model.signals)

        def columns(effects: EffectSet, values: np.ndarray, difference: bool) -> tuple[np.ndarray, np.ndarray]:
            model, known = joined.model, self.base.values
            parameters = self._with_nuisances(model, np.r_[known, values])
            states = [v.name for v in self.base.model.system.states]
            hidden = [i for i, v in enumerate(model.system.states) if v.name not in states]
            per_trial, per_start = [], []
            for record, trial, start, plain in zip(
                self.response.base.records,
                self.learning.trials,
                self.response.base.fit.starts,
                self.response.outputs,
                strict=True,
            ):
                own = model.record(trial, parameters)
                first = dict(zip(states, start, strict=True))
                begin = np.array([first.get(v.name, own.start[i]) for i, v in enumerate(model.system.states)])
                run = model.compiled.run(
                    record.time, record.inputs, parameters, begin, substeps=self.base.substeps, sensitivities=True
                )
                assert run.sensitivities is not None
                slopes = run.sensitivities[:, :, len(begin) + len(known) :]
                parts = [slopes, (run.outputs - plain)[:, :, None]] if difference else [slopes]
                per_trial.append(np.concatenate(parts, axis=2))
                per_start.append(run.sensitivities[:, :, hidden])
            return self.in_metric(per_trial), self._one_for_each_trial(per_start)

        return columns

    def _one_for_each_trial(self, per_trial: Sequence[np.ndarray]) -> np.ndarray:
        """Columns (m, trials * k) of unknowns that each trial has for itself, from outputs (n, ny, k) of each."""
        if not per_trial[0].size:
            return np.zeros((len(self.error), 0))
        data = block_diag(*(concatenate([m], [part]) for m, part in zip(self.learning.metrics, per_trial, strict=True)))
        data = np.where(np.all(np.abs(data) < STEEPEST, axis=0), data, 0.0)
        return np.concatenate([data, np.zeros((self.prior_rows, data.shape[1]))])


def split_by_trials(values: np.ndarray, rows: Sequence[int]) -> list[np.ndarray]:
    """The parts of values (m, ...) that belong to trials of so many `rows` one after the other; those of priors are
    left out."""
    edges = np.cumsum(rows)
    return np.split(values[: edges[-1]], edges[:-1])


def points(effects: EffectSet) -> Iterator[tuple[np.ndarray, bool]]:
    """Points at which a card is linearised, each with whether the step from absence to it is a column of its own.

    A card is taken at its absence where it starts to act there in proportion to its parameters. Where it does not (a
    time constant at zero, a yield angle at zero), it is taken at its first guess, with variations of its shape, or on its
    grid; a level that is an effect's only parameter then counts as a step from no such level.
    """
    parameters = effects.card_parameters
    absent = np.array([p.absent for p in parameters])
    low, high = effects.bounds()
    first = np.clip(effects.first_guess(), low, high)
    grids = [(i, p.grid) for i, p in enumerate(parameters) if p.grid]
    if grids:
        position, grid = grids[0]
        for value in grid:
            yield np.where(np.arange(len(absent)) == position, value, absent), len(absent) == 1
        return
    if len(effects.candidates) > 1 or (len({p.name for p in parameters}) == 1 and np.all((absent > low) | (low == 0))):
        yield np.clip(absent, low, high), False
        return
    shape = parameters[-1].name
    for factor in SHAPES:
        scaled = np.array([v * factor if p.name == shape else v for p, v in zip(parameters, first, strict=True)])
        yield np.clip(scaled, low, high), True


def _hidden_start(model: SymbolicModel, trial: SmoothedTrial, parameters: np.ndarray) -> np.ndarray:
    """Start values of the states that are not measured."""
    assert model.residual is not None
    hidden, names = [v.name for v in model.residual.system.states], [v.name for v in model.system.states]
    return model.record(trial, parameters).start[[names.index(name) for name in hidden]] if hidden else np.zeros(0)


def _forces(
    model: SymbolicModel, parameters: np.ndarray, trial: Motion, hidden_start: np.ndarray, substeps: int
) -> np.ndarray:
    """Correction residual along a trial, then its slopes in the free parameters: (n, ny, 1 + n_free)."""
    run = model.compiled_residual.run(
        trial.time, model.residual_inputs(trial), parameters, hidden_start, substeps=substeps, sensitivities=True
    )
    assert run.sensitivities is not None
    return np.concatenate([run.outputs[:, :, None], run.sensitivities[:, :, len(hidden_start) :]], axis=2)


def _second_difference(series: np.ndarray) -> np.ndarray:
    """Second differences along the first axis, none at the ends."""
    return np.pad(np.diff(series, n=2, axis=0), ((1, 1), (0, 0)))


def _beyond(columns: np.ndarray, basis: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """What is left of columns beside an orthonormal basis and the columns of start values."""
    left = columns - basis @ (basis.T @ columns)
    if starts.any():
        own = orthonormal(starts - basis @ (basis.T @ starts), 1e-9)
        left -= own @ (own.T @ left)
    return left


def orthonormal(columns: np.ndarray, tolerance: float = RANK) -> np.ndarray:
    """Orthonormal basis of the space of columns, each scaled to length 1 before the rank is judged."""
    length = np.linalg.norm(columns, axis=0)
    kept = columns[:, length > 0] / length[length > 0]
    if kept.shape[1] == 0:
        return np.zeros((len(columns), 0))
    left, singular, _ = np.linalg.svd(kept, full_matrices=False)
    return left[:, singular > tolerance * singular[0]]
