"""An effect at a site of a model: what a search tries."""

from dataclasses import dataclass

from orchestrator.library.cards import EffectCard


@dataclass(frozen=True)
class Candidate:
    """An effect at a site: `element` is its subscript in the parameter arrays (`[3]`), empty for all together."""

    card: EffectCard
    slot: str
    element: str
    site: str

    @property
    def label(self) -> str:
        """Short name for progress and messages."""
        return f"{self.card.id} {self.card.variant}".rstrip() + f" at {self.site}"
