"""Diagnose models with slots, and FMUs, by free runs: compare, search, let held-out trials referee, give a verdict."""

import time
from collections.abc import Callable, Sequence, Set
from contextlib import suppress
from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from fmus.errors import ComponentError
from orchestrator.blackbox.source import FmuSource, Source
from orchestrator.compare.comparison import within_noise
from orchestrator.compare.estimates import WITHIN_NOISE
from orchestrator.compare.result import Comparison
from orchestrator.diagnosis.advise.advice import with_next_experiment
from orchestrator.diagnosis.advise.left_open import with_open_questions
from orchestrator.diagnosis.advise.parameters_alike import with_parameters_alike
from orchestrator.diagnosis.advise.unexplained import unexplained_forces, where_forces_lack, with_law
from orchestrator.diagnosis.background import Background
from orchestrator.diagnosis.decide.confusion import rivals
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.evidence import LearningData, Refit, refit
from orchestrator.diagnosis.linear.carried_noise import NoiseOfSignals
from orchestrator.diagnosis.prepared import Prepared, prepared
from orchestrator.diagnosis.referee.adjusted import adjusted_parameters
from orchestrator.diagnosis.referee.conclude import conclude
from orchestrator.diagnosis.referee.referee import Referee, version_name
from orchestrator.diagnosis.referee.tried import tried
from orchestrator.diagnosis.search.cutting import TooLong, cut, is_worth_a_cut
from orchestrator.diagnosis.search.search import Progress, Searcher
from orchestrator.diagnosis.search.stretches import follow_closely, lost_after
from orchestrator.diagnosis.search.thresholds import ROUGH
from orchestrator.diagnosis.search.trace import Accepted
from orchestrator.library.cards import EffectCard
from orchestrator.measurements import MeasurementSet
from orchestrator.models.estimation import Z90
from orchestrator.models.threads import threads
from orchestrator.verdicts.result import Diagnosis, Estimate, NamedEffect, Step, reducible_removed
from orchestrator.work import Work

__all__ = ["named_effects", "search_slots", "version_name"]

# What takes the place of the best set may itself be collinear with a likelier one: a torque pair that is an encoder's offset.
MOST_SECOND_THOUGHTS = 2
# So many parameters that were fitted within their tolerances are listed in a note; all stand in the result.
MOST_ADJUSTED = 4
# Trials are cut into shorter and shorter stretches at most so often.
MOST_CUTS = 3


def search_slots(
    source: Source,
    measurements: MeasurementSet,
    given: Comparison,
    library: Sequence[EffectCard],
    workers: int,
    progress: Progress,
    work: Work | None,
) -> Diagnosis:
    """The diagnosis of a model with slots, or of an FMU, by free runs; over stretches of the trials if contacts ask for it.

    Args:
        source: the model.
        measurements: learning and held-out trials.
        given: the comparison of the model with them.
        library: the effects to choose from.
        workers: fits that run at a time.
        progress: called with one line at each stage.
        work: who screens and fits; None for this process.

    Raises:
        MisfitError: if there are no learning or no held-out trials.
        ComponentError: if the model itself cannot be simulated.
    """

    def by(shown: MeasurementSet, may_cut: bool) -> Diagnosis:
        return _diagnosed(source, shown, measurements, given, library, workers, progress, work, may_cut=may_cut)

    # Two BLAS threads make the small factorisations of the fits about 100 times slower.
    with threadpool_limits(limits=1, user_api="blas"), threads(workers):
        return _over_stretches(by, measurements, {card.id for card in library if card.contacts}, progress)


def _over_stretches(
    by: Callable[[MeasurementSet, bool], Diagnosis],
    measurements: MeasurementSet,
    contacts: Set[str],
    progress: Progress,
) -> Diagnosis:
    """The diagnosis `by` trials, which may ask for a cut if told so: whole ones, or stretches of them if effects that make
    contacts (ids) let no run follow those and are named by these, or are the best that these have."""
    began, shown, seconds = time.monotonic(), measurements, 0.0
    for cuts in range(MOST_CUTS + 1):
        try:
            found = by(shown, cuts < MOST_CUTS)
        except TooLong as error:
            seconds = error.seconds
            progress(f"cutting the trials into stretches of {seconds:.3g} s")
            shown = cut(measurements, seconds)
            continue
        if not seconds:
            return found
        if contacts & {effect.id for effect in (*found.effects, *found.best)}:
            note = (
                f"judged over stretches of {seconds:.3g} s: contacts let free runs follow no whole trial; what is too slow to"
                " show in a stretch is not looked for"
            )
            return replace(found, warnings=(*found.warnings, note), seconds=time.monotonic() - began)
        break
    return replace(by(measurements, False), seconds=time.monotonic() - began)


def _diagnosed(
    source: Source,
    measurements: MeasurementSet,
    whole: MeasurementSet,
    given: Comparison,
    cards: Sequence[EffectCard],
    workers: int,
    progress: Progress,
    work: Work | None,
    may_cut: bool,
) -> Diagnosis:
    """The diagnosis by some trials, which may be stretches of `whole` ones.

    Raises:
        TooLong: if `may_cut`, and free runs follow the trials over stretches only.
    """
    began = time.monotonic()
    asked = prepared(source, measurements, whole, given, cards, workers, progress)
    searcher = _searcher(asked, workers, progress, work, may_cut)
    with Background(workers) as background:
        lacking = background.begin(lambda: where_forces_lack(asked.plain, asked.learning))
        later = background.begin(lambda: asked.in_metric(asked.data.held_out))
        path = _settled(searcher, searcher.run())
        held_out, (where, findings) = later(), lacking()
    if may_cut and path:
        _ask_for_a_cut(path[-1].refit, searcher.learning)
    held_out = _as_carried_by(path, searcher, held_out, asked.learning)
    referee = Referee(source, measurements, asked.nominal, held_out, workers)
    base = searcher.trace.stages[0].tangent.base
    scale = searcher.test_of(path[-1].refit if path else base).colour.scale
    refereed = referee.judge(base, path, scale, named_effects, progress)
    found = conclude(asked.nominal, refereed, searcher, declared=asked.noise_is_declared, impossible=asked.impossible)
    found = replace(found, findings=findings)
    best = refereed.accepted[-1].refit if refereed.accepted else None
    named = best if found.verdict in ("named", "ambiguous") else None
    found = replace(found, where=with_law(where, asked.plain, named, searcher.learning))
    found = _with_what_was_fitted(found, named or base)
    if found.verdict == "adequate" and found.adjusted and _needs_them(asked):
        after = referee.compared(
            base, EffectSet(source, (), asked.plain.signals).fixed(np.zeros(0), version_name(source, 1))
        )
        found = _within_tolerances(found, after)
    of_data = asked.notes((*searcher.learning.trials, *held_out.trials))
    outcomes = tried(found.ranking, searcher.trace, named, [entry.refit for entry in refereed.accepted])
    found = replace(found, warnings=(*found.warnings, *of_data), tried=outcomes)
    found = with_open_questions(found, named, searcher.trace.stages, searcher.learning, asked.candidates)
    if not isinstance(source, FmuSource):  # which would run once for each of its parameters
        found = with_parameters_alike(found, named, asked.plain, searcher.learning, scale, len(asked.candidates))
    if found.verdict == "unknown":
        progress("looking at what is left")
        found = replace(found, latent_forces=unexplained_forces(asked.plain, best, searcher.learning))
    found = with_next_experiment(found, searcher, best, scale)
    return replace(found, seconds=time.monotonic() - began)


def _searcher(asked: Prepared, workers: int, progress: Progress, work: Work | None, may_cut: bool) -> Searcher:
    noise_of, data = asked.data.noise_of, asked.data
    return Searcher(
        base=asked.source,
        nominal=asked.plain,
        slots=asked.slots,
        candidates=asked.candidates,
        learning=asked.learning,
        workers=workers,
        progress=progress,
        work=work,
        may_cut=may_cut,
        noise=NoiseOfSignals(*(tuple(map(noise_of, names)) for names in (data.output_names, data.input_names))),
    )


def _ask_for_a_cut(best: Refit, learning: LearningData) -> None:
    """Raise TooLong if the best set, fitted to the other learning trials, follows the last one over its first part only."""
    if not best.effects.contacts or len(learning.trials) < 2:
        return
    others, last = (
        replace(learning, trials=learning.trials[part], metrics=learning.metrics[part])
        for part in (slice(None, -1), slice(-1, None))
    )
    nuisances = best.fit.values[best.size :]
    again = refit(best.effects, others, best.values, nuisances, tolerance=ROUGH, settled=True)
    lost = lost_after(again, last)
    if lost is not None and is_worth_a_cut(lost, 0):
        raise TooLong(lost * learning.step)


def _as_carried_by(
    path: Sequence[Accepted], searcher: Searcher, held_out: LearningData, learning: LearningData
) -> LearningData:
    """Held-out trials in the metric of the machine with the best set in it, where the search has made that its own."""
    if path and searcher.noise is not None and searcher.learning is not learning:
        with suppress(ComponentError):  # free runs that fail carry no noise, and the referee refuses them
            return searcher.noise.carried_by(follow_closely(path[-1].refit, held_out), held_out)
    return held_out


def _settled(searcher: Searcher, path: list[Accepted]) -> list[Accepted]:
    """The path to the likeliest set: what acts like the last set's effects takes its place if learning trials speak for it."""
    without = searcher.trace.stages[0].tangent.base.cost
    for _ in range(MOST_SECOND_THOUGHTS if path else 0):
        last = path[-1].refit
        searcher.try_collinear(last)
        like = rivals(last, searcher.trace.refitted, searcher.test_of(last).colour.scale, missing=without)
        if not like or like[0].odds >= 1.0:
            break
        rival = like[0].refit
        path = [*(entry for entry in path if entry.refit.labels < rival.labels), Accepted(rival, path[-1].p_value)]
    return path


def _with_what_was_fitted(found: Diagnosis, fitted: Refit) -> Diagnosis:
    """With the model's own parameters that a set's fit moved within their tolerances, and its clock."""
    adjusted = adjusted_parameters(fitted)
    by_share = sorted(adjusted, key=lambda each: -abs(each.share))
    far, others = by_share[:MOST_ADJUSTED], len(by_share[MOST_ADJUSTED:])
    words = ", ".join([*map(str, far), *([f"{others} others by less"] if others else [])])
    notes = [f"fitted within their tolerances, and so in a patched model: {words}"]
    warnings = (*found.warnings, *(notes if adjusted else ()))
    return replace(found, warnings=warnings, adjusted=adjusted, clock_shift_s=fitted.fit.shift)


def _needs_them(asked: Prepared) -> bool:
    """Whether a model leaves more than noise as it is, so that fitted values are of use; those of an FMU are not written."""
    return not within_noise(asked.nominal, WITHIN_NOISE) and not isinstance(asked.source, FmuSource)


def _within_tolerances(found: Diagnosis, after: Comparison) -> Diagnosis:
    """With the model whose parameters were fitted within their tolerances, and its comparison: no more than these were needed."""
    given = found.steps[0].comparison
    assert given.held_out is not None and after.held_out is not None
    removed = reducible_removed(given.held_out.over_floor, after.held_out.over_floor)
    held_out = replace(found.held_out, rmse_after=after.held_out.rmse, reducible_removed=removed)
    return replace(found, steps=(*found.steps, Step((), after, found.adjusted)), held_out=held_out)


def named_effects(found: Refit) -> tuple[NamedEffect, ...]:
    """Effects of a fitted set with their parameters (named as in the effect's class) and 90 % intervals.

    An interval ends where its class says that the parameter does: no time constant is negative.
    """
    estimates: list[dict[str, Estimate]] = [{} for _ in found.effects.candidates]
    rows = zip(found.effects.owners(), found.effects.variables, found.values, found.std, strict=True)
    for owner, variable, value, std in rows:
        slot = found.effects.candidates[owner].slot
        least = -np.inf if variable.minimum is None else variable.minimum
        most = np.inf if variable.maximum is None else variable.maximum
        low, high = max(value - Z90 * std, min(least, value)), min(value + Z90 * std, max(most, value))
        interval = (float(low), float(high))
        estimates[owner][variable.name.removeprefix(f"{slot}.")] = Estimate(float(value), variable.unit, interval)
    return tuple(
        NamedEffect(c.card.id, c.site, own, c.card.variant)
        for c, own in zip(found.effects.candidates, estimates, strict=True)
    )
