"""Whether values of a model's own parameters explain what several effects in its slots, or none, were found for.

Free runs take parameters for exact unless tolerances are stated, so effects stand for a parameter that is off, and several
parameters that are a little off hide every effect.
"""

import math
from collections.abc import Callable
from dataclasses import replace

from fmus.catalogue import ModelicaModel
from orchestrator.compare.comparison import within_noise
from orchestrator.compare.estimates import WITHIN_NOISE
from orchestrator.compare.result import Comparison
from orchestrator.diagnosis.noise.thresholds import ASSUMED
from orchestrator.greybox.diagnose import diagnose_greybox
from orchestrator.greybox.laws import laws
from orchestrator.greybox.thresholds import Thresholds
from orchestrator.measurements import MeasurementSet
from orchestrator.verdicts.result import Diagnosis

NAMES = ("named", "ambiguous")
# One parameter, or all together where there are few: a full search among parameters takes as long as one among all effects.
SINGLE = replace(Thresholds(), largest_set=1, rounds=0, shortlist=3, singles=3)


def or_wrong_parameters(
    source: ModelicaModel,
    measurements: MeasurementSet,
    found: Diagnosis,
    given: Comparison,
    workers: int,
    progress: Callable[[str], None],
) -> Diagnosis:
    """The answer of free runs, or wrong parameters where these alone leave noise only, by fewer numbers than the answer has.

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
    progress("asking whether parameters of the model are wrong instead")
    library = [law for law in laws() if law.id == "parameter_error"]
    second = diagnose_greybox(
        source, measurements, given=given, workers=workers, progress=progress, limits=SINGLE, library=library
    )
    seconds = found.seconds + second.seconds
    complete = (
        second.verdict in NAMES and not second.incomplete and within_noise(second.steps[-1].comparison, SINGLE.within)
    )
    if not complete or (names and _numbers(second) >= _numbers(found)):
        return replace(found, seconds=seconds)
    # How inputs run between samples is asked of no answer of free runs, and of none in place of it.
    return replace(second, where=found.where, seconds=seconds, search=None)


def or_within_tolerances(
    measurements: MeasurementSet,
    found: Diagnosis,
    search: Callable[[MeasurementSet], Diagnosis],
    progress: Callable[[str], None],
) -> Diagnosis:
    """The answer of free runs, or where it leaves more than noise, theirs with parameters that may be a little off.

    Args:
        measurements: learning and held-out trials; stated tolerances are those of `found` already.
        found: what free runs with exact parameters came to.
        search: the diagnosis by free runs.
        progress: called with one line.
    """
    if measurements.tolerances or within_noise(found.steps[-1].comparison, WITHIN_NOISE):
        return found
    progress("asking the same of parameters that may be a little off")
    second = search(measurements.with_tolerances({"default": ASSUMED}))
    seconds = found.seconds + second.seconds
    if second.verdict == "adequate":
        second = _by_name(second)
    if second.verdict not in NAMES or not within_noise(second.steps[-1].comparison, WITHIN_NOISE):
        return replace(found, seconds=seconds)
    note = f"no tolerance is stated, and exact parameters leave the record unexplained: each was fitted within {ASSUMED:.0%}"
    return replace(second, seconds=seconds, warnings=(*second.warnings, note))


def _by_name(found: Diagnosis) -> Diagnosis:
    """Parameters alone that explain a record, as wrong ones: those whose interval does not hold the given value."""
    wrong = [each.as_effect() for each in found.adjusted]
    effects = tuple(each for each in wrong if math.prod(each.parameters["share"].ci90) > 0)
    return replace(found, verdict="named", effects=effects) if effects and len(found.steps) > 1 else found


def _numbers(found: Diagnosis) -> int:
    """Number of fitted values of an answer."""
    return sum(len(effect.parameters) for effect in found.effects)
