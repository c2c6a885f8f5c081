"""Diagnose a model: look at the record, then search where the model can be changed, and make no answer worse than none.

Models with slots and FMUs are searched by free runs (`diagnosis`); models without slots, and what that leaves unexplained,
at their balance equations (`greybox`).
"""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from fmus.catalogue import ModelicaModel
from fmus.errors import ComponentError, MisfitError
from fmus.library import library_folders
from orchestrator.blackbox.source import FmuSource, Source
from orchestrator.compare.comparison import compare, within_noise
from orchestrator.compare.result import Comparison
from orchestrator.datacheck.check import check_data, forbids_physics
from orchestrator.datacheck.findings import Finding
from orchestrator.datacheck.holding import open_inputs, turned, with_interpolation
from orchestrator.diagnosis.advise.rival_laws import with_separating_experiment
from orchestrator.diagnosis.fit.extensible import model_of
from orchestrator.diagnosis.free_runs import search_slots
from orchestrator.diagnosis.referee.referee import Refereed
from orchestrator.diagnosis.search.search import Progress
from orchestrator.gp.trials.witness import document, sentences, witness_functions
from orchestrator.greybox.diagnose import Outcome, diagnose_greybox
from orchestrator.greybox.interpolation import RunsOtherwise, held_for_nothing, held_otherwise
from orchestrator.greybox.laws import Law
from orchestrator.greybox.laws import laws as shipped
from orchestrator.greybox.other_answer import OtherAnswer, other_answer
from orchestrator.greybox.tape import can_be_taped
from orchestrator.greybox.thresholds import Thresholds
from orchestrator.library.cards import EffectCard, effect_library
from orchestrator.measurements import MeasurementSet, bind
from orchestrator.models.contract import Model
from orchestrator.models.patch import free_slots
from orchestrator.models.symbolic import SymbolicModel
from orchestrator.models.threads import threads
from orchestrator.simpler_answers import needs_excitation, or_one_law, or_within_tolerances
from orchestrator.verdicts.cannot_tell import first_mend, search_failed
from orchestrator.verdicts.gate import doubted, without_harm
from orchestrator.verdicts.result import Diagnosis
from orchestrator.versions import extended_class
from orchestrator.work import Work

# An error along learning trials of so many times the floor asks for a look at the balance equations, whatever was named.
MUCH_LEFT = 2.0
# What removes less of the error along learning trials, although much is left, is doubted.
LEAST_REMOVED = 0.5
# Notes of free runs that speak of their own answer, not of the record.
OF_AN_ANSWER = re.compile("not tried|its part without structure|explains the error, but|: odds ")
SURE, NAMES = ("named", "adequate"), ("named", "ambiguous")


def diagnose(
    source: Source,
    measurements: MeasurementSet,
    *,
    cards: Sequence[EffectCard] | None = None,
    workers: int = 2,
    progress: Progress = lambda message: None,
    work: Work | None = None,
    laws: Sequence[Law] = (),
) -> Diagnosis:
    """Find which effects of the library a model lacks, judged by learning trials and confirmed by held-out ones.

    Args:
        source: the model: a Modelica class, or an FMU or system with its sites.
        measurements: learning and held-out trials, with units and sensor noise.
        cards: the effects to choose from, by default the shipped ones.
        workers: fits that run at a time; the result does not depend on it.
        progress: called with one line at each stage.
        work: who screens and fits, by default this process; the result does not depend on it.
        laws: formulas of the user's own, which models without slots can have.

    Returns:
        The verdict with its effects, their values in SI units with 90 % intervals, errors along held-out trials before and
        after, and the evidence.

    Raises:
        MisfitError: if the data do not fit the model or hold no held-out trials.
        ComponentError: if the model itself cannot be simulated.
    """
    library = effect_library() if cards is None else cards
    progress("checking the record")
    model = model_of(source, source.compile())
    asked = open_inputs(model, measurements)
    measurements = with_interpolation(model, measurements)

    checks = check_data(model, measurements)

    def search(measured: MeasurementSet, asked: Sequence[str]) -> Diagnosis:
        return _diagnosed(source, model, measured, checks, library, workers, progress, work, laws, asked)

    found = _as_inputs_run(search, measurements, asked, progress, workers)
    # What a model keeps from event to event is an input for the record alone.
    apart = (
        isinstance(found.search, Outcome) and found.search.case.base.kept is None and not isinstance(source, FmuSource)
    )
    if found.verdict == "ambiguous" and apart:
        progress("choosing the next experiment")
        with threadpool_limits(limits=1, user_api="blas"), threads(workers):
            found = with_separating_experiment(found, found.search)
    return found


def _as_inputs_run(
    search: Callable[[MeasurementSet, Sequence[str]], Diagnosis],
    measurements: MeasurementSet,
    asked: Mapping[str, str],
    progress: Progress,
    workers: int,
) -> Diagnosis:
    """Search, and search again where the record says that inputs run otherwise between samples than was assumed.

    `asked` are inputs of which nobody has said it, with their columns. A search may stop for that early; what its answer does
    not need is turned back then.
    """
    as_assumed, early = measurements, dict[str, float]()
    try:
        found = search(measurements, list(asked))
    except RunsOtherwise as stopped:
        early = stopped.gains
        measurements = turned(measurements, asked, early)
        found = search(measurements, ())
    if asked and isinstance(found.search, Outcome):
        progress(f"asking how {', '.join(asked)} run between samples, with what was found")
        setting, chosen = found.search.setting, found.search.decision.chosen
        with threadpool_limits(limits=1, user_api="blas"), threads(workers):
            if back := held_for_nothing(setting, chosen, list(early)):
                rest = {name: gain for name, gain in early.items() if name not in back}
                measurements = turned(as_assumed, asked, rest)
            gains = held_otherwise(setting, chosen, [name for name in asked if name not in early])
        if gains or back:
            measurements = turned(measurements, asked, gains)
            found = search(measurements, ())
    warnings = (*found.warnings, *measurements.notes[len(as_assumed.notes) :])
    return replace(found, warnings=warnings, interpolation=measurements.interpolation)


def _diagnosed(
    source: Source,
    model: Model,
    measurements: MeasurementSet,
    checks: tuple[Finding, ...],
    library: Sequence[EffectCard],
    workers: int,
    progress: Progress,
    work: Work | None,
    laws: Sequence[Law],
    asked: Sequence[str],
) -> Diagnosis:
    """The answer, with inputs that run between samples as `measurements` say."""
    source = _holding(source, model, measurements)
    if forbids_physics(checks):
        return replace(first_mend(model, measurements, checks, workers), mended=measurements.mended)

    closed = isinstance(source, FmuSource)
    progress("comparing the model with the measurement")
    with threadpool_limits(limits=1, user_api="blas"):  # as in both searches
        given = compare(model_of(source, source.compile()), measurements, workers=workers, checks=checks)
    if not closed and not free_slots(source.compile()):
        remembers = source.compile().remembers
        try:
            found = _by_greybox(source, measurements, given, workers, progress, laws, asked)
        except ComponentError as error:
            if not remembers:
                raise
            found = search_failed(given, error)  # events that cannot be read off the record
        if found.verdict in NAMES and remembers and _removed(found) < LEAST_REMOVED:
            # A filter takes events from the record; only runs say whether the model's own come when they should.
            found = doubted(found, f"it removes {_removed(found):.0%} of the error along learning trials")
    else:

        def by_free_runs(measured: MeasurementSet) -> Diagnosis:
            try:
                return without_harm(search_slots(source, measured, given, library, workers, progress, work))
            # Numbers that the search cannot go on with; CasADi reports what it cannot do as RuntimeError.
            except (RuntimeError, ArithmeticError, LookupError, ValueError) as error:
                return search_failed(given, error)

        found = by_free_runs(measurements)
        if not isinstance(source, FmuSource):
            found = or_one_law(source, measurements, found, given, workers, progress)
            found = or_within_tolerances(measurements, found, by_free_runs, progress)
        other = None if closed else _in_grey_box(source, found, measurements, library)
        if other is not None:
            incomplete = found.verdict == "named" and other.unexplained > Thresholds().complete_share
            found = replace(found, unexplained_share=other.unexplained, incomplete=incomplete)
        doubtful = other is not None and other.unexplained > 1 - LEAST_REMOVED
        if (_asks_for_more(found, closed) or doubtful) and (not isinstance(source, FmuSource) or can_be_taped(source)):
            progress("looking at every balance equation")
            found = _better_of(found, _by_greybox(source, measurements, given, workers, progress, laws, asked), other)
        if isinstance(model, SymbolicModel) and found.verdict != "adequate":
            progress("asking which inputs what is missing goes with")
            heard = witness_functions(model, measurements)
            # What explains the record says itself which inputs it goes with.
            said = () if found.verdict == "named" and _left(found) < MUCH_LEFT else sentences(heard)
            findings = (*found.findings, *said)
            witness = found.witness or heard.pictures
            found = replace(found, functions=document(heard), findings=findings, witness=witness)
    if closed and found.verdict == "unknown" and within_noise(found.steps[0].comparison, Thresholds().within):
        found = replace(found, verdict="adequate", best=())
    elif closed and found.verdict in ("adequate", "cannot_tell") and not found.best and _left(found, 0) >= MUCH_LEFT:
        # Coloured noise explains any slow error, but not one of several times the sensors' noise.
        found = doubted(
            found, f"free runs leave {_left(found, 0):.3g} times the noise, and no effect that was tried stands out"
        )
    warnings = (*map(str, checks), *found.warnings)
    own = "" if closed or source.file is None else f"{source.file}:{source.class_name}"
    return replace(
        found,
        warnings=warnings,
        data_checks=checks,
        mended=measurements.mended,
        libraries=library_folders(),
        model_file=own,
    )


def _holding(source: Source, model: Model, measurements: MeasurementSet) -> Source:
    """The source whose runs hold the inputs that were held."""
    return replace(source, held=bind(measurements, model.inputs, model.outputs).trials[0].held)


def _by_greybox(
    source: Source,
    measurements: MeasurementSet,
    given: Comparison,
    workers: int,
    progress: Progress,
    laws: Sequence[Law],
    asked: Sequence[str],
) -> Diagnosis:
    return diagnose_greybox(
        source, measurements, given=given, workers=workers, progress=progress, library=(*shipped(), *laws), asked=asked
    )


def _in_grey_box(
    source: Source, found: Diagnosis, measurements: MeasurementSet, library: Sequence[EffectCard]
) -> OtherAnswer | None:
    """Several effects that free runs named, as the grey box sees them; None if they leave little, or the filter cannot follow them.

    One effect that takes away most is not doubted: more of them would explain more of any record.
    """
    several = found.verdict in NAMES and len(found.effects) > 1
    if not several or _left(found) < MUCH_LEFT or not isinstance(source, ModelicaModel):
        return None
    fitted = sum(len(effect.parameters) for effect in found.effects) + len(found.adjusted)
    cannot = (MisfitError, RuntimeError, ArithmeticError, LookupError, ValueError)
    with suppress(*cannot), threadpool_limits(limits=1, user_api="blas"), np.errstate(all="ignore"):
        answer = extended_class(source, found.effects, library, found.adjusted)
        # A search at balances beside delays takes minutes, and no case shows that it pays.
        if answer.compile().n_delays == 0:
            return other_answer(source, answer, fitted, measurements, Thresholds())
    return None


def _asks_for_more(found: Diagnosis, is_fmu: bool) -> bool:
    """Whether free runs with effects in slots, or at an FMU's inputs and outputs, name nothing for sure, or leave much.

    Several effects at the borders of an FMU may stand for one inside of it.
    """
    left = _left(found) >= MUCH_LEFT
    if found.verdict == "cannot_tell" and (
        within_noise(found.steps[0].comparison, Thresholds().within) or needs_excitation(found)
    ):
        return False
    if is_fmu:
        return found.verdict not in SURE or left or len(found.effects) > 1
    return found.verdict not in (*NAMES, "adequate") or (left and _removed(found) < LEAST_REMOVED)


def _better_of(found: Diagnosis, second: Diagnosis, other: OtherAnswer | None = None) -> Diagnosis:
    """Of what free runs named and what balance equations named, that which leaves less of the learning trials, or is likelier.

    Where free runs leave much (`other` is what they named as the grey box sees it), it is not for the sensors' noise, and the
    likelihood with forces that disturb the plant counts.

    What free runs named and leaves more than half of the error along learning trials gives way to what balance equations name,
    and is doubted if nothing helps there; so is one of several answers that all leave much. Fewer effects at the balance
    equations go before more elsewhere that leave as much. The best set of free runs that are not explained to the end stays the
    best if it takes away more of the error than what balance equations name. Two effects that free runs cannot tell apart stay
    two where balance equations name the one without having tried the other.
    """
    seconds = found.seconds + second.seconds
    if found.verdict == "ambiguous" and second.verdict == "named":
        alike = {effect for group in found.confusable for effect in group}
        tried = {effect for ranked in second.ranking for effect in ranked.effects}
        if {effect.id for effect in second.effects} <= alike and not alike <= tried:
            return replace(found, seconds=seconds)
    if found.best and second.verdict in NAMES and _removed(second) < _removed_by_best(found):
        return replace(found, seconds=seconds)
    names = found.verdict in NAMES
    removed = _removed(found)
    shaky = removed < LEAST_REMOVED or (found.verdict == "ambiguous" and _left(found) >= MUCH_LEFT)
    if second.verdict == "named" or (second.verdict == "ambiguous" and not names):
        simpler = len(second.effects) < len(found.effects) and _left(second) <= (1 + Thresholds().alike) * _left(found)
        likelier = other is not None and other.gives_way_to(second.search.decision.chosen, Thresholds())
        if found.verdict != "named" or removed < LEAST_REMOVED or _left(second) < _left(found) or simpler or likelier:
            # What had no place at the borders of an FMU was tried at its balances, and what is said of an answer goes with it.
            warnings = (*second.warnings, *(note for note in found.warnings if not OF_AN_ANSWER.search(note)))
            return replace(second, where=found.where or second.where, warnings=warnings, seconds=seconds)
    elif names and shaky and second.verdict not in NAMES:
        reason = f"it removes {removed:.0%} of the error along learning trials"
        found = doubted(found, f"{reason}, and nothing helps at the balance equations")
    return replace(found, seconds=seconds)


def _left(found: Diagnosis, step: int = -1) -> float:
    """Error along learning trials after a step, the last one if it is left out, over the floor."""
    learning = found.steps[step].comparison.learning
    return math.inf if learning is None else learning.over_floor


def _removed(found: Diagnosis) -> float:
    """Share of the error along learning trials above the floor that the answer takes away; all of it where none is left."""
    return _taken_away(_left(found, 0), _left(found))


def _removed_by_best(found: Diagnosis) -> float:
    """The same share for the best set of free runs, although it is not proven; none if the search was cut before its end."""
    steps = found.search.steps if isinstance(found.search, Refereed) and not found.search.was_cut else ()
    over = [step.comparison.learning.over_floor for step in steps if step.comparison.learning is not None]
    return _taken_away(over[0], over[-1]) if over else 0.0


def _taken_away(before: float, after: float) -> float:
    if after <= 1.0 or not math.isfinite(before):
        return float(after <= 1.0)
    return (before - after) / max(before - 1.0, 1e-9)
