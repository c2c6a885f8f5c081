"""From fitted sets to an answer: which effects stay, what rivals remain, and how far the answer is proven.

Pure functions of fitted sets and thresholds. An effect stays if leaving it out makes the record less probable beyond doubt, and
free runs over windows worse (or its share of the likelihood large); no set is named whose free runs a simpler one beats.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from orchestrator.greybox.candidates import Candidate
from orchestrator.greybox.prediction import WINDOWS, Prediction, predicted
from orchestrator.greybox.search import FittedSet
from orchestrator.greybox.thresholds import Thresholds

Grade = Literal["named", "ambiguous", "improves", "unknown", "adequate", "cannot_tell"]


@dataclass(frozen=True, eq=False)
class Weighed:
    """A fitted set with what it predicts on learning trials."""

    found: FittedSet

    @cached_property
    def prediction(self) -> Prediction:
        """Free runs over windows of the learning trials."""
        fit = self.found.fit
        return predicted(fit.box, fit.theta, fit.trials, fit.runs, fit.substeps)

    def error(self, windows: int, scale: np.ndarray) -> float:
        """Root mean square over signals of errors in units of `scale` (ny,)."""
        return float(np.sqrt(np.mean((self.prediction.rms(windows) / scale) ** 2)))


@dataclass(frozen=True, eq=False)
class Decision:
    """The grade, the chosen set, its rivals (sets that explain the record as well), all sets best first, and reasons."""

    grade: Grade
    chosen: FittedSet
    rivals: tuple[FittedSet, ...]
    ranked: tuple[FittedSet, ...]
    explained: float
    reasons: tuple[str, ...] = ()


def beyond_doubt(better: FittedSet, other: FittedSet, limits: Thresholds) -> bool:
    """Whether a set is more probable than another by more than the scatter of the difference over the record allows."""
    gain = other.loss - better.loss
    return gain > limits.nats and gain > limits.standard_errors * scatter_between(better, other)


def scatter_between(one: FittedSet, other: FittedSet) -> float:
    """Standard deviation of the difference of two sets' log likelihoods, from its scatter over stretches of the record."""
    difference = other.losses - one.losses
    return float(np.sqrt(np.sum((difference - difference.mean()) ** 2)))


def decide(
    sets: Sequence[FittedSet],
    nominal: FittedSet,
    limits: Thresholds,
    scale: np.ndarray,
    fit_more: Callable[[tuple[Candidate, ...]], FittedSet | None],
    simpler: Callable[[Candidate], Sequence[Candidate]],
    adequate: bool,
) -> Decision:
    """Choose a set and grade it.

    Args:
        sets: all that were fitted. nominal: the model as given.
        scale: (ny,) of each signal, in which errors are taken together.
        fit_more: fits a further set, None if that fails. simpler: laws that a law becomes at a limit of its parameters.
        adequate: whether the model as given leaves nothing but noise.
    """
    ranked = tuple(sorted(sets, key=lambda s: s.loss))
    if adequate:
        return Decision("adequate", nominal, (), ranked, 1.0)
    chosen = _pruned(ranked[0], nominal, limits, scale, fit_more, simpler)
    chosen = _simplest(chosen, ranked, limits, scale)
    ranked = tuple(sorted({id(s): s for s in (*ranked, chosen)}.values(), key=lambda s: s.loss))
    explained = share_explained(chosen, nominal)
    if not chosen.candidates:
        return Decision(
            "unknown",
            _best_of(ranked, nominal),
            (),
            ranked,
            explained,
            ("no effect of the library helps beyond doubt",),
        )
    rivals = tuple(s for s in ranked if _rivals(chosen, s, limits, scale))
    reasons = []
    if not beyond_doubt(chosen, nominal, limits) and not _foretells(chosen, nominal, limits):
        reasons.append("it is not more probable than the model as given beyond doubt")
    ratio = Weighed(chosen).error(8, scale) / max(Weighed(nominal).error(8, scale), 1e-300)
    if explained < limits.least_explained:
        reasons.append(f"it explains {explained:.0%} of what the model lacks")
    if 1 - limits.least_improvement < ratio <= 1 + limits.worse:
        reasons.append(f"predictions become {1 - ratio:.0%} better only")
    if ratio > 1 + limits.worse:
        reasons.append(f"predictions of learning trials become {ratio - 1:.0%} worse")
    if reasons:
        return Decision("improves", chosen, rivals, ranked, explained, tuple(reasons))
    return Decision("ambiguous" if rivals else "named", chosen, rivals, ranked, explained)


def share_explained(chosen: FittedSet, nominal: FittedSet) -> float:
    """Which share of what the model as given leaves unexplained is gone, 0 to 1.

    By how much the power of the disturbing force falls, over all trials, at the balance where it falls most; less what sensors
    seem to be noisier by instead, as a share of the squared errors of predictions, at the output where that is most.
    """
    before, after = (np.sum([n.intensity**2 for n in s.fit.noise], axis=0) for s in (nominal, chosen))
    left = float(np.min(after / np.maximum(before, 1e-300), initial=1.0))
    before, after = (np.mean([n.sensors**2 for n in s.fit.noise], axis=0) for s in (nominal, chosen))
    errors = Weighed(nominal).prediction.rms(WINDOWS[-1]) ** 2
    moved = float(np.max((after - before) / np.maximum(errors, 1e-300), initial=0.0))
    return float(np.clip(1.0 - left - max(moved, 0.0), 0.0, 1.0))


def _simplest(chosen: FittedSet, ranked: Sequence[FittedSet], limits: Thresholds, scale: np.ndarray) -> FittedSet:
    """A set with fewer parameters that explains and predicts the record as well, if there is one."""
    if not chosen.candidates:
        return chosen
    error = Weighed(chosen).error(8, scale)
    for other in ranked:
        simpler = other.candidates and len(other.fit.theta) < len(chosen.fit.theta)
        if (
            simpler
            and not beyond_doubt(chosen, other, limits)
            and Weighed(other).error(8, scale) < (1 + limits.alike) * error
        ):
            return other
    return chosen


def _power(found: FittedSet, nominal: FittedSet) -> float:
    """Power of the disturbing forces over that of the model as given, of the balance where it fell most."""
    return 1.0 - share_explained(found, nominal)


def _best_of(ranked: Sequence[FittedSet], nominal: FittedSet) -> FittedSet:
    return next((s for s in ranked if s.candidates), nominal)


def _pruned(
    best: FittedSet,
    nominal: FittedSet,
    limits: Thresholds,
    scale: np.ndarray,
    fit_more: Callable[[tuple[Candidate, ...]], FittedSet | None],
    simpler: Callable[[Candidate], Sequence[Candidate]],
) -> FittedSet:
    """The set without the effects that do not earn their place, the weakest first."""
    while best.candidates:
        without = []
        for k in range(best.size):
            less = fit_more((*best.candidates[:k], *best.candidates[k + 1 :])) if best.size > 1 else nominal
            if less is not None:
                without.append(less)
            for other in simpler(best.candidates[k]):
                less = fit_more((*best.candidates[:k], other, *best.candidates[k + 1 :]))
                if less is not None:
                    without.append(less)
        if not without:
            return best
        weakest = min(without, key=lambda s: s.loss)
        idle = [s for s in without if not _earned(best, s, nominal, limits, scale)]
        if not idle:
            return best
        best = weakest if weakest in idle else min(idle, key=lambda s: s.loss)
    return best


def _foretells(best: FittedSet, less: FittedSet, limits: Thresholds) -> bool:
    """Whether predictions are better in so many windows, and by so much, that scatter does not explain it."""
    one, other = (Weighed(s).prediction.squares[WINDOWS[-1]] for s in (best, less))
    ratio = np.log(np.maximum(other, 1e-300) / np.maximum(one, 1e-300)).mean(axis=1)
    ratio = ratio[np.isfinite(ratio)]
    if len(ratio) < 3:
        return False
    return float(ratio.mean()) > limits.standard_errors * float(ratio.std(ddof=1)) / np.sqrt(len(ratio))


def _earned(best: FittedSet, less: FittedSet, nominal: FittedSet, limits: Thresholds, scale: np.ndarray) -> bool:
    """Whether the effect that a smaller set lacks has earned its place in the larger one."""
    if less.loss - best.loss < limits.nats:
        return False
    if not beyond_doubt(best, less, limits) and not _foretells(best, less, limits):
        return False
    if _power(less, nominal) - _power(best, nominal) < limits.least_power:
        return False
    share = (less.loss - best.loss) / max(nominal.loss - best.loss, 1e-9)
    ratio = Weighed(best).error(8, scale) / max(Weighed(less).error(8, scale), 1e-300)
    if ratio > 1 + limits.worse:
        return False
    return ratio < 1 - limits.least_improvement or share >= limits.least_share


def _rivals(chosen: FittedSet, other: FittedSet, limits: Thresholds, scale: np.ndarray) -> bool:
    """Whether another set, no richer, explains the record as well and predicts it as well."""
    if other is chosen or not other.candidates or other.key >= chosen.key:
        return False
    if len(other.fit.theta) > len(chosen.fit.theta) or beyond_doubt(chosen, other, limits):
        return False
    ratio = Weighed(other).error(8, scale) / max(Weighed(chosen).error(8, scale), 1e-300)
    return ratio < 1 + limits.alike
