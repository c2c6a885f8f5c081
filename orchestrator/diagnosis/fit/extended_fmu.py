"""An FMU with effects: laws coupled to its inputs and outputs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from fmus.symbolic.system import SymbolicSystem
from orchestrator.blackbox.source import FmuSource
from orchestrator.library.cards import Candidate, EffectCard
from orchestrator.models.symbolic import SymbolicModel


@dataclass(frozen=True)
class ExtensibleFmu:
    """An FMU as something to be extended; see `Extensible`."""

    source: FmuSource
    runs_are_slow = True

    @property
    def identity(self) -> str:
        """Its file's hash, its sites and what it holds."""
        return repr(self.source)

    def model(
        self, system: SymbolicSystem, signals: Sequence[str] | None = None, free: Sequence[str] = ()
    ) -> SymbolicModel:
        """Runs of the FMU within a coupled system."""
        return self.source.model(system, signals, free)

    def candidates(self, system: SymbolicSystem, cards: Sequence[EffectCard]) -> tuple[list[Candidate], list[str]]:
        """Every law at every site of the FMU; classes of the user's own need equations, which an FMU does not show."""
        own = [
            f"{card.id} is not tried: {card.card_file} needs equations, and an FMU's are closed"
            for card in cards
            if card.class_file
        ]
        return self.source.candidates(), [*self.source.refusals(), *own]

    def extended(self, candidates: tuple[Candidate, ...], signals: tuple[str, ...]) -> "ExtendedFmu":
        """The FMU with laws around it."""
        return ExtendedFmu(self.source, candidates, signals)

    def compile_ahead(self, candidates: Sequence[Candidate], processes: int) -> None:
        """Nothing is compiled for an FMU."""


class ExtendedFmu:
    """An FMU with laws around it; one model is kept, since building one starts a process."""

    def __init__(self, source: FmuSource, candidates: tuple[Candidate, ...], signals: tuple[str, ...]) -> None:
        self._source, self._candidates, self._signals = source, candidates, signals
        self._models: dict[tuple[str, ...], SymbolicModel] = {}

    @cached_property
    def system(self) -> SymbolicSystem:
        """The coupled system."""
        return self._source.coupled(self._source.mounted(self._candidates))

    def model(self, free: tuple[str, ...]) -> SymbolicModel:
        """The coupled system as a model."""
        if free not in self._models:
            self._models[free] = self._source.model(self.system, self._signals, free)
        return self._models[free]

    def fixed(self, values: Mapping[str, float], name: str) -> SymbolicModel:
        """The coupled system with given values of the laws' parameters."""
        changed = tuple(replace(v, start=values.get(v.name, v.start)) for v in self.system.parameters)
        return self._source.model(replace(self.system, parameters=changed))
