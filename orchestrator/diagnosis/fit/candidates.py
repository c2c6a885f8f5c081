"""Candidates: an effect card at a site of a given model, and sets of them as fitted models."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, lru_cache

import numpy as np

from fmus.catalogue import ModelicaModel
from fmus.frontend.compile import fingerprint
from fmus.symbolic.system import SymbolicSystem, Variable
from orchestrator.blackbox.source import FmuSource
from orchestrator.diagnosis.fit.thresholds import KEPT
from orchestrator.library.candidate import Candidate
from orchestrator.library.cards import CardParameter, EffectCard
from orchestrator.library.user_cards import check_absence, check_class, check_slots
from orchestrator.models.patch import Attachment, check_attached, free_slots, patched_model
from orchestrator.models.symbolic import SymbolicModel


def model_of(
    base: ModelicaModel, system: SymbolicSystem, signals: Sequence[str] | None = None, free: Sequence[str] = ()
) -> SymbolicModel:
    """The model of a system that was made from `base`: compiled equations, or runs of an FMU."""
    source = as_fmu(base)
    return SymbolicModel(base.name, system, signals, free) if source is None else source.model(system, signals, free)


def as_fmu(base: ModelicaModel) -> FmuSource | None:
    """The base as an FMU, None if it is a Modelica class."""
    return base if isinstance(base, FmuSource) else None


class EffectSet:
    """A set of candidates added to a model, as one compiled model with their parameters free."""

    def __init__(self, base: ModelicaModel, candidates: Sequence[Candidate], signals: Sequence[str]) -> None:
        self.base, self.candidates, self.signals = base, tuple(candidates), tuple(signals)

    @property
    def system(self) -> SymbolicSystem:
        """The equations of the extended model."""
        return self._of_fmu.system if as_fmu(self.base) is not None else _extended(*self._key, self.contacts)

    @property
    def model(self) -> SymbolicModel:
        """The extended model; its free parameters are those of the candidates, in their order."""
        if as_fmu(self.base) is not None:
            return self._of_fmu
        return _extended_model(*self._key, self.contacts, self.signals, tuple(v.name for v in self.variables))

    @property
    def contacts(self) -> bool:
        """Whether an effect of the set makes and breaks contact."""
        return any(c.card.contacts for c in self.candidates)

    @property
    def imperfect(self) -> float:
        """Share (rms) of what it explains that the set may leave, as the classes of its effects are not exactly their laws."""
        return max((c.card.imperfect for c in self.candidates), default=0.0)

    @property
    def written(self) -> ModelicaModel:
        """The extended class in a file of its own, not for an FMU.

        Raises:
            ModelicaError: if the base belongs to a package, which cannot be copied on its own.
        """
        base, _, name, parts = self._key
        return _written(base, name, parts)

    @cached_property
    def _of_fmu(self) -> SymbolicModel:
        source = as_fmu(self.base)
        assert source is not None
        system = source.coupled(source.mounted(self.candidates))
        return source.model(system, self.signals, [v.name for v in self._free_variables(system)])

    @cached_property
    def _key(self) -> "_Key":
        """What the extended class depends on; the elements that a candidate stands for do not belong to it."""
        name = "Candidate_" + "_".join(card_id for card_id in dict.fromkeys(c.card.id for c in self.candidates))
        parts = tuple((slot, card.class_name, card.class_text) for slot, card in self._slots())
        return self.base, fingerprint(self.base.class_name, self.base.file), name, parts

    @cached_property
    def variables(self) -> tuple[Variable, ...]:
        """The free parameters, with units and bounds, in the order of the model."""
        return tuple(self._free_variables(self.system))

    @cached_property
    def card_parameters(self) -> tuple[CardParameter, ...]:
        """The card's entry of each free parameter."""
        return tuple(parameter for parameter, _ in self._free(self.system))

    def fixed(self, values: np.ndarray, name: str) -> SymbolicModel:
        """The model with given values of the free parameters, as it would be written: a class `name`, or the FMU coupled."""
        source = as_fmu(self.base)
        if source is None:
            extended = patched_model(self.base, name, self.attachments(values))
            return SymbolicModel(extended.name, replace(extended.compile(), contacts=self.contacts))
        by_name = dict(zip([v.name for v in self.variables], map(float, values), strict=True))
        changed = tuple(replace(v, start=by_name.get(v.name, v.start)) for v in self.system.parameters)
        return source.model(replace(self.system, parameters=changed))

    def first_guess(self) -> np.ndarray:
        """Start values of the free parameters, from the cards."""
        return np.array([parameter.start for parameter in self.card_parameters])

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Bounds of the free parameters, from the Modelica classes and, where these leave room for it, from a record."""
        low = np.array([-np.inf if v.minimum is None else v.minimum for v in self.variables])
        high = np.array([np.inf if v.maximum is None else v.maximum for v in self.variables])
        least = np.maximum(low, [p.low for p in self.card_parameters])
        most = np.minimum(high, [p.high for p in self.card_parameters])
        room = least < most
        return np.where(room, least, low), np.where(room, most, high)

    def owners(self) -> tuple[int, ...]:
        """Position of the candidate that each free parameter belongs to."""
        return tuple(k for k, c in enumerate(self.candidates) for _ in self._free_of(c, self.system))

    def attachments(self, values: Iterable[float]) -> list[Attachment]:
        """The effects with given values of the free parameters, ready to be written as a class."""
        by_name = dict(zip([v.name for v in self.variables], values, strict=True))
        all_parameters = {v.name: v.start or 0.0 for v in self.system.parameters}
        found = []
        for slot, card in self._slots():
            own = [c for c in self.candidates if c.slot == slot]
            settings: dict[str, Mapping[str, float]] = {}
            for parameter in own[0].card.parameters:
                elements = _elements(f"{slot}.{parameter.name}", all_parameters)
                settings[parameter.name] = {name: by_name.get(name, all_parameters[name]) for name in elements}
            found.append(Attachment(slot, card.class_name, settings, card.class_text))
        return found

    def _slots(self) -> list[tuple[str, EffectCard]]:
        """The slots that are filled, each with a card of the class in it."""
        return list({(c.slot, c.card.class_name): (c.slot, c.card) for c in self.candidates}.values())

    def _free(self, system: SymbolicSystem) -> list[tuple[CardParameter, Variable]]:
        return [pair for candidate in self.candidates for pair in self._free_of(candidate, system)]

    def _free_variables(self, system: SymbolicSystem) -> list[Variable]:
        return [variable for _, variable in self._free(system)]

    @staticmethod
    def _free_of(candidate: Candidate, system: SymbolicSystem) -> list[tuple[CardParameter, Variable]]:
        variables = {v.name: v for v in system.parameters}
        found = []
        for parameter in candidate.card.parameters:
            names = _elements(f"{candidate.slot}.{parameter.name}", variables)
            names = [name for name in names if name.endswith(candidate.element)]
            found += [(parameter, variables[name]) for name in names]
        return found


# A model, the content of its sources, the name of its extension, and slot, class and text of each effect.
_Key = tuple[ModelicaModel, str, str, tuple[tuple[str, str, str], ...]]


# The many sets of a diagnosis share few classes. Not a cached_property, whose lock lets one thread compile at a time.
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
    return model_of(base, _extended(base, content, name, parts, contacts), signals, free)


def find_candidates(
    base: ModelicaModel, system: SymbolicSystem, cards: Sequence[EffectCard]
) -> tuple[list[Candidate], list[str]]:
    """Return every effect at every site of a model where it can be attached, and ids that cannot be (FMU: with reasons).

    Raises:
        MisfitError: if a card of the user's own does not fit its class or the model.
    """
    source = as_fmu(base)
    if source is not None:
        own = [
            f"{card.id} is not tried: {card.card_file} needs equations, and an FMU's are closed"
            for card in cards
            if card.class_file
        ]
        return source.candidates(), [*source.refusals(), *own]
    slots = free_slots(system)
    found: list[Candidate] = []
    impossible: list[str] = []
    for card in cards:
        if card.class_file is not None:
            check_slots(card, base.name, slots)
        slot = next((s for s in card.slots if s in slots), None)
        if slot is None:
            impossible.append(card.id)
            continue
        placed = _at_all_sites(card, slot, system.settings.get(f"{slot}.n"))
        if card.class_file is not None:
            tried = EffectSet(base, placed[:1], system.outputs)
            check_class(card, slot, lambda tried=tried: tried.system)  # type: ignore[misc]
            check_absence(card, slot, system, tried.system)
        found += placed
    attached = {candidate.card.id for candidate in found}
    return found, [name for name in dict.fromkeys(impossible) if name not in attached]


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


def can_join(candidates: Sequence[Candidate], other: Candidate, slots: Sequence[str]) -> Candidate | None:
    """Return `other` placed so that it can stand beside `candidates`: in their slot or in a free one, else None."""
    for mate in candidates:
        if mate.card.id == other.card.id:
            if not other.element or mate.element == other.element or mate.card.class_name != other.card.class_name:
                return None
            return Candidate(other.card, mate.slot, other.element, other.site)
    taken = {mate.slot for mate in candidates}
    slot = next((s for s in other.card.slots if s in slots and s not in taken), None)
    return None if slot is None else Candidate(other.card, slot, other.element, other.site)


def _elements(name: str, variables: Mapping[str, object]) -> list[str]:
    """Names of a parameter's elements: itself for a scalar, `name[1]`, `name[2]`, ... for an array."""
    pattern = re.compile(re.escape(name) + r"(\[[\d,]+\])?")
    return [candidate for candidate in variables if pattern.fullmatch(candidate)]
