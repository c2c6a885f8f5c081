"""Events of a result moved onto those of its reference, so that lateness and size are told apart."""

from dataclasses import dataclass, replace

import numpy as np

from orchestrator.regress.comparison.distance import distances
from orchestrator.regress.comparison.jumps import jump_times
from orchestrator.regress.comparison.prepare import Pair


@dataclass(frozen=True, eq=False)
class Alignment:
    """Jumps of a result, `found`, and of its reference, `due`: moments in s, rising."""

    found: np.ndarray
    due: np.ndarray

    @property
    def paired(self) -> bool:
        """Whether there are jumps, as many in the result as in the reference."""
        return len(self.found) == len(self.due) > 0

    @property
    def worst(self) -> int:
        """Which pair is farthest apart."""
        return int(np.argmax(np.abs(self.found - self.due)))

    @property
    def shift_s(self) -> float | None:
        """The largest shift, s, positive when the result is late; None without pairs."""
        return float(self.found[self.worst] - self.due[self.worst]) if self.paired else None


def align(pair: Pair) -> Alignment:
    """Return the jumps of both, in order; those that fit into the band do not count."""
    smallest = 2 * pair.band.half_height
    return Alignment(jump_times(pair.result, smallest), jump_times(pair.reference, smallest))


def amplitude_error(pair: Pair, jumps: Alignment) -> float:
    """Return the largest distance left once all paired jumps are moved onto the reference's, in the signal's unit.

    The result's time runs faster or slower between its jumps, so that each one falls on the reference's.
    """
    ends = pair.result.time[[0, -1]]
    found = np.concatenate([ends[:1], jumps.found, ends[1:]])
    due = np.concatenate([ends[:1], np.clip(jumps.due, *ends), ends[1:]])
    moved = replace(pair.result, time=np.interp(pair.result.time, found, due))
    return float(distances(replace(pair, result=moved))[0].max())
