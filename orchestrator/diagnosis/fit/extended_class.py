"""A Modelica class with effects: a new class that extends it, with classes of effects in its slots."""

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path

from fmus.catalogue import ModelicaModel
from fmus.errors import MisfitError
from fmus.frontend.compile import fingerprint
from fmus.frontend.together import compile_together
from fmus.symbolic.system import SymbolicSystem
from orchestrator.blackbox.of_class import class_model
from orchestrator.diagnosis.fit.thresholds import KEPT
from orchestrator.library.cards import Candidate, EffectCard
from orchestrator.library.user_cards import check_absence, check_class, check_slots
from orchestrator.models.patch import Attachment, check_attached, free_slots, patched_model
from orchestrator.models.symbolic import SymbolicModel


@dataclass(frozen=True)
class ExtensibleClass:
    """A Modelica class as something to be extended; see `Extensible`."""

    source: ModelicaModel
    runs_are_slow = False

    @property
    def identity(self) -> str:
        """The hash of its sources."""
        return fingerprint(self.source.class_name, self.source.file)

    def model(
        self, system: SymbolicSystem, signals: Sequence[str] | None = None, free: Sequence[str] = ()
    ) -> SymbolicModel:
        """Compiled equations, or the runs of an FMU where values are kept from event to event."""
        if system.remembers and not free:
            return class_model(self.source, signals=signals)
        return SymbolicModel(self.source.name, system, signals, free, self.source.held)

    def candidates(self, system: SymbolicSystem, cards: Sequence[EffectCard]) -> tuple[list[Candidate], list[str]]:
        """Every card at every site of the slots that it fits, and ids of those that fit none."""
        slots = free_slots(system)
        found: list[Candidate] = []
        impossible: list[str] = []
        for card in cards:
            if card.class_file is not None:
                check_slots(card, self.source.name, slots)
            slot = next((s for s in card.slots if s in slots), None)
            if slot is None:
                impossible.append(card.id)
                continue
            placed = _at_all_sites(card, slot, system.settings.get(f"{slot}.n"))
            if card.class_file is not None:
                tried = self.extended(tuple(placed[:1]), ())
                check_class(card, slot, lambda tried=tried: tried.system)  # type: ignore[misc]
                check_absence(card, slot, system, tried.system)
            found += placed
        attached = {candidate.card.id for candidate in found}
        return found, [name for name in dict.fromkeys(impossible) if name not in attached]

    def extended(self, candidates: tuple[Candidate, ...], signals: tuple[str, ...]) -> "ExtendedClass":
        """The class with effects in its slots."""
        return ExtendedClass(self.source, candidates, signals)

    def compile_ahead(self, candidates: Sequence[Candidate], processes: int) -> None:
        """Compile what the cache lacks of the class with one effect; what cannot be compiled shows when it is needed.

        Elements of one effect share a class, variants of it may have another.
        """
        missing = list[tuple[str, Path]]()
        for candidate in {(c.slot, c.card.class_name): c for c in candidates}.values():
            with suppress(MisfitError):
                model = self.extended((candidate,), ()).written
                if model.file is not None and not model.is_compiled:
                    missing.append((model.class_name, model.file))
        compile_together(missing, processes)


class ExtendedClass:
    """A class with effects in its slots. The many sets of a diagnosis share few classes, which the process remembers."""

    def __init__(self, base: ModelicaModel, candidates: tuple[Candidate, ...], signals: tuple[str, ...]) -> None:
        self._base, self._candidates, self._signals = base, candidates, signals

    # Not a cached_property, whose lock lets one thread compile at a time.
    @property
    def system(self) -> SymbolicSystem:
        """The equations of the extended class."""
        return _extended(*self._key, self._contacts)

    def model(self, free: tuple[str, ...]) -> SymbolicModel:
        """The extended class as a model."""
        return _extended_model(*self._key, self._contacts, self._signals, free)

    @property
    def written(self) -> ModelicaModel:
        """The extended class in a file of its own.

        Raises:
            ModelicaError: if the base belongs to a package, which cannot be copied on its own.
        """
        base, _, name, parts = self._key
        return _written(base, name, parts)

    def fixed(self, values: Mapping[str, float], name: str) -> SymbolicModel:
        """A class `name` with given values of the effects' parameters."""
        written = patched_model(self._base, name, attachments(self._candidates, self.system, values))
        system = replace(written.compile(), contacts=self._contacts)
        return SymbolicModel(written.name, system, held=self._base.held)

    @property
    def _contacts(self) -> bool:
        """Whether an effect makes and breaks contact."""
        return any(c.card.contacts for c in self._candidates)

    @cached_property
    def _key(self) -> "_Key":
        """What the extended class depends on; the elements that a candidate stands for do not belong to it."""
        name = "Candidate_" + "_".join(card_id for card_id in dict.fromkeys(c.card.id for c in self._candidates))
        parts = tuple((slot, card.class_name, card.class_text) for slot, card in _filled(self._candidates))
        return self._base, fingerprint(self._base.class_name, self._base.file), name, parts


def attachments(
    candidates: Sequence[Candidate], system: SymbolicSystem, values: Mapping[str, float]
) -> list[Attachment]:
    """Effects with given values of some parameters, by full name, ready to be written; the others keep those of `system`.

    Args:
        candidates: the effects.
        system: the equations of the model with them.
        values: values of parameters, in their own units, by full name such as `jointTorque1.b[2]`.
    """
    all_parameters = {v.name: v.start or 0.0 for v in system.parameters}
    found = []
    for slot, card in _filled(candidates):
        own = next(c for c in candidates if c.slot == slot)
        settings: dict[str, Mapping[str, float]] = {}
        for parameter in own.card.parameters:
            names = elements(f"{slot}.{parameter.name}", all_parameters)
            settings[parameter.name] = {name: values.get(name, all_parameters[name]) for name in names}
        found.append(Attachment(slot, card.class_name, settings, card.class_text))
    return found


def elements(name: str, variables: Mapping[str, object]) -> list[str]:
    """Names of a parameter's elements: itself for a scalar, `name[1]`, `name[2]`, ... for an array."""
    pattern = re.compile(re.escape(name) + r"(\[[\d,]+\])?")
    return [candidate for candidate in variables if pattern.fullmatch(candidate)]


def _filled(candidates: Sequence[Candidate]) -> list[tuple[str, EffectCard]]:
    """The slots that are filled, each with a card of the class in it."""
    return list({(c.slot, c.card.class_name): (c.slot, c.card) for c in candidates}.values())


def _at_all_sites(card: EffectCard, slot: str, size: float | str | None) -> list[Candidate]:
    """Candidates of a card in a slot for `size` joints or muscles; a slot without a size is one site."""
    if size is None:
        return [Candidate(card, slot, "", card.site)]
    numbers = range(1, int(size) + 1)
    if card.elements == "pairs":
        pairs = [(i, j) for i in numbers for j in numbers if i != j]
        return [Candidate(card, slot, f"[{i},{j}]", card.site.format(i, j)) for i, j in pairs]
    if card.elements == "each":
        return [Candidate(card, slot, f"[{k}]", f"{card.site}{k}") for k in numbers]
    return [Candidate(card, slot, "", "+".join(f"{card.site}{k}" for k in numbers))]


# A model, the content of its sources, the name of its extension, and slot, class and text of each effect.
_Key = tuple[ModelicaModel, str, str, tuple[tuple[str, str, str], ...]]


@lru_cache(maxsize=KEPT)
def _extended(
    base: ModelicaModel, content: str, name: str, parts: tuple[tuple[str, str, str], ...], contacts: bool
) -> SymbolicSystem:
    system = _written(base, name, parts).compile()
    check_attached(system, _attachments(parts))
    return replace(system, contacts=contacts)


def _written(base: ModelicaModel, name: str, parts: Sequence[tuple[str, str, str]]) -> ModelicaModel:
    return patched_model(base, name, _attachments(parts))


def _attachments(parts: Sequence[tuple[str, str, str]]) -> list[Attachment]:
    return [Attachment(slot, class_name, {}, text) for slot, class_name, text in parts]


@lru_cache(maxsize=KEPT)
def _extended_model(
    base: ModelicaModel,
    content: str,
    name: str,
    parts: tuple[tuple[str, str, str], ...],
    contacts: bool,
    signals: tuple[str, ...],
    free: tuple[str, ...],
) -> SymbolicModel:
    return SymbolicModel(base.name, _extended(base, content, name, parts, contacts), signals, free, base.held)
