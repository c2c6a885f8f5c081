"""The verdict and its figures, as pure functions."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from orchestrator.diagnosis.decide.thresholds import EXCESS, LEFT, LEFT_HELD_OUT, LEFT_UNDECLARED
from orchestrator.diagnosis.linear.thresholds import SCATTER
from orchestrator.verdicts.result import Verdict


@dataclass(frozen=True)
class Left:
    """What a set of effects leaves of all trials, in the metric, where noise has the mean square `noise`.

    `learning` and `held_out` are mean squares (before, after) and numbers of rows; `structured` tells whether the
    effects of the library or flexible forces explain more of the learning trials than noise would let them; `within` is
    by how much the learning errors of a right set may exceed `noise` if that is read from the same rows, which scatter
    together; `imperfect` is the share that its effects leave though they are there.
    """

    learning: tuple[float, float, int]
    held_out: tuple[float, float, int]
    noise: float
    structured: bool
    declared: bool = True
    within: float = math.inf
    imperfect: float = 0.0

    @property
    def share(self) -> float:
        """Share of the rms above the noise that is left.

        >>> many = 10**6
        >>> round(Left((101.0, 2.0, 3 * many), (101.0, 2.0, many), 1.0, False).share, 2)
        0.1
        """
        before = sum(max(part[0] - self.noise, 0.0) * part[2] for part in (self.learning, self.held_out))
        after = self._above_noise(*self.learning[1:], self.within) * self.learning[2]
        after += self._above_noise(*self.held_out[1:]) * self.held_out[2]
        return float((after / max(before, 1e-9)) ** 0.5)

    def _above_noise(self, mean_square: float, rows: int, within: float = math.inf) -> float:
        """Part of a mean square that noise does not account for."""
        return max(mean_square - self.noise - min(self.noise * SCATTER * (2.0 / rows) ** 0.5, within), 0.0)

    @property
    def exceeds(self) -> bool:
        """Whether held-out errors are larger than the noise lets them be."""
        return self.held_out[1] > EXCESS * self.noise

    @property
    def shows_held_out_only(self) -> bool:
        """Whether held-out errors are larger than the noise, and than whatever the learning trials are off by."""
        return self.held_out[1] > EXCESS * max(self.noise, self.learning[1])

    @property
    def is_another(self) -> bool:
        """Whether what is left is more than noise, and too much to be the imperfection of the right set.

        >>> shown, hidden = (Left((1e4, 10.0, 6000), (1e4, 10.0, 3000), 1.0, each) for each in (True, False))
        >>> round(shown.share, 2), shown.is_another, hidden.is_another
        (0.03, True, False)
        """
        most = max(LEFT if self.structured else LEFT_HELD_OUT, self.imperfect)
        return (self.structured or self.exceeds) and self.share > (most if self.declared else LEFT_UNDECLARED)


def decide(
    named: int,
    left: Left,
    *,
    ambiguous: bool = False,
    blind: Sequence[str] = (),
    missing: Sequence[str] = (),
    disguised: bool = False,
) -> Verdict:
    """Decide on a verdict.

    Args:
        named: number of effects accepted.
        left: what they leave, or what the model as given does.
        ambiguous: whether others explain the data as well as the accepted ones.
        blind: sites at which the data show no effect, were there one.
        missing: excitation that would tell the named effects from others that explain the data as well.
        disguised: whether a law that the library lacks is likelier than they are, or one of them imitates such a law.

    >>> noise, much = Left((1.0, 1.0, 9), (1.0, 1.0, 9), 1.0, False), Left((26.0, 26.0, 9), (26.0, 17.0, 9), 1.0, True)
    >>> decide(0, noise), decide(1, noise), decide(0, much), decide(1, much)
    ('adequate', 'named', 'unknown', 'unknown')
    >>> decide(1, noise, disguised=True)
    'unknown'
    """
    if named == 0:
        if left.structured:
            return "unknown"
        # What only held-out trials show, learning trials cannot name.
        return "cannot_tell" if blind or left.shows_held_out_only else "adequate"
    if left.is_another or disguised:
        return "unknown"
    if ambiguous:
        return "cannot_tell" if missing else "ambiguous"
    return "named"
