"""Which effects the data cannot tell from the named ones: the same data, another explanation, its odds."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from orchestrator.diagnosis.decide.nested import acts_near_rest_only, holds, rest_share, unpinned
from orchestrator.diagnosis.decide.thresholds import (
    DECISIVE,
    HOPELESS,
    LEFT,
    MATTERS,
    MOST_RIVALS,
    PARSIMONIOUS,
    ROUGHLY,
)
from orchestrator.diagnosis.fit.evidence import Refit
from orchestrator.diagnosis.linear.subsets import log_sets
from orchestrator.library.cards import Candidate


@dataclass(frozen=True)
class Rival:
    """An explanation with one effect in place of another of the best set, and the odds of the best set against it.

    `holds_it`: the law of the one in its place is that of the other, and more that the data do not rule out.
    """

    refit: Refit
    replaced: str
    by: str
    odds: float
    holds_it: bool = False


def rivals(
    best: Refit,
    tried: Sequence[Refit],
    scale: float,
    room_for: Callable[[Refit, Candidate, Candidate], float | None] = lambda other, old, by: None,
    missing: float = 0.0,
) -> tuple[Rival, ...]:
    """Sets of equal size that differ from the best one in one effect and that the data do not rule out.

    The odds are exp(difference of BIC / 2) of the learning trials, the misfit counted in units of `scale`, by which what is
    left differs from white noise of the declared level. Several sites of one effect count once. A law that holds the one in its place, and more, is at most as likely
    as the simpler law, and none of its own where the rest is too small to matter. It pays nothing for parameters that
    the data leave free, as they take no noise away. Where `room_for` tells how likely it is with all that its rest may
    be, that alone counts: a fit of it is but the nearest of several minima. Where a rest that acts next to rest only
    follows the trials better, the simpler law is preferred if it leaves no more than a right set may of what is
    `missing`, the mean square without effects.

    Args:
        best: the best set, fitted.
        tried: all fitted sets.
        scale: power of the noise in the metric.
        room_for: odds, against the best set, of a set with a law that holds one of the best: given that set, the simpler
            law and the larger one; None where only the fit counts.
        missing: mean square of the errors without effects, in the metric.

    Returns:
        One rival for each pair of effects, the likeliest first.
    """
    found: dict[tuple[str, str], Rival] = {}
    own = {c.label: c for c in best.effects.candidates}
    for other in tried:
        new = {c.label: c for c in other.effects.candidates}
        gone, come = set(own) - set(new), set(new) - set(own)
        if len(other.ids) != len(best.ids) or len(come) != 1 or not other.is_present() or other.pressed():
            continue
        old, by = own[gone.pop()], new[come.pop()]
        pair = (old.card.id, by.card.id)
        rest = rest_share(other, by, old.card) if old.site == by.site and holds(by.card, old.card) else np.nan
        room = None if np.isnan(rest) else room_for(other, old, by)
        # Of equal size, they pay the same for the number of sets.
        behind = half_bic(other, scale, len(own)) - half_bic(best, scale, len(own))
        limit, least = DECISIVE if other.size <= best.size else PARSIMONIOUS, 0.0
        holds_it = not np.isnan(rest)
        if holds_it:
            limit, least = DECISIVE, 1.0
            behind -= 0.5 * unpinned(other, by, old.card) * float(np.log(other.fit.rows))
        if room is not None:
            behind = -float(np.log(room))
        elif behind >= np.log(HOPELESS) or rest < MATTERS:
            behind = np.inf
        if holds_it and _only_hinders_creeping((other, by), (best, old), scale, missing):
            behind = np.inf
        odds = max(float(np.exp(np.clip(behind, -50, 50))), least)
        if old.site == by.site and holds(old.card, by.card):
            odds = 0.0 if _only_hinders_creeping((best, old), (other, by), scale, missing) else odds
        if odds < limit and (pair not in found or odds < found[pair].odds):
            found[pair] = Rival(other, *pair, odds, holds_it)
    return tuple(sorted(found.values(), key=lambda rival: rival.odds))


def _only_hinders_creeping(
    larger: tuple[Refit, Candidate], simpler: tuple[Refit, Candidate], scale: float, missing: float
) -> bool:
    """Whether a law in its set follows the trials better than the one that it holds by a rest next to rest only, and that
    one leaves no more than a right set may."""
    if larger[0].fit.misfit >= simpler[0].fit.misfit or not acts_near_rest_only(*larger, simpler[1].card):
        return False
    return max(simpler[0].cost - scale, 0.0) <= LEFT**2 * max(missing - scale, 0.0)


def least_odds(best: Refit, tried: Sequence[Refit], like: Sequence[Rival]) -> dict[frozenset[str], float]:
    """Odds of the best set against sets with a law in place of a simpler one that it holds, whatever more those
    explain: those of a rival, or decisive ones, by the labels of the set.

    Args:
        best: the best set, fitted.
        tried: all fitted sets.
        like: rivals of the best set.
    """
    listed, found = {rival.refit.labels: rival.odds for rival in like}, dict[frozenset[str], float]()
    for other in tried:
        gone = [c for c in best.effects.candidates if c.label not in other.labels]
        come = [c for c in other.effects.candidates if c.label not in best.labels]
        if len(gone) == len(come) == 1 and gone[0].site == come[0].site and holds(come[0].card, gone[0].card):
            found[other.labels] = listed.get(other.labels, DECISIVE)
    return found


def disguise(best: Refit, tried: Sequence[Refit], scale: float, choices: int) -> Refit | None:
    """The likeliest set at the limit of what an effect can be, of no more effects than the best one, if beside it that is
    hopeless: then the truth is a law that the library lacks, whatever else imitates it.

    Args:
        best: the best set, fitted.
        tried: all fitted sets.
        scale: power of the noise in the metric.
        choices: number of candidates that sets are chosen from.
    """
    pressed = [r for r in tried if len(r.ids) <= len(best.ids) and r.is_present() and r.pressed()]
    likeliest = min(pressed, key=lambda r: half_bic(r, scale, choices), default=None)
    if likeliest is None:
        return None
    ahead = half_bic(best, scale, choices) - half_bic(likeliest, scale, choices)
    return likeliest if ahead > np.log(HOPELESS) else None


def reach(best: Refit, scale: float) -> float:
    """How far a set that was fitted roughly may fall behind the best one, in half BIC, and be its rival once it is
    fitted to the end."""
    return float(np.log(HOPELESS)) + 0.5 * ROUGHLY * best.fit.misfit / scale


def near_in_either(best: Refit, same: Refit, tried: Sequence[Refit], noise: float, choices: int) -> list[int]:
    """Places of the sets that may be rivals of the best one in another metric, in which that is `same`; the likeliest
    first, at most `MOST_RIVALS` of them.

    What the metric changes for one set, it may change for another one the other way.
    """
    changed = 0.5 * abs(same.fit.misfit - best.fit.misfit) / noise
    limit = half_bic(best, noise, choices) + reach(best, noise) + changed
    costs = {k: half_bic(r, noise, choices) for k, r in enumerate(tried) if r.labels != best.labels}
    return sorted((k for k in costs if costs[k] < limit), key=lambda k: costs[k])[:MOST_RIVALS]


def half_bic(found: Refit, scale: float, choices: int) -> float:
    """Half the extended Bayesian information criterion for noise of power `scale` in the metric.

    A set of k effects also pays log(number of such sets among `choices` candidates): the best of many sets fits noise
    better than one that was given (Chen and Chen, Biometrika 95, 2008, with gamma = 1).

    Args:
        found: a fitted set.
        scale: power of the noise in the metric, 1 for noise as declared.
        choices: number of candidates that sets are chosen from.
    """
    parameters = found.size * float(np.log(found.fit.rows))
    return 0.5 * (found.fit.misfit / scale + parameters) + log_sets(choices, len(found.ids))


def groups(found: Sequence[Rival]) -> tuple[tuple[str, ...], ...]:
    """Groups of effect ids that cannot be told apart, each led by the named one."""
    members: dict[str, list[str]] = {}
    for rival in found:
        if rival.by != rival.replaced:
            members.setdefault(rival.replaced, []).append(rival.by)
    return tuple((named, *dict.fromkeys(others)) for named, others in members.items())
