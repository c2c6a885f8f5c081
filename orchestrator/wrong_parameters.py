"""Whether values of a model's own parameters explain what several effects in its slots, or none, were found for.

Free runs take parameters for exact unless tolerances are stated, so effects stand for a parameter that is off.
"""

from collections.abc import Callable
from dataclasses import replace

from fmus.catalogue import ModelicaModel
from orchestrator.compare.comparison import within_noise
from orchestrator.compare.estimates import WITHIN_NOISE
from orchestrator.compare.result import Comparison
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


def _numbers(found: Diagnosis) -> int:
    """Number of fitted values of an answer."""
    return sum(len(effect.parameters) for effect in found.effects)
