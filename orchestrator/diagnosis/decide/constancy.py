"""Whether each effect of a fitted set is the same in every trial, as a law of the machine is.

A wrong law follows each trial with other values of its parameters, which a common fit hides: what is left may be no
more than noise beside its scatter. So an effect's parameters are set free in each trial, to first order, with all else
common as it was. If the law is right, that takes off the misfit what noise lets so many unknowns explain (a score test
of constant parameters: Andrews and Fair, Review of Economic Studies 55, 1988).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag
from scipy.special import chdtrc

from orchestrator.diagnosis.decide.thresholds import APART
from orchestrator.diagnosis.fit.evidence import Refit
from orchestrator.diagnosis.linear.calibration import most_by_chance
from orchestrator.diagnosis.linear.tangent import Tangent, orthonormal, split_by_trials
from orchestrator.library.cards import Candidate


@dataclass(frozen=True)
class Change:
    """An effect whose parameters change between trials: by which `share` of what it does (rms), and the chance of noise
    alone."""

    effect: Candidate
    share: float
    p_value: float

    def __str__(self) -> str:
        return (
            f"{self.effect.card.id} follows each trial with other values of its parameters: their changes are {self.share:.0%} of"
            f" what it does (p = {self.p_value:.2g}), so it imitates a law that the library lacks"
        )


def changes(
    tangent: Tangent, scale: float, without: Callable[[Candidate], Refit | None], significant: float, most: float
) -> tuple[Change, ...]:
    """The effects of a fitted set that are not the same in all trials.

    Args:
        tangent: the set, linearised.
        scale: power of the noise at low frequency in the metric.
        without: the set without one of its effects, fitted; None if that cannot be.
        significant: chance of noise alone below which some effect changes.
        most: share of what an effect does, by which the right one may seem to change.
    """
    base, found = tangent.base, list[Change]()
    owners = np.array(base.effects.owners())
    for k, effect in enumerate(base.effects.candidates):
        free = each_for_itself(tangent.slopes[:, owners == k], tangent.rows_of_trials)
        gain, p_value = beyond_noise(orthonormal(tangent.project(free), APART), tangent.error, scale)
        if p_value > significant / len(base.effects.candidates):
            continue
        smaller = without(effect)
        does = np.inf if smaller is None else max(smaller.fit.misfit - base.fit.misfit, 1e-9)
        share = float((gain / does) ** 0.5)
        if share > most:
            found.append(Change(effect, share, p_value))
    return tuple(found)


def each_for_itself(columns: np.ndarray, rows: Sequence[int]) -> np.ndarray:
    """Columns (m, k) as unknowns of each trial: (m, trials * k), where trials have so many `rows` one after the other.

    >>> each_for_itself(np.array([[1.0], [2.0], [3.0]]), [1, 2]).tolist()
    [[1.0, 0.0], [0.0, 2.0], [0.0, 3.0]]
    """
    apart = block_diag(*split_by_trials(columns, rows))
    return np.concatenate([apart, np.zeros((len(columns) - len(apart), apart.shape[1]))])


def beyond_noise(basis: np.ndarray, error: np.ndarray, scale: float) -> tuple[float, float]:
    """What an orthonormal basis (m, k) takes off the square of an error (m,) beyond noise and its scatter, and the
    chance that noise of power `scale` takes off as much as it does.

    Args:
        basis: orthonormal columns (m, k) in the metric.
        error: what a fit leaves (m,) in the metric.
        scale: power of the noise in the metric.

    Returns:
        The drop of the sum of squares beyond what noise explains at most by chance, and the p-value of the whole drop; 0 and
        1 for no columns.
    """
    freedom = basis.shape[1]
    if not freedom:
        return 0.0, 1.0
    taken = float(np.sum((basis.T @ error) ** 2)) / scale
    return max(taken - most_by_chance(freedom), 0.0) * scale, float(chdtrc(freedom, taken))
