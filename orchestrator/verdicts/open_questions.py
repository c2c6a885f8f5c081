"""What a diagnosis leaves open: missing excitation, effects that act alike, parameters that the data do not show."""

from dataclasses import asdict, dataclass
from typing import Any, Literal

from orchestrator.library.cards import Candidate

# Cosines between what two effects do: above the first data hardly see a difference, above the second a weak one.
SAME, WEAK = 0.98, 0.9


@dataclass(frozen=True)
class Coverage:
    """What one effect at one site needs (`words`), how many of it there must be, and how many there are."""

    effect: str
    site: str
    words: str
    wanted: float
    found: float

    @property
    def is_enough(self) -> bool:
        """Whether the record has it."""
        return self.found >= self.wanted

    def to_json(self) -> dict[str, Any]:
        """Plain values."""
        return {
            "effect": self.effect,
            "site": self.site,
            "needs": self.words,
            "wanted": self.wanted,
            "found": self.found,
            "enough": self.is_enough,
        }

    @property
    def message(self) -> str:
        """The shortage as a sentence."""
        return f"{self.effect} at {self.site} needs {self.words}; these data have {self.found:.3g}"


Kind = Literal["dead", "flat", "trade-off", "not pinned", "at bound", "curved", "excitation"]


@dataclass(frozen=True)
class Doubt:
    """Something that the data leave open about `parameters` (names with their effects), as a sentence."""

    kind: Kind
    parameters: tuple[str, ...]
    message: str

    def to_json(self) -> dict[str, Any]:
        """Plain values."""
        return {**asdict(self), "parameters": list(self.parameters)}


@dataclass(frozen=True)
class CollinearPair:
    """An effect of the best set, another that acts like it, the cosine between them, and the odds of the first."""

    effect: Candidate
    other: Candidate
    cosine: float
    odds: float

    @property
    def relation(self) -> Literal["same class", "weakly separable"]:
        """How far the data tell them apart."""
        return "same class" if self.cosine > SAME else "weakly separable"

    def to_json(self) -> dict[str, Any]:
        """Plain values."""
        return {
            "effect": self.effect.card.id,
            "site": self.effect.site,
            "other": self.other.card.id,
            "other_site": self.other.site,
            "cosine": self.cosine,
            "relation": self.relation,
            "odds": self.odds,
        }
