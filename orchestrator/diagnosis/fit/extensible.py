"""What the diagnosis asks of a source of models: its candidates, and its extension by some of them.

A Modelica class is extended by a new class, an FMU by what stands before and behind it. Nobody else asks which of both it is.
"""

from collections.abc import Mapping, Sequence
from typing import Protocol

from fmus.symbolic.system import SymbolicSystem
from orchestrator.blackbox.source import FmuSource, Source
from orchestrator.diagnosis.fit.extended_class import ExtensibleClass
from orchestrator.diagnosis.fit.extended_fmu import ExtensibleFmu
from orchestrator.library.cards import Candidate, EffectCard
from orchestrator.models.symbolic import SymbolicModel


class Extension(Protocol):
    """A source with some candidates in it."""

    @property
    def system(self) -> SymbolicSystem:
        """The equations."""
        ...

    def model(self, free: tuple[str, ...]) -> SymbolicModel:
        """The model whose parameters `free`, by full name, are to be fitted."""
        ...

    def fixed(self, values: Mapping[str, float], name: str) -> SymbolicModel:
        """The model with given values of its parameters, as it would be written under this name."""
        ...


class Extensible(Protocol):
    """A source that can be extended with effects."""

    @property
    def runs_are_slow(self) -> bool:
        """Whether what asks for runs with each of many effects is better left out."""
        ...

    @property
    def identity(self) -> str:
        """A text that differs where the content does, in every process the same."""
        ...

    def model(
        self, system: SymbolicSystem, signals: Sequence[str] | None = None, free: Sequence[str] = ()
    ) -> SymbolicModel:
        """The model of a system that was made from this source: compiled equations, or runs of an FMU.

        Args:
            system: the equations.
            signals: names of the outputs that it shows; all by default.
            free: names of the parameters that are to be fitted.
        """
        ...

    def candidates(self, system: SymbolicSystem, cards: Sequence[EffectCard]) -> tuple[list[Candidate], list[str]]:
        """Every effect at every site where it can be attached, and ids that cannot be, of an FMU with reasons.

        Raises:
            MisfitError: if a card of the user's own does not fit its class or the model.
        """
        ...

    def extended(self, candidates: tuple[Candidate, ...], signals: tuple[str, ...]) -> Extension:
        """The source with candidates, whose model shows the outputs `signals`."""
        ...

    def compile_ahead(self, candidates: Sequence[Candidate], processes: int) -> None:
        """Prepare the source with each candidate before they are asked for one by one."""
        ...


def extensible(source: Source) -> Extensible:
    """Return the ways of a source to be extended."""
    return ExtensibleFmu(source) if isinstance(source, FmuSource) else ExtensibleClass(source)


def model_of(
    source: Source, system: SymbolicSystem, signals: Sequence[str] | None = None, free: Sequence[str] = ()
) -> SymbolicModel:
    """Return the model of a system that was made from a source: compiled equations, or runs of an FMU.

    Args:
        signals: names of the outputs that it shows; all by default.
        free: names of the parameters that are to be fitted.
    """
    return extensible(source).model(system, signals, free)


def find_candidates(
    source: Source, system: SymbolicSystem, cards: Sequence[EffectCard]
) -> tuple[list[Candidate], list[str]]:
    """Return every effect at every site of a source where it can be attached, and ids that cannot be (FMU: with reasons).

    Args:
        system: the source's own equations.
        cards: the effects known.

    Raises:
        MisfitError: if a card of the user's own does not fit its class or the model.
    """
    return extensible(source).candidates(system, cards)
