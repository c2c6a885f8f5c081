"""Sets that regression proposes about a fitted one, with more beside it or anew, from one run of the filter with all slopes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from orchestrator.greybox.candidates import Candidate
from orchestrator.greybox.screen import Normal, Screened, best_subsets

Sets = list[tuple[Candidate, ...]]


@dataclass(frozen=True, eq=False)
class Proposals:
    """Normal equations about a fitted set in the gains of its `members`, which come first, and of all that can join them.

    `columns` say to whom each gain belongs, `theta` what it is in the fit, `signs` on which side of zero it has to be and `spread` its
    prior's standard deviation.
    """

    members: tuple[Candidate, ...]
    normal: Normal
    columns: tuple[Candidate, ...]
    theta: np.ndarray
    signs: tuple[int, ...]
    spread: tuple[float, ...]
    hopeless: float

    def more(self, largest: int) -> Sets:
        """The set with up to so many others beside it."""
        found = self._subsets(self.normal, self.members, largest)
        # About none of them, one law that acts in a share is much like another: such laws come one after the other.
        likely = [each for each in found if each.score > -self.hopeless and _in_shares(each.candidates) <= 1]
        return [(*self.members, *each.candidates) for each in likely]

    def anew(self, largest: int) -> Sets:
        """Sets of up to so many that need not hold any member."""
        return [each.candidates for each in self._subsets(self.normal.from_zero(self.theta), (), largest)]

    def _subsets(self, normal: Normal, members: Sequence[Candidate], largest: int) -> list[Screened]:
        kept = [k for k, own in enumerate(self.columns) if any(own is c for c in members)]
        return best_subsets(normal, list(zip(self.columns, self.signs, strict=True)), kept, largest, self.spread)


def _in_shares(candidates: Sequence[Candidate]) -> int:
    """Number of laws that act in some share."""
    return sum(bool(c.shares) for c in candidates)
