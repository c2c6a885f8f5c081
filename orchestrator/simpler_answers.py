"""What explains a record in place of several effects in a model's slots, or of none: one law that no slot has, a wrong
parameter, or parameters that are a little off.

Free runs try the cards of slots and take parameters for exact unless tolerances are stated: two effects stand for a cubic spring, a
sensor error for an inertia, and several parameters that are a little off hide every effect.
"""

import math
from collections.abc import Callable
from dataclasses import replace

from fmus.catalogue import ModelicaModel
from orchestrator.compare.comparison import within_noise
from orchestrator.compare.estimates import WITHIN_NOISE
from orchestrator.compare.result import Comparison
from orchestrator.diagnosis.noise.thresholds import ASSUMED
from orchestrator.diagnosis.referee.conclude import SEVERAL_OFF
from orchestrator.diagnosis.referee.referee import Refereed
from orchestrator.greybox.diagnose import diagnose_greybox
from orchestrator.greybox.laws import laws
from orchestrator.greybox.thresholds import Thresholds
from orchestrator.library.cards import effect_library
from orchestrator.measurements import MeasurementSet
from orchestrator.verdicts.result import Diagnosis, NamedEffect

NAMES = ("named", "ambiguous")
# One law or parameter, or all parameters together where there are few: a full search takes as long as one among all effects.
SINGLE = replace(Thresholds(), largest_set=1, rounds=0, shortlist=3, singles=3)


def or_one_law(
    source: ModelicaModel,
    measurements: MeasurementSet,
    found: Diagnosis,
    given: Comparison,
    workers: int,
    progress: Callable[[str], None],
) -> Diagnosis:
    """The answer of free runs, or one law at a balance, or wrong parameters, where that leaves noise only, as little as the answer,
    by fewer numbers.

    Args:
        source: the model.
        measurements: learning and held-out trials.
        found: what free runs with effects in slots came to.
        given: the comparison of the model as it is.
        workers: fits that run at a time.
        progress: called with one line at each stage.
    """
    names = found.verdict in NAMES
    explained = names and len(found.effects) == 1 and within_noise(found.steps[-1].comparison, WITHIN_NOISE)
    if found.verdict == "adequate" or explained or measurements.tolerances or within_noise(given, SINGLE.within):
        return found
    progress("asking for one law, or wrong parameters, instead")
    cards = {card.id for card in effect_library()}
    library = [law for law in laws() if law.id not in cards and not law.rare]
    second = diagnose_greybox(
        source, measurements, given=given, workers=workers, progress=progress, limits=SINGLE, library=library
    )
    seconds = found.seconds + second.seconds
    complete = (
        second.verdict in NAMES and not second.incomplete and within_noise(second.steps[-1].comparison, SINGLE.within)
    )
    if not complete or (names and not _is_simpler(second, found)):
        return replace(found, seconds=seconds)
    # How inputs run between samples is asked of no answer of free runs, and of none in place of it.
    return replace(second, where=found.where, seconds=seconds, search=None)


def or_within_tolerances(
    measurements: MeasurementSet,
    found: Diagnosis,
    search: Callable[[MeasurementSet], Diagnosis],
    progress: Callable[[str], None],
) -> Diagnosis:
    """The answer of free runs, or where it leaves more than noise, theirs with parameters that may be a little off, if that is better.

    Args:
        measurements: learning and held-out trials; stated tolerances are those of `found` already.
        found: what free runs with exact parameters came to.
        search: the diagnosis by free runs.
        progress: called with one line.
    """
    # With more free values a search that was cut would end sooner still.
    was_cut = isinstance(found.search, Refereed) and found.search.was_cut
    explained = within_noise(found.steps[-1].comparison, WITHIN_NOISE) or needs_excitation(found)
    if measurements.tolerances or was_cut or explained:
        return found
    progress("asking the same of parameters that may be a little off")
    second = search(measurements.with_tolerances({"default": ASSUMED}))
    seconds = found.seconds + second.seconds
    if second.verdict == "adequate":
        second = _by_name(second)
    if not _goes_before(second, found):
        notes = [note for note in found.warnings if not note.startswith(SEVERAL_OFF)]
        if len(notes) < len(found.warnings):
            notes.append(f"{SEVERAL_OFF} by {ASSUMED:.0%} explain it no better; --tolerance 10% looks farther")
        return replace(found, seconds=seconds, warnings=tuple(notes))
    note = f"no tolerance is stated, and exact parameters leave the record unexplained: each was fitted within {ASSUMED:.0%}"
    return replace(second, seconds=seconds, warnings=(*second.warnings, note))


def needs_excitation(found: Diagnosis) -> bool:
    """Whether free runs explain the record by each of several effects, which only another experiment tells apart."""
    if found.verdict != "cannot_tell" or not found.confusable or not isinstance(found.search, Refereed):
        return False
    return within_noise(found.search.steps[-1].comparison, WITHIN_NOISE)


def _goes_before(second: Diagnosis, found: Diagnosis) -> bool:
    """Whether an answer with parameters that may be off leaves noise only, or names effects where none were named."""
    if second.verdict not in NAMES:
        return False
    step = second.steps[-1]
    return within_noise(step.comparison, WITHIN_NOISE) or (found.verdict not in NAMES and len(step.effects) > 0)


def _by_name(found: Diagnosis) -> Diagnosis:
    """Parameters alone that explain a record, as wrong ones: those whose interval does not hold the given value."""
    wrong = [each.as_effect() for each in found.adjusted]
    effects = tuple(each for each in wrong if math.prod(each.parameters["share"].ci90) > 0)
    return replace(found, verdict="named", effects=effects) if effects and len(found.steps) > 1 else found


def _is_simpler(second: Diagnosis, found: Diagnosis) -> bool:
    """Whether an answer takes fewer numbers than another and leaves as little of the learning trials."""
    fewer = sum(map(_numbers, second.effects)) < sum(map(_numbers, found.effects))
    left, other = (each.steps[-1].comparison.learning for each in (second, found))
    return fewer and left is not None and other is not None and left.over_floor <= (1 + SINGLE.alike) * other.over_floor


def _numbers(effect: NamedEffect) -> int:
    """Values of an effect that were fitted, not held."""
    return sum(each.ci90[0] < each.ci90[1] for each in effect.parameters.values())
