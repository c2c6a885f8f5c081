"""Diagnose a model: look at the record, then search where the model can be changed, and make no answer worse than none.

Models with slots and FMUs are searched by free runs (`diagnosis`); models without slots, and what that leaves unexplained,
at their balance equations (`greybox`).
"""

import math
from collections.abc import Sequence
from dataclasses import replace

from fmus.catalogue import ModelicaModel
from fmus.library import library_folders
from orchestrator.blackbox.source import FmuSource
from orchestrator.datacheck.check import check_data, forbids_physics
from orchestrator.datacheck.holding import with_interpolation
from orchestrator.diagnosis.fit.candidates import as_fmu, model_of
from orchestrator.diagnosis.free_runs import search_slots
from orchestrator.diagnosis.search.search import Progress
from orchestrator.greybox.diagnose import diagnose_greybox
from orchestrator.greybox.laws import Law
from orchestrator.greybox.tape import can_be_taped
from orchestrator.library.cards import EffectCard, effect_library
from orchestrator.measurements import MeasurementSet
from orchestrator.models.patch import free_slots
from orchestrator.verdicts.cannot_tell import first_mend
from orchestrator.verdicts.gate import without_harm
from orchestrator.verdicts.result import Diagnosis
from orchestrator.work import Work

# Verdicts after which an FMU's balances are not looked at as well, unless the error along learning trials stays above so many
# times the floor: effects at inputs and outputs alone cannot say everything.
SURE = ("named", "adequate")
MUCH_LEFT = 2.0


def diagnose(
    source: ModelicaModel,
    measurements: MeasurementSet,
    *,
    cards: Sequence[EffectCard] | None = None,
    workers: int = 2,
    progress: Progress = lambda message: None,
    work: Work | None = None,
    laws: Sequence[Law] = (),
) -> Diagnosis:
    """Find which effects of the library a model lacks, judged by learning trials and confirmed by held-out ones.

    `work` says who screens and refits, by default this process; the result does not depend on it, nor on `workers`.
    `laws` are formulas of the user's own, which models without slots can have.

    Raises:
        MisfitError: if the data do not fit the model or hold no held-out trials.
        ComponentError: if the model itself cannot be simulated.
    """
    library = effect_library() if cards is None else cards
    progress("checking the record")
    model = model_of(source, source.compile())
    measurements = with_interpolation(model, measurements)
    checks = check_data(model, measurements)
    if forbids_physics(checks):
        return replace(first_mend(model, measurements, checks, workers), mended=measurements.mended)

    fmu = as_fmu(source)
    if fmu is None and not free_slots(source.compile()):
        found = _by_greybox(source, measurements, workers, progress, laws)
    else:
        found = without_harm(search_slots(source, measurements, library, workers, progress, work))
        if fmu is not None:
            if not (found.verdict in SURE and _left(found) < MUCH_LEFT):
                found = _second_look(fmu, measurements, workers, progress, found, laws)
        elif found.verdict in ("unknown", "cannot_tell"):
            progress("no slot explains it: looking at every balance equation")
            found = _further(found, _by_greybox(source, measurements, workers, progress, laws))
    warnings = (*map(str, checks), *found.warnings)
    return replace(
        found, warnings=warnings, data_checks=checks, mended=measurements.mended, libraries=library_folders()
    )


def _by_greybox(
    source: ModelicaModel, measurements: MeasurementSet, workers: int, progress: Progress, laws: Sequence[Law]
) -> Diagnosis:
    return diagnose_greybox(source, measurements, workers=workers, progress=progress, more=laws)


def _second_look(
    fmu: FmuSource,
    measurements: MeasurementSet,
    workers: int,
    progress: Progress,
    found: Diagnosis,
    laws: Sequence[Law],
) -> Diagnosis:
    """What the grey box names in an FMU that tells its rates, where free runs with effects at its inputs and outputs named
    nothing, or what leaves more of the learning trials; else what these found."""
    if not can_be_taped(fmu):
        return found
    progress("looking at the FMU's balances")
    second = _by_greybox(fmu, measurements, workers, progress, laws)
    better = second.verdict == "named" or (second.verdict, found.verdict) == ("ambiguous", "unknown")
    if not better or (found.verdict in SURE and _left(second) >= _left(found)):
        return found
    return replace(second, warnings=(*second.warnings, *found.warnings), seconds=found.seconds + second.seconds)


def _left(found: Diagnosis) -> float:
    """Error along learning trials after the last step, over the floor."""
    learning = found.steps[-1].comparison.learning
    return math.inf if learning is None else learning.over_floor


def _further(found: Diagnosis, other: Diagnosis) -> Diagnosis:
    """The answer at the balance equations where that names something, with the time of both."""
    seconds = found.seconds + other.seconds
    if other.verdict not in ("named", "ambiguous"):
        return replace(found, seconds=seconds)
    return replace(other, where=found.where, seconds=seconds)
