"""Candidates: an effect card at a site of a given model, and sets of them as fitted models."""

from collections.abc import Iterable, Sequence
from functools import cached_property

import numpy as np

from fmus.symbolic.system import SymbolicSystem, Variable
from orchestrator.blackbox.source import Source
from orchestrator.diagnosis.fit.extended_class import attachments, elements
from orchestrator.diagnosis.fit.extensible import extensible
from orchestrator.library.cards import Candidate, CardParameter
from orchestrator.models.patch import Attachment
from orchestrator.models.symbolic import SymbolicModel


class EffectSet:
    """A set of candidates added to a model, as one compiled model with their parameters free."""

    def __init__(self, base: Source, candidates: Sequence[Candidate], signals: Sequence[str]) -> None:
        self.base, self.candidates, self.signals = base, tuple(candidates), tuple(signals)
        self._extension = extensible(base).extended(self.candidates, self.signals)

    @property
    def system(self) -> SymbolicSystem:
        """The equations of the extended model."""
        return self._extension.system

    @property
    def model(self) -> SymbolicModel:
        """The extended model; its free parameters are those of the candidates, in their order."""
        return self._extension.model(tuple(v.name for v in self.variables))

    @property
    def contacts(self) -> bool:
        """Whether an effect of the set makes and breaks contact."""
        return any(c.card.contacts for c in self.candidates)

    @property
    def imperfect(self) -> float:
        """Share (rms) of what it explains that the set may leave, as the classes of its effects are not exactly their laws."""
        return max((c.card.imperfect for c in self.candidates), default=0.0)

    @cached_property
    def variables(self) -> tuple[Variable, ...]:
        """The free parameters, with units and bounds, in the order of the model."""
        return tuple(variable for _, variable in self._free)

    @cached_property
    def card_parameters(self) -> tuple[CardParameter, ...]:
        """The card's entry of each free parameter."""
        return tuple(parameter for parameter, _ in self._free)

    def fixed(self, values: np.ndarray, name: str) -> SymbolicModel:
        """The model with given values of the free parameters, as it would be written: a class `name`, or the FMU coupled."""
        by_name = dict(zip([v.name for v in self.variables], map(float, values), strict=True))
        return self._extension.fixed(by_name, name)

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
        return attachments(self.candidates, self.system, by_name)

    @cached_property
    def _free(self) -> list[tuple[CardParameter, Variable]]:
        return [pair for candidate in self.candidates for pair in self._free_of(candidate, self.system)]

    @staticmethod
    def _free_of(candidate: Candidate, system: SymbolicSystem) -> list[tuple[CardParameter, Variable]]:
        variables = {v.name: v for v in system.parameters}
        found = []
        for parameter in candidate.card.parameters:
            names = elements(f"{candidate.slot}.{parameter.name}", variables)
            names = [name for name in names if name.endswith(candidate.element)]
            found += [(parameter, variables[name]) for name in names]
        return found


def can_join(candidates: Sequence[Candidate], other: Candidate, slots: Sequence[str]) -> Candidate | None:
    """Return `other` placed so that it can stand beside `candidates`: in their slot or in a free one, else None.

    Args:
        candidates: effects that are in a model.
        other: the effect to be added.
        slots: the free slots of the model without effects.
    """
    mates = [mate for mate in candidates if (mate.card.id, mate.card.variant) == (other.card.id, other.card.variant)]
    if any(not other.element or mate.element == other.element for mate in mates):
        return None
    if mates:
        return Candidate(other.card, mates[0].slot, other.element, other.site)
    taken = {mate.slot for mate in candidates}
    slot = next((s for s in other.card.slots if s in slots and s not in taken), None)
    return None if slot is None else Candidate(other.card, slot, other.element, other.site)
