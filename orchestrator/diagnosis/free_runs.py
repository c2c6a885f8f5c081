"""Diagnose models with slots, and FMUs, by free runs: compare, search, let held-out trials referee, give a verdict."""

import time
from collections.abc import Callable, Mapping, Sequence, Set
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import replace
from typing import TypeVar

import numpy as np
from threadpoolctl import threadpool_limits

from fmus.catalogue import ModelicaModel
from fmus.errors import ComponentError, MisfitError
from orchestrator.compare.comparison import compare
from orchestrator.diagnosis.advise.advice import with_next_experiment
from orchestrator.diagnosis.advise.left_open import with_open_questions
from orchestrator.diagnosis.advise.unexplained import unexplained_forces, where_forces_lack
from orchestrator.diagnosis.fit.candidates import EffectSet, find_candidates, model_of
from orchestrator.diagnosis.fit.evidence import LearningData, Refit, fit_nominal, smoothed
from orchestrator.diagnosis.linear.noise_model import metrics_of
from orchestrator.diagnosis.linear.remetric import NoiseOfSignals
from orchestrator.diagnosis.linear.response import Response
from orchestrator.diagnosis.noise.nuisances import Nuisances, nuisances
from orchestrator.diagnosis.noise.outliers import without_outliers
from orchestrator.diagnosis.referee.adjusted import adjusted_parameters
from orchestrator.diagnosis.referee.conclude import conclude
from orchestrator.diagnosis.referee.referee import Referee, version_name
from orchestrator.diagnosis.referee.runners_up import runners_up
from orchestrator.diagnosis.referee.tried import tried
from orchestrator.diagnosis.search.compile_ahead import compile_ahead
from orchestrator.diagnosis.search.cutting import TooLong, cut, is_worth_a_cut
from orchestrator.diagnosis.search.search import Progress, Searcher
from orchestrator.diagnosis.search.stretches import follow_closely, lost_after
from orchestrator.library.cards import EffectCard
from orchestrator.measurements import BoundSet, BoundTrial, MeasurementSet, bind
from orchestrator.models.estimation import Z90
from orchestrator.models.hands import hands
from orchestrator.models.patch import free_slots
from orchestrator.models.smoothing import SmoothedTrial
from orchestrator.models.symbolic import SymbolicModel
from orchestrator.verdicts.result import Diagnosis, Estimate, NamedEffect
from orchestrator.work import Work

__all__ = ["named_effects", "search_slots", "version_name"]

# Clocks of inputs and outputs may differ by a sample: two standard deviations.
CLOCK_SAMPLES = 0.5
# What takes the place of the best set may itself have kin that is likelier: a torque pair that is an encoder's offset.
MOST_SECOND_THOUGHTS = 2
# Trials are cut into shorter and shorter stretches at most so often.
MOST_CUTS = 3

Found = TypeVar("Found")


def search_slots(
    source: ModelicaModel,
    measurements: MeasurementSet,
    library: Sequence[EffectCard],
    workers: int,
    progress: Progress,
    work: Work | None,
) -> Diagnosis:
    """The diagnosis of a model with slots, or of an FMU, by free runs; over stretches of the trials if contacts ask for it."""

    def by(shown: MeasurementSet, may_cut: bool) -> Diagnosis:
        return _diagnosed(source, shown, measurements, library, workers, progress, work, may_cut=may_cut)

    # Two BLAS threads make the small factorisations of the fits about 100 times slower.
    with threadpool_limits(limits=1, user_api="blas"), hands(workers):
        return _over_stretches(by, measurements, {card.id for card in library if card.contacts}, progress)


def _over_stretches(
    by: Callable[[MeasurementSet, bool], Diagnosis],
    measurements: MeasurementSet,
    contacts: Set[str],
    progress: Progress,
) -> Diagnosis:
    """The diagnosis `by` trials, which may ask for a cut if told so: whole ones, or stretches of them if effects that make
    contacts (ids) let no run follow those and are named by these."""
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
        if contacts & {effect.id for effect in found.effects}:
            note = (
                f"judged over stretches of {seconds:.3g} s: contacts let free runs follow no whole trial; what is too slow to"
                " show in a stretch is not looked for"
            )
            return replace(found, warnings=(*found.warnings, note), seconds=time.monotonic() - began)
        break
    return replace(by(measurements, False), seconds=time.monotonic() - began)


def _diagnosed(
    source: ModelicaModel,
    measurements: MeasurementSet,
    whole: MeasurementSet,
    cards: Sequence[EffectCard],
    workers: int,
    progress: Progress,
    work: Work | None,
    may_cut: bool,
) -> Diagnosis:
    """The diagnosis by some trials, which may be stretches of `whole` ones."""
    began = time.monotonic()
    system = source.compile()
    model = model_of(source, system)
    progress("comparing the model with the measurement")
    nominal = compare(model, measurements, workers=workers)
    if nominal.held_out is None or not any(trial.set == "learning" for trial in nominal.trials):
        raise MisfitError(
            f"{measurements.path} has no trials on one side; a diagnosis needs learning and held-out trials"
        )
    data = bind(measurements, model.inputs, model.outputs)
    if measurements is not whole:
        # Stretches show less of the noise: rattling counted as slow noise, with next to none that is white.
        data = data.with_noise_of(bind(whole, model.inputs, model.outputs))
    candidates, impossible = find_candidates(source, system, cards)
    progress("compiling the model with each effect")
    compile_ahead(source, candidates, workers)
    plain = model.restricted(data.output_names)
    extra = nuisances(system, measurements.tolerances, _clock_std(data))
    learning = _in_metric(source, plain, data, data.learning, nominal.noise_floor, extra)
    searcher = Searcher(
        base=source,
        nominal=plain,
        slots=free_slots(system),
        candidates=tuple(candidates),
        learning=learning,
        workers=workers,
        progress=progress,
        work=work,
        may_cut=may_cut,
        noise=NoiseOfSignals(*(tuple(map(data.noise_of, names)) for names in (data.output_names, data.input_names))),
    )
    with _Aside(workers) as aside:
        lacking = aside.begin(lambda: where_forces_lack(plain, learning))
        later = aside.begin(lambda: _in_metric(source, plain, data, data.held_out, nominal.noise_floor, extra))
        path = searcher.run()
        held_out, (where, findings) = later(), lacking()
    lost = lost_after(path[-1].refit, held_out) if path and may_cut else None
    if lost is not None and is_worth_a_cut(lost, 0):
        raise TooLong(lost * held_out.step)
    if path and searcher.noise is not None and searcher.learning is not learning:
        with suppress(ComponentError):  # free runs that fail carry no noise, and the referee refuses them
            held_out = searcher.noise.carried_by(follow_closely(path[-1].refit, held_out), held_out)
    referee = Referee(source, measurements, nominal, held_out, workers)
    base = searcher.trace.stages[0].tangent.base
    scale = searcher.test_of(path[-1].refit if path else base).colour.scale
    refereed = referee.judge(base, path, scale, named_effects, progress)
    if path and path[-1].refit.labels in refereed.refused:
        tied = runners_up(path[-1].refit, searcher.trace, scale, searcher.fitter.finished)
        refereed = referee.instead(refereed, base, tied, scale, named_effects, progress)
    for _ in range(MOST_SECOND_THOUGHTS if refereed.accepted else 0):
        last = refereed.accepted[-1].refit
        searcher.try_kin(last)
        scale = searcher.test_of(last).colour.scale
        refereed = referee.reconsidered(refereed, base, searcher.trace.refitted, scale, named_effects, progress)
        if refereed.accepted[-1].refit is last:
            break
    scale = searcher.test_of(refereed.accepted[-1].refit if refereed.accepted else base).colour.scale
    declared = all(data.levels[name].declared is not None for name in data.output_names)
    found = conclude(nominal, refereed, referee, searcher, declared=declared, impossible=impossible)
    best = refereed.accepted[-1].refit if refereed.accepted else None
    fitted = (
        best if best is not None and found.verdict in ("named", "ambiguous") else searcher.trace.stages[0].tangent.base
    )
    adjusted = adjusted_parameters(fitted)
    if adjusted:
        note = f"fitted within stated tolerances, and so in a patched model: {', '.join(map(str, adjusted))}"
        found = replace(found, warnings=(*found.warnings, note))
    of_data = [note.removeprefix("warning: ") for note in data.notes if note.startswith("warning: ")]
    of_data += _on_outliers(data, (*searcher.learning.trials, *held_out.trials))
    found = replace(found, warnings=(*found.warnings, *of_data))
    found = replace(found, adjusted=adjusted, clock_shift_s=fitted.fit.shift)
    named = best if found.verdict in ("named", "ambiguous") else None
    outcomes = tried(found.ranking, searcher.trace, named, [entry.refit for entry in refereed.accepted])
    found = replace(found, where=tuple(where), findings=findings, tried=outcomes)
    found = with_open_questions(found, named, searcher.trace.stages, searcher.learning, candidates)
    if found.verdict == "unknown":
        progress("looking at what is left")
        found = replace(found, latent_forces=unexplained_forces(plain, best, searcher.learning))
    found = with_next_experiment(found, searcher, best, scale)
    return replace(found, seconds=time.monotonic() - began)


class _Aside:
    """A thread for what a search does not wait for, in the gaps that it leaves; none for a single worker."""

    def __init__(self, workers: int) -> None:
        self._pool = ThreadPoolExecutor(1) if workers > 1 else None

    def __enter__(self) -> "_Aside":
        return self

    def __exit__(self, *reason: object) -> None:
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)

    def begin(self, work: Callable[[], Found]) -> Callable[[], Found]:
        """Begin work, and return what gives its result."""
        return work if self._pool is None else self._pool.submit(work).result


def _clock_std(data: BoundSet) -> float:
    """Standard deviation in s of a constant shift between inputs and outputs; 0 if no input is measured."""
    if len(data.unconnected_inputs) == len(data.input_names):
        return 0.0
    return CLOCK_SAMPLES * float(np.median(np.diff(data.trials[0].time)))


def _in_metric(
    source: ModelicaModel,
    plain: SymbolicModel,
    data: BoundSet,
    trials: Sequence[BoundTrial],
    floor: Mapping[str, float],
    extra: Nuisances,
) -> LearningData:
    """Trials with the metric of the noise that is declared or shows in the record, carried through the model."""
    noise = np.array([data.noise_std[name] for name in data.output_names])
    outputs, inputs = ([data.noise_of(name) for name in names] for names in (data.output_names, data.input_names))
    fast = np.array([each.std for each in inputs])
    shown = tuple(replace(trial, input_noise=fast) for trial in smoothed(trials, noise))
    of_floor = np.array([floor[name] for name in data.output_names])
    found = LearningData(shown, noise, nuisances=Nuisances(shift_std=extra.shift_std))
    # Precise sensors see how a machine carries noise at its own parameters rather than at the nominal ones.
    for _ in range(2 if extra.names and fast.any() else 1):
        base = fit_nominal(EffectSet(source, (), data.output_names), plain, found)
        response = Response(base, [t.smoother for t in shown])
        metrics = metrics_of(response, outputs, inputs)
        found = LearningData(shown, of_floor, tuple(metrics), extra)
    errors = [y - t.measured for y, t in zip(response.outputs, shown, strict=True)]
    clean = tuple(map(without_outliers, shown, errors, metrics))
    return replace(found, trials=clean)


def _on_outliers(data: BoundSet, trials: Sequence[SmoothedTrial]) -> list[str]:
    """What was replaced beside the samples that a look at the record shows to be wrong."""
    recorded = (*data.learning, *data.held_out)
    pairs = zip(recorded, trials, strict=True)
    count = sum(int(np.count_nonzero(raw.outputs != clean.measured)) for raw, clean in pairs)
    return [f"{count} further samples stand out of the errors around them and do not count"] if count else []


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
        NamedEffect(c.card.id, c.site, own) for c, own in zip(found.effects.candidates, estimates, strict=True)
    )
