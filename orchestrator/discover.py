"""The main job: compare a model, learn which effect is missing, add it, compare again, and keep the ledger."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from importlib.metadata import version as package_version
from pathlib import Path
from typing import TYPE_CHECKING, cast

from fmus.errors import MisfitError
from fmus.files import write_atomically
from orchestrator import ledger
from orchestrator.blackbox.source import Source
from orchestrator.compare.comparison import compare
from orchestrator.compare.result import Comparison
from orchestrator.diagnosis.fit.extensible import model_of
from orchestrator.diagnosis.search.search import Progress
from orchestrator.explain import explain
from orchestrator.greybox.laws import Law
from orchestrator.laws.proposal import LawProposal
from orchestrator.ledger import LedgerEntry
from orchestrator.library.cards import EffectCard, effect_library
from orchestrator.measurements import MeasurementSet
from orchestrator.models.symbolic import SymbolicModel
from orchestrator.verdicts.result import Diagnosis, NamedEffect
from orchestrator.versions import Version, add_effects
from orchestrator.work import Work

if TYPE_CHECKING:
    from orchestrator.shown import Shown


@dataclass(frozen=True)
class Discovery:
    """A diagnosis, the model versions made from it, and their ledger entries, the model as given first; `laws` are formulas
    proposed where no card fits."""

    diagnosis: Diagnosis
    versions: tuple[Version, ...]
    entries: tuple[LedgerEntry, ...]
    laws: tuple[LawProposal, ...] = ()

    def plot(self) -> "Shown":
        """The error of each version, for a notebook."""
        return self.diagnosis.plot() if len(self.entries) < 2 else ledger.Ledger(self.entries).plot()

    def _repr_html_(self) -> str:
        return self.diagnosis._repr_html_() + ledger.Ledger(self.entries)._repr_html_()


def discover(
    source: Source,
    measurements: MeasurementSet,
    folder: Path,
    *,
    cards: Sequence[EffectCard] | None = None,
    workers: int = 2,
    progress: Progress = lambda message: None,
    work: Work | None = None,
    laws: bool | None = None,
    own_laws: Sequence[Law] = (),
) -> Discovery:
    """Diagnose a model, add the named effects one after another, and record every version in the folder's ledger.

    Forces that no effect explains are written to the folder as drafts of effect cards, the inputs of the next experiment as
    `next_experiment.csv`.

    Args:
        source: the model to begin with.
        measurements: learning and held-out trials.
        folder: where versions, ledger and drafts go.
        cards: the effects to choose from, by default the shipped ones.
        workers: fits that run at a time.
        progress: called with one line at each stage.
        work: who screens and fits, by default this process.
        laws: whether formulas are looked for and their cards written; None for only where the library leaves something open.
        own_laws: formulas of the user's own, beside the shipped ones.

    Returns:
        The diagnosis, the versions that were made from it, their entries in the ledger, and formulas where no card fits.

    Raises:
        MisfitError: for input that does not fit.
        ComponentError: if the model cannot be simulated.
    """
    cards = effect_library() if cards is None else cards
    diagnosis = explain(
        source, measurements, folder, laws, cards=cards, workers=workers, progress=progress, work=work, own=own_laws
    )
    measurements = replace(measurements, interpolation=diagnosis.interpolation)
    nominal = diagnosis.steps[0].comparison
    given = model_of(source, source.compile())
    entries = [record(folder, source.name, source, given, (), nominal, measurements)]
    versions = []
    for step in diagnosis.steps[1:]:
        added = " + ".join(effect.id for effect in step.effects) or "parameters fitted within their tolerances"
        progress(f"building the model with {added}")
        try:
            version = add_effects(source, step.effects, folder, cards, step.adjusted, own_laws)
        except MisfitError as error:
            note = f"no model with {added} was written: {error}"
            diagnosis = replace(diagnosis, warnings=(*diagnosis.warnings, note))
            continue
        again = compare(
            version.model,
            measurements,
            workers=workers,
            floor=nominal.noise_floor,
        )
        name = version.source.name
        adjusted = sorted(step.adjusted, key=lambda each: -abs(each.share))
        effects = step.effects or [each.as_effect() for each in adjusted]
        entries.append(record(folder, name, version.source, version.model, effects, again, measurements))
        versions.append(version)
    for number, curve in enumerate(diagnosis.latent_forces, start=1):
        write_atomically(folder / f"draft_{number}.toml", curve.draft_card(number).encode())
    if diagnosis.experiment_csv is not None:
        write_atomically(folder / "next_experiment.csv", diagnosis.experiment_csv.encode())
    if versions:
        diagnosis = replace(diagnosis, patched_model=str(versions[-1].file))
    return Discovery(diagnosis, tuple(versions), tuple(entries), cast(tuple[LawProposal, ...], diagnosis.laws))


def record(
    folder: Path,
    name: str,
    source: Source,
    model: SymbolicModel,
    effects: Sequence[NamedEffect],
    comparison: Comparison,
    measurements: MeasurementSet,
) -> LedgerEntry:
    """Append a version to the ledger; the same model along the same data keeps its number, with its present figures.

    Args:
        folder: that of the ledger.
        name: of the version.
        source: the model's class or FMU.
        model: the same, ready to run; its content tells versions apart.
        effects: all effects that it has beyond the model as given.
        comparison: its errors along the measurements.
        measurements: what it was compared with.

    Returns:
        The entry; the old one where nothing changed.
    """
    known = ledger.read(folder) if (folder / ledger.FILE_NAME).exists() else []
    model_hash = model.content_hash
    same = [old for old in known if (old.model_hash, old.data_hash) == (model_hash, measurements.content_hash)]
    entry = LedgerEntry(
        version=same[0].version if same else len(known),
        name=name,
        model=name if source.file is None else f"{source.file}:{source.class_name}",
        effects=tuple(effects),
        learning=comparison.learning,
        held_out=comparison.held_out,
        noise_floor=comparison.noise_floor,
        units=comparison.units,
        model_hash=model_hash,
        data_hash=measurements.content_hash,
        date=datetime.now(UTC).isoformat(timespec="seconds"),
        misfit_version=package_version("misfit-fmu"),
    )
    if same and same[0] == replace(entry, date=same[0].date, misfit_version=same[0].misfit_version):
        return same[0]
    ledger.append(folder, entry)
    return entry
