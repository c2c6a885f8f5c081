"""Add effects to a model: a new Modelica class that extends it, and its FMU; the original stays as it is."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import cast

import numpy as np

from fmus.catalogue import ModelicaModel
from fmus.errors import MisfitError
from fmus.package import build_fmu
from fmus.reference_files import reference_files
from orchestrator.blackbox.of_class import class_model
from orchestrator.blackbox.source import FmuSource, Source
from orchestrator.blackbox.system_file import write_system
from orchestrator.diagnosis.fit.candidates import EffectSet, can_join
from orchestrator.diagnosis.fit.extensible import find_candidates
from orchestrator.diagnosis.referee.adjusted import with_neighbours
from orchestrator.greybox.laws import Law
from orchestrator.library.cards import Candidate, EffectCard, effect_library
from orchestrator.models.patch import check_adjusted, check_attached, free_slots, patched_model, patched_source
from orchestrator.models.symbolic import SymbolicModel
from orchestrator.verdicts.result import Adjusted, Estimate, NamedEffect


@dataclass(frozen=True)
class Version:
    """A model extended with effects: its source, its model, and the file to use: an FMU, or a system of FMUs."""

    source: Source
    model: SymbolicModel
    file: Path

    @property
    def files(self) -> list[Path]:
        """The file to use, after the Modelica class that it was built from, if there is one."""
        of_class = isinstance(self.source, ModelicaModel) and self.source.file is not None
        return [cast(Path, self.source.file), self.file] if of_class else [self.file]


def add_effects(
    base: Source,
    effects: Sequence[NamedEffect],
    folder: Path,
    cards: Sequence[EffectCard] | None = None,
    adjusted: Sequence[Adjusted] = (),
    laws: Sequence[Law] = (),
) -> Version:
    """Write `NAME.mo` and `NAME.fmu` to a folder, with NAME the base's name and the next free number; of an FMU a system.

    The same effects with the same values give the same name again.

    Args:
        base: the model to extend; it stays as it is.
        effects: ids, sites and values in SI units, as a diagnosis names them.
        folder: where the files go.
        cards: the effects known, by default the shipped ones.
        adjusted: parameters of the base that get the values that were fitted within their tolerances.
        laws: formulas of the user's own.

    Returns:
        The extended model, and the file to use.

    Raises:
        MisfitError: if an effect is unknown or the model has no slot for it.
    """
    library = effect_library() if cards is None else cards
    if isinstance(base, FmuSource):
        return _around(base, effects, folder, library)
    if _at_equations(base, effects, library, laws):
        return _written_back(base, effects, folder, laws)
    return _built(base, extended_class(base, effects, library, adjusted, folder), folder)


def extended_class(
    base: ModelicaModel,
    effects: Sequence[NamedEffect],
    cards: Sequence[EffectCard],
    adjusted: Sequence[Adjusted] = (),
    folder: Path | None = None,
) -> ModelicaModel:
    """A class that extends a model with effects in its slots, written to a folder, by default in the cache.

    Arguments and errors are those of `add_effects`.
    """
    effect_set, values = _placed(base, effects, cards)
    attachments = effect_set.attachments(values)
    changed = with_neighbours(base.compile(), adjusted)
    comment = f"{base.class_name} with {', '.join(effect.id for effect in effects) or 'its parameters fitted'}"
    if adjusted:
        comment += f"; adjusted within tolerances: {', '.join(map(str, adjusted))}"
    name = f"{base.class_name.rsplit('.', 1)[-1]}_{len(effects)}"
    if folder is not None:
        name = _free_name(base, folder, lambda n: patched_source(base, n, attachments, comment, changed))
    source = patched_model(base, name, attachments, adjusted=changed, comment=comment, folder=folder)
    system = source.compile()
    check_attached(system, attachments)
    check_adjusted(system, changed)
    return source


def _at_equations(
    base: ModelicaModel, effects: Sequence[NamedEffect], cards: Sequence[EffectCard], laws: Sequence[Law]
) -> bool:
    """Whether effects belong into a model's own equations: it has no slots, or none for some of them."""
    from orchestrator.greybox.effects import knows

    system = base.compile()
    if not free_slots(system):
        return True
    wanted = {effect.id for effect in effects}
    found, _ = find_candidates(base, system, [card for card in cards if card.id in wanted])
    in_slots = {(candidate.card.id, candidate.site) for candidate in found}
    return any((e.id, e.site) not in in_slots for e in effects) and all(knows(e, base, laws) for e in effects)


def _written_back(
    base: ModelicaModel, effects: Sequence[NamedEffect], folder: Path, laws: Sequence[Law] = ()
) -> Version:
    """The version of a model without slots: its class with the balance equations changed."""
    from orchestrator.greybox.effects import with_effects

    name = _free_name(base, folder, lambda n: _text(with_effects(base, effects, n, more=laws)))
    return _built(base, with_effects(base, effects, name, folder, laws), folder)


def _text(source: ModelicaModel) -> str:
    assert source.file is not None
    return source.file.read_text()


def _built(base: ModelicaModel, source: ModelicaModel, folder: Path) -> Version:
    """The FMU of a class that was written to the folder."""
    system = source.compile()
    assert source.file is not None
    file = build_fmu(
        system,
        folder / f"{source.name}.fmu",
        stop_time=base.stop_time_s,
        step_size=base.step_size_s,
        extra_files={
            f"resources/{source.name}.mo": source.file.read_bytes(),
            **reference_files(system, base.stop_time_s, base.step_size_s),
        },
    )
    return Version(source, class_model(source), file)


def _around(base: FmuSource, effects: Sequence[NamedEffect], folder: Path, cards: Sequence[EffectCard]) -> Version:
    """The version of a black-box FMU: `STEM_N.toml`, N the number of effects, with the FMUs that it connects."""
    from orchestrator.greybox.fmu_system import knows

    if knows(base, effects):
        return _system_of_laws(base, effects, folder)
    effect_set, values = _placed(base, effects, cards)
    name = f"{base.class_name}_{len(effects)}"
    comment = f"{base.class_name} with {', '.join(f'{effect.id} at {effect.site}' for effect in effects)}"
    by_name = dict(zip([v.name for v in effect_set.variables], values, strict=True))
    file = write_system(base, base.mounted(effect_set.candidates), by_name, folder, name, comment)
    model = effect_set.fixed(np.array(values), name)
    return Version(replace(base, name=name), model, file)


def _system_of_laws(base: FmuSource, effects: Sequence[NamedEffect], folder: Path) -> Version:
    """The version of an FMU whose effects were found by the grey box: `STEM_N.toml`, with the FMUs that it connects."""
    from orchestrator.greybox.fmu_system import version_model, write_fmu_system

    name = f"{base.class_name}_{len(effects)}"
    file = write_fmu_system(base, effects, folder, name)
    return Version(replace(base, name=name), version_model(base, effects, base.compile().outputs), file)


def default_effect(base: Source, effect_id: str, cards: Sequence[EffectCard] | None = None) -> NamedEffect:
    """Return an effect of the library (or of `cards`) at its first site in a model, with the card's start values.

    Args:
        base: the model that has the site.
        effect_id: of the card, such as `viscous_friction`.
        cards: the effects known, by default the shipped ones.

    Raises:
        MisfitError: if the id is unknown or the model has no slot for it.
    """
    cards = effect_library() if cards is None else cards
    known = {card.id for card in cards}
    if effect_id not in known:
        raise MisfitError(f"there is no effect '{effect_id}'; the library has {', '.join(sorted(known))}")
    found, _ = find_candidates(base, base.compile(), [card for card in cards if card.id == effect_id])
    candidate = next((c for c in found if c.card.id == effect_id), None)
    if candidate is None:
        raise MisfitError(f"{base.name} has no free slot for {effect_id}")
    effects = EffectSet(base, [candidate], base.compile().outputs)
    parameters = {
        v.name.removeprefix(f"{candidate.slot}."): Estimate(float(value), v.unit, (float(value), float(value)))
        for v, value in zip(effects.variables, effects.first_guess(), strict=True)
    }
    return NamedEffect(effect_id, candidate.site, parameters, candidate.card.variant)


def _placed(base: Source, effects: Sequence[NamedEffect], cards: Sequence[EffectCard]) -> tuple[EffectSet, list[float]]:
    """The effects at their sites, and the values of their parameters."""
    effect_set = EffectSet(base, _place(base, effects, cards), base.compile().outputs)
    return effect_set, _values(effect_set, effects)


def _place(base: Source, effects: Sequence[NamedEffect], cards: Sequence[EffectCard]) -> list[Candidate]:
    system = base.compile()
    wanted = {effect.id for effect in effects}
    found, _ = find_candidates(base, system, [card for card in cards if card.id in wanted])
    # An FMU has effects of its own beside the library's.
    unknown = sorted(wanted - {card.id for card in cards} - {candidate.card.id for candidate in found})
    if unknown:
        raise MisfitError(
            f"there is no effect '{unknown[0]}'; if it is a card of your own, name its folder with --cards DIR"
        )
    chosen: list[Candidate] = []
    for effect in effects:
        # Without a variant, as in results that did not write it yet, the first card of the id.
        match = next((c for c in found if _is(c, effect)), None)
        placed = None if match is None else can_join(chosen, match, free_slots(system))
        if placed is None:
            raise MisfitError(
                f"{effect.id} at {effect.site} cannot be added to {base.name}: it has no free slot for it"
            )
        chosen.append(placed)
    return chosen


def _is(candidate: Candidate, effect: NamedEffect) -> bool:
    same = (candidate.card.id, candidate.site) == (effect.id, effect.site)
    return same and effect.variant in ("", candidate.card.variant)


def _values(effects: EffectSet, named: Sequence[NamedEffect]) -> list[float]:
    values = []
    for owner, variable in zip(effects.owners(), effects.variables, strict=True):
        name = variable.name.removeprefix(f"{effects.candidates[owner].slot}.")
        if name not in named[owner].parameters:
            raise MisfitError(f"{named[owner].id} lacks the parameter {name}")
        values.append(named[owner].parameters[name].value)
    return values


def _free_name(base: ModelicaModel, folder: Path, text_of: Callable[[str], str]) -> str:
    short = base.class_name.rsplit(".", 1)[-1]
    number = 1
    while True:
        name = f"{short}_{number}"
        file = folder / f"{name}.mo"
        if not file.exists() or file.read_text() == text_of(name):
            return name
        number += 1
