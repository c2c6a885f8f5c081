"""Fits over first stretches of the trials, each longer than the one before: for effects that make and break contact.

A contact that a free run makes too late turns what follows into another motion, so that a fit over whole trials ends at
the nearest of many minima: play of two masses was 2 % off, or ended anywhere, when 84 times the noise was left. Over a
stretch of few contacts there is but one, and from there the next stretch holds few more (Gauss-Newton on growing
horizons, as in multiple shooting: Bock, in Modelling of Chemical Reaction Systems, Springer 1981).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fmus.errors import ComponentError
from orchestrator.diagnosis.fit.evidence import LearningData, Refit, as_found, enough_steps, follow, with_starts
from orchestrator.diagnosis.fit.thresholds import NEAR_FLOOR
from orchestrator.diagnosis.linear.tangent import split_by_trials
from orchestrator.diagnosis.linear.thresholds import BEYOND_NOISE
from orchestrator.diagnosis.noise.metric import Metric
from orchestrator.diagnosis.search.thresholds import FEWEST_MEANS, FEWEST_SAMPLES, GROWTH, ROUGH, SHORTEST
from orchestrator.models.estimation import Fit, Record, fit, linearise


@dataclass(frozen=True)
class Followed:
    """How far a set follows the trials: a fit of their first `samples`, which leaves no trial much more than noise.

    Of the first `clean` ones it leaves what noise would: beyond them contacts of a few trials may be made at wrong times.
    `operations` is how many the runs of all stretches took.
    """

    fit: Fit
    samples: int
    clean: int
    operations: float = 0.0

    @property
    def stretch(self) -> int:
        """Samples of the stretches that trials are cut into: the clean ones, or some more if those are too few to tell much."""
        return max(self.clean, min(self.samples, FEWEST_SAMPLES))


def follow_closely(found: Refit, trials: LearningData) -> Refit:
    """The model with the values that a fit found, along other trials; of a set with contacts, over growing stretches.

    Raises:
        ComponentError: if free runs fail.
    """
    if not found.effects.contacts:
        return follow(found, trials)
    able, _, failed = _closely(found, trials)
    if not able:
        raise failed
    return min(able, key=lambda each: each.cost)


def lost_after(found: Refit, trials: LearningData) -> int | None:
    """Samples of other trials after which free runs of a set with contacts are lost; None if they follow them to the end."""
    if not found.effects.contacts:
        return None
    able, followed, _ = _closely(found, trials)
    if any(each.cost <= BEYOND_NOISE**2 for each in able):
        return None
    return None if followed is None or followed.samples == trials.longest else followed.stretch


def _closely(found: Refit, trials: LearningData) -> tuple[list[Refit], Followed | None, ComponentError]:
    """The model along other trials at once and, if that leaves more than noise, over growing stretches, as far as runs
    did not fail; how far it follows them so; and the last failure."""
    able, failed = list[Refit](), ComponentError("no stretch can be followed")
    try:
        able.append(follow(found, trials))
    except ComponentError as error:
        failed = error
    if able and able[0].cost <= BEYOND_NOISE**2:
        return able, None, failed
    followed = follow_stretches(as_found(found), trials)
    if followed is not None:
        try:
            able.append(follow(found, trials, followed.fit))
        except ComponentError as error:
            failed = error
    return able, followed, failed


def follow_stretches(found: Refit, learning: LearningData) -> Followed | None:
    """Follow the trials as far as a fitted set can, from its values; None if not even their first stretch."""
    low, high = found.effects.bounds()
    extra, last = learning.nuisances, None
    bounds = (np.r_[low, extra.low], np.r_[high, extra.high])
    values = np.clip(found.fit.values, *bounds)
    records = tuple(found.model.record(t, found.model.compiled.with_values(values)) for t in learning.trials)
    longest = learning.longest
    count, clean, least, operations = min(SHORTEST, longest), 0, np.inf, 0.0
    while True:
        parts = [_first_samples(r, count) for r in records]
        try:
            fitted, worst = _fitted(found, learning, parts, values, bounds, None if last is None else last.fit)
        except ComponentError:
            return last
        if not worst <= BEYOND_NOISE**2:
            return last
        operations += fitted.operations
        least = min(least, max(fitted.cost, 1.0))
        clean = count if fitted.cost <= NEAR_FLOOR**2 * least else clean
        last, values = Followed(fitted, count, clean, operations), fitted.values
        if count == longest:
            return last
        count = min(int(np.ceil(GROWTH * count)), longest)


def _fitted(
    found: Refit,
    learning: LearningData,
    parts: Sequence[Record],
    values: np.ndarray,
    bounds: tuple[np.ndarray, np.ndarray],
    earlier: Fit | None,
) -> tuple[Fit, float]:
    """A fit of first stretches, and the largest mean square that it leaves of a trial."""
    model, parameters = found.model, found.model.compiled.with_values(values)
    metrics = [
        _metric(m, t.noise, len(r.time)) for m, t, r in zip(learning.metrics, learning.trials, parts, strict=True)
    ]
    steps = enough_steps(model, with_starts(parts, earlier), parameters, learning)
    noise, prior = np.ones(len(model.signals)), learning.nuisances.prior(found.size)
    fitted = fit(
        model.compiled,
        parts,
        noise,
        values,
        *bounds,
        substeps=steps,
        prior=prior,
        reduce=metrics,
        tolerance=ROUGH,
        earlier=earlier,
    )
    left, _ = linearise(model.compiled, parts, noise, fitted, substeps=steps, prior=prior, reduce=metrics)
    rows = [len(part.time) // m.stride * len(model.signals) for m, part in zip(metrics, parts, strict=True)]
    return fitted, max(float(np.mean(each**2)) for each in split_by_trials(left, rows))


def _first_samples(record: Record, count: int) -> Record:
    part = slice(0, count)
    return replace(record, time=record.time[part], inputs=record.inputs[part], measured=record.measured[part])


def _metric(metric: Metric, noise: np.ndarray, samples: int) -> Metric:
    """The metric of the first samples of a trial: at first, noise carried by the machine is small beside the sensors'."""
    if samples < FEWEST_MEANS * metric.stride:
        return Metric(1, 1.0 / noise)
    return metric.of_first(samples, len(noise))
