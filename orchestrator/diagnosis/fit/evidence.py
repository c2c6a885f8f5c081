"""What a set of effects explains in free runs of the learning trials."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.special import chdtrc

from fmus.errors import ComponentError
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.canonical import canonical, oscillates
from orchestrator.diagnosis.fit.extensible import model_of
from orchestrator.diagnosis.fit.phases import phases_of_runs
from orchestrator.diagnosis.fit.start_values import StartValues, beginning_at
from orchestrator.diagnosis.fit.thresholds import (
    AT_BOUND,
    DEPENDENT,
    DEVIATIONS,
    MOST_FINER,
    NEAR_FLOOR,
    NOTICED,
    PINNED,
    ROUNDING,
    TOLERANCE,
)
from orchestrator.diagnosis.noise.metric import Metric, stride_for, white_metric
from orchestrator.diagnosis.noise.nuisances import Nuisances
from orchestrator.library.cards import Candidate
from orchestrator.measurements import BoundSet, BoundTrial
from orchestrator.models.estimation import STEEPEST, Fit, Prior, Record, fit, linearise
from orchestrator.models.smoothing import SmoothedTrial
from orchestrator.models.symbolic import SymbolicModel


@dataclass(frozen=True)
class LearningData:
    """Smoothed trials, the floor (ny,) of each signal, the metric of each trial's errors, and what is always refitted.

    Without metrics of their own, errors count as white noise of the size of the floor.
    """

    trials: tuple[SmoothedTrial, ...]
    floor: np.ndarray
    metrics: tuple[Metric, ...] = ()
    nuisances: Nuisances = field(default_factory=Nuisances)

    def __post_init__(self) -> None:
        """Fill in the metrics that are left out."""
        if not self.metrics:
            white = tuple(white_metric(self.floor, stride_for(len(t.time), 1)) for t in self.trials)
            object.__setattr__(self, "metrics", white)

    @property
    def longest(self) -> int:
        """Samples of the longest trial."""
        return max(len(trial.time) for trial in self.trials)

    @property
    def step(self) -> float:
        """Seconds between samples."""
        return self.trials[0].smoother.step

    @cached_property
    def content(self) -> bytes:
        """Hash of all that fits depend on, made once: whitening matrices are large."""
        digest = hashlib.sha256(self.floor.tobytes())
        for trial in self.trials:
            for part in (trial.time, trial.inputs, trial.measured, trial.noise):
                digest.update(repr(part.shape).encode() + np.ascontiguousarray(part).tobytes())
        extra = self.nuisances
        digest.update(repr((extra.names, extra.shift_std)).encode() + extra.mean.tobytes() + extra.std.tobytes())
        for metric in self.metrics:
            digest.update(repr(metric.stride).encode() + metric.whitener.tobytes())
        return digest.digest()

    @staticmethod
    def of(data: BoundSet, floor: Mapping[str, float]) -> "LearningData":
        """Take the learning trials of a bound set."""
        noise = np.array([data.noise_std[name] for name in data.output_names])
        return LearningData(smoothed(data.learning, noise), np.array([floor[name] for name in data.output_names]))


@dataclass(frozen=True)
class Refit:
    """A set of candidates fitted by free runs, with nuisances and start values; no candidates: the model as it is."""

    effects: EffectSet
    model: SymbolicModel
    records: tuple[Record, ...]
    fit: Fit
    substeps: int

    @property
    def size(self) -> int:
        """Number of parameters of the effects."""
        return len(self.effects.variables) if self.effects.candidates else 0

    @property
    def values(self) -> np.ndarray:
        """Parameters of the effects, without nuisances."""
        return self.fit.values[: self.size]

    @property
    def std(self) -> np.ndarray:
        """Standard deviations of `values`."""
        return self.fit.std[: self.size]

    @property
    def cost(self) -> float:
        """Mean square error in the metric; 1 if only noise is left."""
        return self.fit.cost

    @property
    def half_bic(self) -> float:
        """Half the Bayesian information criterion, in units of the metric's noise; smaller is better."""
        return 0.5 * (self.fit.misfit + self.size * float(np.log(self.fit.rows)))

    @property
    def ids(self) -> tuple[str, ...]:
        """Effect ids in the order of the set."""
        return tuple(candidate.card.id for candidate in self.effects.candidates)

    @property
    def labels(self) -> frozenset[str]:
        """Effects with their sites, in no order."""
        return frozenset(candidate.label for candidate in self.effects.candidates)

    def is_present(self) -> bool:
        """Tell whether the data distinguish each effect from its absence.

        An effect with states of its own can follow a trial by their start values alone, its parameters at rest.
        """
        return len(self._present()) == len(self.effects.candidates)

    def without_absent(self) -> list[tuple[Candidate, np.ndarray]]:
        """The effects that the data distinguish from their absence, each with its parameters."""
        owners = np.array(self.effects.owners())
        return [(self.effects.candidates[k], self.values[owners == k]) for k in sorted(self._present())]

    def _present(self) -> set[int]:
        zero = np.array([p.zero for p in self.effects.card_parameters])
        counts = np.isfinite([p.meaningful for p in self.effects.card_parameters])
        away = self.values - zero
        counts &= np.abs(away) > ROUNDING * np.abs(zero)
        owners = np.array(self.effects.owners())
        found = set(owners[counts & (np.abs(away) > DEVIATIONS * self.std)].tolist())
        return found | {k for k in set(owners.tolist()) - found if self._shows(away, (owners == k) & counts)}

    def _shows(self, away: np.ndarray, own: np.ndarray) -> bool:
        """Whether some of the parameters depart together (Wald) where none does alone: of friction, say, that two joints of
        one speed share, the sum is known and neither part."""
        correlation = self.fit.correlation
        own = own & np.isfinite(self.std) & (self.std > 0)
        if np.count_nonzero(own) < 2 or not correlation.size:
            return False
        places = np.flatnonzero(own)
        z = away[places] / self.std[places]
        inverse = np.linalg.pinv(correlation[np.ix_(places, places)], rcond=DEPENDENT, hermitian=True)
        return bool(chdtrc(len(z), z @ inverse @ z) < chdtrc(1, DEVIATIONS**2))

    def pressed(self) -> tuple[str, ...]:
        """Parameters that the data pin, and pin at the limit of what their effect can be.

        A law that explains the data best beyond its limits is another one in disguise: few waves of cogging are a hardening
        spring. A limit at zero or at absence is none of this kind: nothing lies beyond. So is a law of which the data
            pin neither
        the shape nor any size, and which shows all the same: then any other smooth force would do.
        """
        if not self.size:
            return ()
        low, high = self.effects.bounds()
        nearer = np.where(self.values - low < high - self.values, low, high)
        absent = np.array([p.absent for p in self.effects.card_parameters])
        pinned = self.std < PINNED * np.abs(self.values)
        beyond = self.fit.at_bound[: self.size] & pinned & (nearer != 0.0) & (nearer != absent)
        beyond |= self._shapeless()
        return tuple(v.name for v, is_pressed in zip(self.effects.variables, beyond, strict=True) if is_pressed)

    def pressed_effect(self) -> Candidate | None:
        """The one effect that is another law in disguise, None if there is none or several are."""
        owners = {name.rpartition(".")[0] for name in self.pressed()}
        found = [c for c in self.effects.candidates if c.slot in owners]
        return found[0] if len(found) == 1 else None

    def _shapeless(self) -> np.ndarray:
        """Shapes (k,) that the data do not pin, of effects of which they pin no size either."""
        zero = np.array([p.zero for p in self.effects.card_parameters])
        is_size, owners = (
            np.isfinite([p.meaningful for p in self.effects.card_parameters]),
            np.array(self.effects.owners()),
        )
        known = np.abs(self.values - zero) > DEVIATIONS * self.std
        sized = [bool(np.any(known & is_size & (owners == owner))) for owner in owners]
        return np.asarray(~is_size & ~(self.std < PINNED * np.abs(self.values)) & ~np.array(sized, dtype=bool))

    def is_meaningful(self) -> bool:
        """Tell whether each effect departs from its absence by a size that matters."""
        big: set[int] = set()
        rows = zip(self.effects.owners(), self.effects.card_parameters, self.values, strict=True)
        for owner, parameter, value in rows:
            if parameter.matters(value):
                big.add(owner)
        return len(big) == len(self.effects.candidates)


def refit(
    effects: EffectSet,
    learning: LearningData,
    first: np.ndarray,
    nuisances: np.ndarray | None = None,
    *,
    tolerance: float = TOLERANCE,
    earlier: Fit | None = None,
    near: StartValues | None = None,
    settled: bool = False,
) -> Refit:
    """Fit a set's parameters, the nuisances, and the start values of all trials, by free runs.

    The first values whose runs are the best may be those that do the least, as a ceiling above all commands or a stiff
    shaft: no slope leads from there to a low ceiling or a soft shaft. So a fit in which an effect is not told from its
    absence is made again from the next best ones, unless it leaves nothing but noise.

    Args:
        first: first values of the effects' parameters (k,), or several rows of them: that with the best free runs is taken.
        nuisances: first values of the nuisances, their nominal ones if left out.
        tolerance: change of the misfit, as a share, at which the fit ends.
        earlier: a fit of the same set, from where start values and clocks are searched.
        near: where a fit of another set begins, which is tried as well as where the records seem to: a motion that is off
            by part of a wave of cogging says nothing of it. A set with oscillations begins by their phases all the same.
        settled: whether the first values are those of a fit, which may be at bounds.
    """
    low, high = effects.bounds()
    extra, model = learning.nuisances, with_nuisances(effects, learning)
    others = extra.mean if nuisances is None else nuisances
    # What an earlier fit has found at a bound is there for a reason.
    kept = settled or earlier is not None
    rows = np.atleast_2d(first) if kept else [_inside(row, effects) for row in np.atleast_2d(first)]
    guesses = [np.r_[row, others] for row in rows]
    begun = [(guess, earlier) for guess in guesses]
    if earlier is None and oscillates(effects):
        found_phases = [_phased(effects, model, learning, guess, guess[: len(low)]) for guess in guesses]
        begun = [(np.r_[values, others], phases) for values, phases in found_phases]
    elif earlier is None and near is not None:
        begun += [(guess, near.in_model(model, guess, learning.trials)) for guess in guesses]
    bounds = (np.r_[low, extra.low], np.r_[high, extra.high])
    found: Refit | None = None
    while begun and not (found and (found.is_present() or found.cost <= NEAR_FLOOR)):
        guess, where = begun[0] if len(begun) == 1 else _likeliest(model, learning, begun)
        begun = [start for start in begun if not np.array_equal(start[0], guess)]
        try:
            again = _fit(effects, model, learning, guess, *bounds, tolerance, where)
        except ComponentError:
            if found is None:
                raise
        else:
            found = again if found is None or again.fit.misfit < found.fit.misfit else found
    assert found is not None
    fit, records = canonical(effects, found.fit, found.records)
    return replace(found, fit=fit, records=records)


def _phased(
    effects: EffectSet, model: SymbolicModel, learning: LearningData, guess: np.ndarray, values: np.ndarray
) -> tuple[np.ndarray, Fit | None]:
    """First values (k,) with the amplitudes of oscillations, and a fit that says no more than in which phase each trial begins.

    Args:
        guess: first values of the model's free parameters.
        values: those of the set, whether they are free in the model or not.
    """
    parameters = model.compiled.with_values(guess)
    records = tuple(model.record(trial, parameters) for trial in learning.trials)
    try:
        steps = enough_steps(model, records, parameters, learning)
        first, starts = phases_of_runs(effects, model.compiled, records, learning.metrics, parameters, values, steps)
    except ComponentError:
        return values, None
    return first, beginning_at(guess, starts)


def _inside(first: np.ndarray, effects: EffectSet) -> np.ndarray:
    """First values off their bounds, where a fit would be stuck: at the card's typical size if that is off them too.

    A value that is only small against its range or its typical size, as in a small plant, stays.
    """
    low, high = effects.bounds()
    typical = effects.first_guess()
    room = np.minimum(typical - low, high - typical)
    span = np.where(np.isfinite(high - low), high - low, np.abs(typical))
    is_off = room >= AT_BOUND * span
    inside = np.where(is_off, typical, np.clip(first, low + 0.01 * span, high - 0.01 * span))
    near = AT_BOUND * np.where(is_off & np.isfinite(room), room, span)
    return np.where(np.minimum(first - low, high - first) >= near, first, inside)


def _likeliest(
    model: SymbolicModel, learning: LearningData, begun: Sequence[tuple[np.ndarray, Fit | None]]
) -> tuple[np.ndarray, Fit | None]:
    """The first values, and the fit that they begin from, with the least rough misfit; the first of equals."""
    best, least = begun[0], np.inf
    for guess, earlier in begun:
        misfit = _rough_misfit(model, learning, guess, earlier, least)
        if misfit < least:
            best, least = (guess, earlier), misfit
    return best


def _rough_misfit(
    model: SymbolicModel, learning: LearningData, guess: np.ndarray, earlier: Fit | None = None, limit: float = np.inf
) -> float:
    """Sum of squares of free runs whose start values are fitted to first order, from those of an `earlier` fit if there is
    one; infinite if a run fails, or if the first trials reach `limit` by themselves."""
    parameters, total, steps = model.compiled.with_values(guess), 0.0, 0
    records = with_starts([model.record(trial, parameters) for trial in learning.trials], earlier)
    for record, metric in zip(records, learning.metrics, strict=True):
        try:
            steps = steps or model.substeps(
                record, parameters
            )  # what is enough for one trial is for a rough look at all
            run = model.compiled.run(
                record.time, record.inputs, parameters, record.start, substeps=steps, sensitivities=True
            )
        except ComponentError:
            return float("inf")
        assert run.sensitivities is not None
        reach = 0.5 * (record.start_high - record.start_low)
        slopes = metric(run.sensitivities[:, :, : len(reach)] * np.where(np.isfinite(reach), reach, 1.0))
        error = np.concatenate([metric(run.outputs - record.measured), np.zeros(len(reach))])
        if not (np.all(np.isfinite(error)) and np.all(np.abs(slopes) < STEEPEST)):
            return float("inf")
        columns = np.vstack([slopes, np.diag(np.isfinite(reach).astype(float))])
        left = error + columns @ np.linalg.lstsq(columns, -error, rcond=None)[0]
        total += float(left @ left)
        if total >= limit:
            return float("inf")
    return total


def with_nuisances(effects: EffectSet, learning: LearningData) -> SymbolicModel:
    """The model of a set, its free parameters those of the effects and then the nuisances."""
    model = effects.model
    return model.restricted(model.signals, [*model.compiled.free, *learning.nuisances.names])


def fit_nominal(effects: EffectSet, model: SymbolicModel, learning: LearningData) -> Refit:
    """Fit nuisances and start values of a model without effects; `effects` is the empty set of that model.

    Args:
        effects: the empty set of the model.
        model: the model as given.
        learning: the trials in their metrics, with the nuisances.

    Raises:
        ComponentError: if the model cannot be simulated.
    """
    extra = learning.nuisances
    model = model.restricted(model.signals, extra.names)
    return _fit(effects, model, learning, extra.mean, extra.low, extra.high)


def follow(found: Refit, learning: LearningData, earlier: Fit | None = None) -> Refit:
    """The model with the values that a fit found, along other trials: only start values and clocks are fitted, from
    those of an `earlier` fit of these trials if there is one.

    Args:
        found: a fitted set.
        learning: the trials to follow, in their metrics.
        earlier: a fit of the same model to the same trials.

    Raises:
        ComponentError: if the model cannot be simulated.
    """
    begun, alone, nothing = as_found(found), _without_parameters(learning), np.zeros(0)
    if earlier is None and oscillates(found.effects):
        earlier = _phased(found.effects, begun.model, alone, nothing, found.values)[1]
    return _fit(begun.effects, begun.model, alone, nothing, nothing, nothing, earlier=earlier)


def as_found(found: Refit) -> Refit:
    """The model with the values that a fit found, none of them free, before it follows any trials."""
    model = model_of(found.effects.base, found.model.system, found.model.signals)
    model.compiled.parameters = found.model.compiled.with_values(found.fit.values)
    return Refit(EffectSet(found.effects.base, (), model.signals), model, (), beginning_at(np.zeros(0), ()), 1)


def _without_parameters(learning: LearningData) -> LearningData:
    """Trials of which only start values and clocks are to be fitted."""
    return LearningData(
        learning.trials, learning.floor, learning.metrics, Nuisances(shift_std=learning.nuisances.shift_std)
    )


def _fit(
    effects: EffectSet,
    model: SymbolicModel,
    learning: LearningData,
    guess: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
    tolerance: float = TOLERANCE,
    earlier: Fit | None = None,
) -> Refit:
    prior = learning.nuisances.prior(len(guess) - len(learning.nuisances.names))
    found: Refit | None = None
    finer = 0
    for _ in range(2):
        # Start values are bounded by what the encoders show, and what they show depends on a sensor error's size.
        parameters = model.compiled.with_values(guess)
        records = tuple(model.record(trial, parameters) for trial in learning.trials)
        steps = max(enough_steps(model, with_starts(records, earlier), parameters, learning), finer)
        again = fit(
            model.compiled,
            records,
            np.ones(len(model.signals)),
            guess,
            low,
            high,
            substeps=steps,
            prior=prior,
            reduce=learning.metrics,
            tolerance=tolerance,
            earlier=earlier,
        )
        if found is None or steps > found.substeps or again.misfit < found.fit.misfit:
            found = Refit(effects, model, records, again, steps)
        guess, earlier = again.values, again
        moved = model.reads_through_parameters and _pressed(again.starts, records)
        finer = _finer_steps(found, learning, prior) if tolerance <= TOLERANCE else 0
        if not (moved or finer):
            break
    assert found is not None
    return found


def with_starts(records: Sequence[Record], earlier: Fit | None) -> Sequence[Record]:
    """Records that begin at the start values that a fit has found, if there is one."""
    if earlier is None:
        return records
    return [replace(r, start=start) for r, start in zip(records, earlier.starts, strict=True)]


def enough_steps(
    model: SymbolicModel, records: Sequence[Record], parameters: np.ndarray, learning: LearningData
) -> int:
    """Integration steps in a sample interval that are enough for every trial.

    Args:
        model: the model.
        records: the trials, with start values.
        parameters: values of all parameters of the model.
        learning: the same trials, with the noise of their outputs.
    """
    return max(model.substeps(record, parameters, learning.trials[0].noise) for record in records)


def linearised(found: Refit, learning: LearningData) -> tuple[np.ndarray, np.ndarray]:
    """Residuals (m,) of a fitted set in the metric, then those of priors, and their slopes (m, k) in all that was fitted."""
    return linearise(
        found.model.compiled,
        found.records,
        np.ones(len(found.model.signals)),
        found.fit,
        substeps=found.substeps,
        prior=learning.nuisances.prior(found.size),
        reduce=learning.metrics,
    )


def _finer_steps(found: Refit, learning: LearningData, prior: Prior) -> int:
    """Steps for a fit for which those that were short enough for its first guess are too long; 0 if they are not.

    What a step errs by may be small beside the noise of a sample and yet the same in thousands of them: the misfit decides.
    """
    model, parameters = found.model, found.model.compiled.with_values(found.fit.values)
    if model.system.contacts:  # which has its steps as short as they must be
        return 0
    needed = max(enough_steps(model, with_starts(found.records, found.fit), parameters, learning), 2 * found.substeps)
    # A state so fast that it needs more is at rest within a step; how fast it is no longer shows.
    if needed > MOST_FINER * found.substeps:
        return 0
    errors, _ = linearise(
        model.compiled,
        found.records,
        np.ones(len(model.signals)),
        found.fit,
        substeps=needed,
        prior=prior,
        reduce=learning.metrics,
    )
    change = abs(float(errors @ errors) - found.fit.misfit)
    return needed if change > max(1.0, NOTICED * found.fit.misfit) else 0


def _pressed(starts: Sequence[np.ndarray], records: Sequence[Record]) -> bool:
    """Whether start values lie at their bounds."""
    return any(
        bool(np.isclose(s, r.start_low).any() or np.isclose(s, r.start_high).any())
        for s, r in zip(starts, records, strict=True)
    )


def smoothed(trials: Sequence[BoundTrial], noise: np.ndarray) -> tuple[SmoothedTrial, ...]:
    """Trials with what their measurements show of motion; `noise` (ny,) is the standard deviation of each output."""
    return tuple(SmoothedTrial(t.time, t.inputs, t.outputs, noise) for t in trials)
