"""What a model lacks: effects of the library, and formulas with their files in a folder where no effect explains all."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import cast

from orchestrator.blackbox.source import Source
from orchestrator.datacheck.holding import open_inputs, turned
from orchestrator.diagnose import diagnose
from orchestrator.diagnosis.fit.extensible import model_of
from orchestrator.diagnosis.search.search import Progress
from orchestrator.greybox.interpolation import RunsOtherwise
from orchestrator.greybox.laws import Law
from orchestrator.laws.card import write_files
from orchestrator.laws.proposal import LawProposal
from orchestrator.laws.propose import with_laws
from orchestrator.library.cards import EffectCard
from orchestrator.measurements import MeasurementSet
from orchestrator.verdicts.result import Diagnosis
from orchestrator.work import Work

FOLDER = "laws"


def explain(
    source: Source,
    measurements: MeasurementSet,
    folder: Path | None,
    wanted: bool | None = None,
    *,
    cards: Sequence[EffectCard] | None = None,
    workers: int = 2,
    progress: Progress = lambda message: None,
    work: Work | None = None,
    own: Sequence[Law] = (),
) -> Diagnosis:
    """The diagnosis of a model, with the laws that explain what the library leaves, in files of `folder/laws` if a folder is given.

    A law may tell what no effect of the library did: that an input runs otherwise between samples than was assumed. Then all is
    asked again.

    Args:
        source: the model.
        measurements: learning and held-out trials.
        folder: where files of laws go, if anywhere.
        wanted: whether laws are looked for; None for only where the library leaves something open.
        cards: the effects to choose from, by default the shipped ones.
        workers: fits that run at a time.
        progress: called with one line at each stage.
        work: who screens and fits, by default this process.
        own: formulas of the user's own, beside the shipped ones.
    """

    def search(measured: MeasurementSet) -> Diagnosis:
        return diagnose(source, measured, cards=cards, workers=workers, progress=progress, work=work, laws=own)

    found = search(measurements)
    if wanted is False:
        return found
    asked = open_inputs(model_of(source, source.compile()), measurements)
    try:
        found = with_laws(found, measurements, wanted, list(asked), workers=workers, progress=progress)
    except RunsOtherwise as otherwise:
        other = turned(replace(measurements, interpolation=found.interpolation), asked, otherwise.gains)
        found = with_laws(search(other), other, wanted, workers=workers, progress=progress)
        found = replace(found, warnings=(*found.warnings, *other.notes[len(measurements.notes) :]))
    proposals = cast(tuple[LawProposal, ...], found.laws)
    return found if folder is None else replace(found, laws=tuple(write_files(p, folder / FOLDER) for p in proposals))
