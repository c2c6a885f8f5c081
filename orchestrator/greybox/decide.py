"""From fitted sets to an answer: which effects stay, what rivals remain, and how far the answer is proven.

Pure functions of fitted sets and thresholds. An effect stays if leaving it out makes the record less probable beyond doubt, and
free runs over windows worse (or its share of the likelihood large); no set is named whose free runs a simpler one beats.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from orchestrator.compare.comparison import share_left
from orchestrator.greybox.candidates import Candidate
from orchestrator.greybox.prediction import HORIZONS, WHOLE, squared_errors
from orchestrator.greybox.search import FittedSet
from orchestrator.greybox.thresholds import Thresholds

FitMore = Callable[[tuple[Candidate, ...], FittedSet | None], FittedSet | None]
Grade = Literal["named", "ambiguous", "improves", "unknown", "adequate", "cannot_tell"]


class Judge:
    """Compares fitted sets: by their likelihoods, and by free runs over windows of the learning trials.

    Windows are as long as the plant can be predicted: an eighth of a trial, or a part of that if no likely set predicts so
    far. Errors over longer ones, of an arm that falls or a turn count that adds up, say nothing of what is missing.
    """

    def __init__(self, nominal: FittedSet, limits: Thresholds, scale: np.ndarray, windows: int = HORIZONS[0]) -> None:
        """`scale` (ny,) is the spread of each signal; a trial has so many `windows`."""
        self.nominal, self.limits, self.scale, self.windows = nominal, limits, scale, windows
        self._squares: dict[tuple[int, int], tuple[FittedSet, np.ndarray]] = {}

    @classmethod
    def of(cls, nominal: FittedSet, sets: Sequence[FittedSet], limits: Thresholds, scale: np.ndarray) -> "Judge":
        """With the longest windows over which one of the likeliest sets predicts.

        Args:
            nominal: the model as given, fitted.
            sets: the fitted sets.
            limits: thresholds of the decision.
            scale: spread of each signal (ny,) over the learning trials, in its unit.
        """
        judge = cls(nominal, limits, scale)
        best = sorted(sets, key=lambda s: s.loss)[: limits.likeliest]
        judge.windows = next((w for w in HORIZONS if any(judge.predicts(s, w) for s in best)), HORIZONS[-1])
        return judge

    def squares(self, found: FittedSet, windows: int = 0) -> np.ndarray:
        """Mean squared errors of free runs over windows of the learning trials, (windows, ny)."""
        key = id(found), windows or self.windows
        if key not in self._squares:
            fit = found.fit
            runs = squared_errors(fit.box, fit.theta, fit.trials, fit.runs, key[1])
            self._squares[key] = found, runs  # the set is kept, so that no other one gets its number
        return self._squares[key][1]

    def error(self, found: FittedSet, windows: int = 0) -> float:
        """Root mean square over signals of the errors of free runs in units of the scale."""
        return float(np.sqrt(np.mean(np.mean(self.squares(found, windows), axis=0) / self.scale**2)))

    def predicts(self, found: FittedSet, windows: int) -> bool:
        """Whether errors over so many windows are a small share of the signals' spread, or of what the model as given errs by."""
        spread = max(1.0, self.error(self.nominal, windows))
        return self.error(found, windows) < self.limits.predictable * spread

    def ratio(self, found: FittedSet, other: FittedSet) -> float:
        """Error of a set over that of another."""
        return self.error(found) / max(self.error(other), 1e-300)

    def best_ratio(self, found: FittedSet, other: FittedSet) -> float:
        """The least error of a set over that of another, over the horizon or over whole trials where these can be predicted: what
        is slow, a charge that adds up, hardly shows in less."""
        ratio = self.ratio(found, other)
        if not self.predicts(found, WHOLE):
            return ratio
        return min(ratio, self.error(found, WHOLE) / max(self.error(other, WHOLE), 1e-300))

    def defeats(self, other: FittedSet, one: FittedSet) -> bool:
        """Whether a set with no more parameters predicts clearly better than another one, over some horizon, and worse over none.

        Over whole trials it may not be less probable beyond doubt: small errors add up there.
        """
        if other is one or other.counted > one.counted:
            return False
        least, ratio = 1 - self.limits.defeated, self.ratio(other, one)
        if ratio < least:
            return True
        far = self.best_ratio(other, one) < least and not self.beyond_doubt(one, other)
        return far and ratio <= 1 + self.limits.worse

    def beyond_doubt(self, better: FittedSet, other: FittedSet) -> bool:
        """Whether a set is more probable than another beyond doubt."""
        return beyond_doubt(better, other, self.limits)

    def foretells(self, best: FittedSet, less: FittedSet) -> bool:
        """Whether predictions are better in so many windows, and by so much, that scatter does not explain it."""
        one, other = (self.squares(s) for s in (best, less))
        ratio = np.log(np.maximum(other, 1e-300) / np.maximum(one, 1e-300)).mean(axis=1)
        ratio = ratio[np.isfinite(ratio)]
        if len(ratio) < 3:
            return False
        return float(ratio.mean()) > self.limits.standard_errors * float(ratio.std(ddof=1)) / np.sqrt(len(ratio))

    def explained(self, chosen: FittedSet) -> float:
        """Which share of what the model as given leaves unexplained is gone, 0 to 1.

        By how much the power of the disturbing force falls, over all trials, at the balance where it falls most; less what
        sensors seem to be noisier by instead, as a share of the squared errors of predictions.
        """
        left = float(np.min(_left(chosen, self.nominal), initial=1.0))
        return float(np.clip(1.0 - left - self._moved(chosen, self.nominal), 0.0, 1.0))

    def left_by_runs(self, found: FittedSet) -> float:
        """Largest share of a signal's squared error along whole learning trials that is left, 0 to 1; 0 if they cannot be predicted."""
        if not self.predicts(found, WHOLE):
            return 0.0
        before, after = (np.mean(self.squares(s, WHOLE), axis=0) for s in (self.nominal, found))
        noise = np.mean([n.sensors**2 for n in found.fit.noise], axis=0)
        return max(map(share_left, before.tolist(), after.tolist(), noise.tolist()))

    def takes_away(self, best: FittedSet, less: FittedSet, given: FittedSet) -> float:
        """Share of the disturbing force's power with the model `given` that an effect takes away which a smaller set lacks, at the
        balance where it is most: another effect may have explained all that was missing at a different one.

        Args:
            best: the larger set.
            less: the same without one effect.
            given: the model as given.
        """
        fallen = float(np.max(_left(less, given) - _left(best, given), initial=0.0))
        return fallen - (self._moved(best, given) - self._moved(less, given))

    def _moved(self, found: FittedSet, given: FittedSet) -> float:
        """What sensors seem to be noisier by, as a share of the squared errors of predictions, both in units of the scale: an output
        that predictions hardly miss has its own noise, which forces took for theirs."""
        before, after = (np.mean([n.sensors**2 for n in s.fit.noise], axis=0) for s in (given, found))
        errors = np.mean(self.squares(given), axis=0)
        return float(np.sum(np.maximum(after - before, 0.0) / self.scale**2) / np.sum(errors / self.scale**2))

    def earned(self, best: FittedSet, less: FittedSet, given: FittedSet) -> bool:
        """Whether the effect that a smaller set lacks has earned its place in the larger one, beside what the model `given` lacks.

        Args:
            best: the larger set.
            less: the same without one effect.
            given: the model as given.
        """
        limits = self.limits
        if less.loss - best.loss < limits.nats:
            return False
        if not self.beyond_doubt(best, less) and not self.foretells(best, less):
            return False
        ratio = self.ratio(best, less)
        if ratio < 1 - limits.least_improvement:
            return True
        # What a sensor does is no disturbing force.
        acts = any(c.place.kind not in ("output", "response") for c in best.candidates if c.family not in less.key)
        if acts and self.takes_away(best, less, given) < limits.least_power:
            return False
        if ratio > 1 + limits.worse and self.foretells(less, best):
            return False
        return (less.loss - best.loss) / max(given.loss - best.loss, 1e-9) >= limits.least_share

    def rivals(self, chosen: FittedSet, other: FittedSet) -> bool:
        """Whether another set, no richer, explains the record as well and predicts it as well, be it over whole trials."""
        if other is chosen or not other.candidates or other.key >= chosen.key:
            return False
        if other.counted > chosen.counted or self.beyond_doubt(chosen, other) or self.defeats(chosen, other):
            return False
        return self.ratio(other, chosen) < 1 + self.limits.alike


def _left(found: FittedSet, given: FittedSet) -> np.ndarray:
    """Power of the disturbing force at each balance over all trials, over that of the model `given`, (nb,)."""
    before, after = (np.sum([n.intensity**2 for n in s.fit.noise], axis=0) for s in (given, found))
    return np.asarray(np.minimum(after / np.maximum(before, 1e-300), 1.0))


def beyond_doubt(better: FittedSet, other: FittedSet, limits: Thresholds) -> bool:
    """Whether a set is more probable than another by more than the scatter of the difference over the record allows."""
    gain = other.loss - better.loss
    return gain > limits.nats and gain > limits.standard_errors * scatter_between(better, other)


def scatter_between(one: FittedSet, other: FittedSet) -> float:
    """Standard deviation of the difference of two sets' log likelihoods, from its scatter over stretches of the record."""
    difference = other.losses - one.losses
    return float(np.sqrt(np.sum((difference - difference.mean()) ** 2)))


@dataclass(frozen=True, eq=False)
class Decision:
    """The grade, the chosen set, its rivals (sets that explain the record as well), all sets best first, the share that is
    explained, who compared them, reasons, and sets that are the chosen model in other parameters."""

    grade: Grade
    chosen: FittedSet
    rivals: tuple[FittedSet, ...]
    ranked: tuple[FittedSet, ...]
    explained: float
    judge: Judge
    reasons: tuple[str, ...] = ()
    aliases: tuple[FittedSet, ...] = ()

    @property
    def windows(self) -> int:
        """Number of windows in a trial over which predictions were compared."""
        return self.judge.windows


def decide(
    sets: Sequence[FittedSet],
    nominal: FittedSet,
    limits: Thresholds,
    scale: np.ndarray,
    fit_more: FitMore,
    simpler: Callable[[Candidate], Sequence[Candidate]],
    adequate: bool,
    unnamed: Callable[[FittedSet, Judge], str] = lambda chosen, judge: "",
    same: Callable[[FittedSet], FittedSet | None] = lambda chosen: None,
    one_model: Callable[[FittedSet, FittedSet], bool] = lambda one, other: False,
    complete: Callable[[FittedSet], bool] = lambda found: False,
) -> Decision:
    """Choose a set and grade it.

    Args:
        sets: all that were fitted. nominal: the model as given.
        scale: (ny,) of each signal, in which errors are taken together.
        fit_more: fits a further set, from the values of another one too if it is given; None if that fails. simpler: laws that a law becomes at a limit of its parameters.
        adequate: whether the model as given leaves nothing but noise.
        unnamed: says why a set is no more than an approximation of a law that no candidate has; empty if it is not.
        same: a set that no data can tell from another one, if there is one.
        one_model: whether two sets are one model in other parameters.
        complete: whether a set leaves nothing but noise.
    """
    ranked = _ranked(sets)
    judge = Judge.of(nominal, sets, limits, scale)
    if adequate:
        return Decision("adequate", nominal, (), ranked, 1.0, judge)
    first = _with_plausible_values(ranked, judge, complete)
    first = fit_more(first.candidates, None) or first if first.candidates else first
    pruned = _pruned(first, judge, fit_more, simpler)
    if pruned.candidates:  # of fewer parameters than the first choice, it has other rivals
        as_plausible = _as_plausible(ranked, pruned, limits)
        pruned = _undefeated(
            [pruned, *(s for s in as_plausible if s.candidates and s.counted <= pruned.counted)], judge
        )
    chosen = _simplest(pruned, _as_plausible(ranked, pruned, limits), judge)
    ranked = _ranked([*ranked, chosen])
    explained = judge.explained(chosen)
    if not chosen.candidates:
        best = next((s for s in ranked if s.candidates), nominal)
        nothing = "no effect of the library helps beyond doubt"
        return Decision("unknown", best, (), ranked, explained, judge, (nothing,))
    alike = [chosen, *(s for s in ranked if one_model(s, chosen))]
    chosen = min(alike, key=lambda s: (surprise(s) >= limits.surprising, s.added))
    aliases = tuple({s.key: s for s in alike if s.key != chosen.key}.values())
    ranked = tuple(s for s in ranked if s.key not in {alias.key for alias in aliases})
    rivals = tuple(s for s in _as_plausible(ranked, chosen, limits) if judge.rivals(chosen, s))
    if (twin := same(chosen)) is not None:
        rivals, ranked = (*(s for s in rivals if s is not twin), twin), _ranked([*ranked, twin])
    reasons = tuple(_doubts(chosen, judge, explained))
    if not reasons and (approximation := unnamed(chosen, judge)):
        reasons = (approximation,)
    grade: Grade = "improves" if reasons else "ambiguous" if rivals else "named"
    return Decision(grade, chosen, rivals, ranked, explained, judge, reasons, aliases)


def surprise(found: FittedSet) -> float:
    """By how many standard deviations of its prior the most surprising parameter of a set is off: data sheets err by percents."""
    priors = found.fit.priors
    gains = np.array([p.gain for c in found.candidates for p in (*c.gains, *c.fitted_shapes)], dtype=bool)
    return float(np.max(np.abs(found.fit.theta / priors.std)[gains], initial=0.0))


def _as_plausible(sets: Sequence[FittedSet], one: FittedSet, limits: Thresholds) -> list[FittedSet]:
    """Sets whose parameters surprise no more than those of one set, or not at all."""
    return [s for s in sets if surprise(s) <= max(surprise(one), limits.surprising)]


def _ranked(sets: Sequence[FittedSet]) -> tuple[FittedSet, ...]:
    """Each set once, best first."""
    return tuple(sorted({id(s): s for s in sets}.values(), key=lambda s: s.loss))


def _doubts(chosen: FittedSet, judge: Judge, explained: float) -> Iterator[str]:
    """Why a set is not proven."""
    limits, nominal = judge.limits, judge.nominal
    ratio, best_ratio = judge.ratio(chosen, nominal), judge.best_ratio(chosen, nominal)
    better = 1 - best_ratio
    if not judge.beyond_doubt(chosen, judge.nominal) and not judge.foretells(chosen, judge.nominal):
        yield "it is not more probable than the model as given beyond doubt"
    # What adds up over a trial may be small beside what disturbs it from sample to sample, and yet be all that runs miss.
    if explained < limits.least_explained and best_ratio**2 > limits.complete_share:
        yield f"it explains {explained:.0%} of what the model lacks"
    if better < limits.least_improvement and ratio <= 1 + limits.worse:
        yield f"predictions become {better:.0%} better only"
    if ratio > 1 + limits.worse:
        yield f"predictions of learning trials become {ratio - 1:.0%} worse"
    whole, given = (judge.error(s, WHOLE) for s in (chosen, judge.nominal))
    if whole > (1 + limits.worse) * given and given < 1:  # beyond the signals' own spread, errors say nothing
        yield f"free runs along learning trials become {whole / given - 1:.0%} worse"


def _undefeated(ranked: Sequence[FittedSet], judge: Judge) -> FittedSet:
    """The likeliest set than which no set with as few parameters predicts better.

    What filters say of the next sample favours wrong sensors where a model is far off; free runs do not.
    """

    return next((s for s in ranked if not any(judge.defeats(other, s) for other in ranked)), ranked[0])


def _with_plausible_values(
    ranked: Sequence[FittedSet], judge: Judge, complete: Callable[[FittedSet], bool]
) -> FittedSet:
    """The undefeated set; of those without surprising parameters if there is one, unless that predicts by far worse.

    An inertia that is twice what the data sheet says stands for what no candidate is, as long as others predict nearly as well and
    something is left. Of sets that leave nothing, the likelier one is right, with what a surprising value costs in it.
    """
    likeliest = _undefeated(ranked, judge)
    plausible = [s for s in ranked if s.candidates and surprise(s) < judge.limits.surprising]
    if not plausible or surprise(likeliest) < judge.limits.surprising:
        return likeliest
    best = _undefeated(plausible, judge)
    if judge.beyond_doubt(likeliest, best) and likeliest.counted <= best.counted and complete(likeliest):
        return likeliest
    return likeliest if judge.best_ratio(likeliest, best) ** 2 < judge.limits.complete_share else best


def _simplest(chosen: FittedSet, plausible: Sequence[FittedSet], judge: Judge) -> FittedSet:
    """A set with fewer parameters that explains and predicts the record as well, if there is one."""
    if not chosen.candidates:
        return chosen
    for other in plausible:
        simpler = other.candidates and other.counted < chosen.counted
        if simpler and not judge.beyond_doubt(chosen, other) and judge.ratio(other, chosen) < 1 + judge.limits.alike:
            return other
    return chosen


def _pruned(
    best: FittedSet,
    judge: Judge,
    fit_more: FitMore,
    simpler: Callable[[Candidate], Sequence[Candidate]],
) -> FittedSet:
    """The set without the effects that do not earn their place, the weakest first.

    A parameter that is off by a few percent needs no such proof; wrong ones stay while predictions would become clearly worse
    without those that go, taken together. Beside wrong parameters, other effects are judged by what the model lacks with the
    right ones: an error of a few percent in a mass may be a hundred times the friction.
    """
    whole = best
    wrong = tuple(c for c in whole.candidates if c.id == "parameter_error")
    calibrated = (fit_more(wrong, None) if wrong else None) or judge.nominal

    def given(best: FittedSet, less: FittedSet) -> FittedSet:
        gone = {c.id for c in best.candidates if c.family not in less.key}
        return judge.nominal if "parameter_error" in gone else calibrated

    def missed(less: FittedSet) -> bool:
        gone = [c for c in whole.candidates if c.family not in less.key]
        needed = judge.ratio(whole, less) < 1 - judge.limits.least_improvement
        return needed and bool(less.candidates) and all(c.id == "parameter_error" for c in gone)

    while best.candidates:
        smaller = (s for s in _smaller(best, fit_more, simpler, judge.nominal) if s is not None)
        idle = (s for s in smaller if not judge.earned(best, s, given(best, s)) and not missed(s))
        less = next(idle, None)
        if less is None:
            return best
        best = less
    return best


def _smaller(
    best: FittedSet,
    fit_more: FitMore,
    simpler: Callable[[Candidate], Sequence[Candidate]],
    nominal: FittedSet,
) -> Iterator[FittedSet | None]:
    """The sets without one effect, or with a simpler one in its place, the weakest first; fitted when they are asked for."""
    for weak in sorted(best.candidates, key=best.evidence):
        k = best.candidates.index(weak)
        rest = (*best.candidates[:k], *best.candidates[k + 1 :])
        yield fit_more(rest, best) if rest else nominal
        for other in simpler(weak):
            yield fit_more((*rest[:k], other, *rest[k:]), best)
