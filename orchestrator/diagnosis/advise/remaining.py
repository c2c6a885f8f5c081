"""The explanations that remain after a search, for the choice of the next experiment."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fmus.errors import MisfitError
from orchestrator.diagnosis.advise.next_experiment import Explanation
from orchestrator.diagnosis.decide.nested import at_least, holds
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.evidence import LearningData, Refit
from orchestrator.models.symbolic import SymbolicModel


def remaining(
    best: Refit | None,
    refitted: Sequence[Refit],
    confusable: Sequence[Sequence[str]],
    nominal: SymbolicModel,
    learning: LearningData,
    unseen: Sequence[EffectSet] = (),
) -> list[Explanation]:
    """Return the explanations to tell apart.

    With effects that cannot be told apart: the best set, and the best set for each of the others; a law that holds one
    of the best set and more, with as much of that as would matter. Without (the data show no effect, or too little):
    the model as given, and effects that would not show (`unseen`) at their typical sizes, else the sets that fit best
    with each of their effects at least of the size that matters.

    Args:
        best: the best set, None if there is none.
        refitted: all fitted sets.
        confusable: groups of ids that the data cannot tell apart, each led by the named one.
        nominal: the model as given.
        learning: the trials learned from.
        unseen: effects that this record would not show, each a set of its own.

    Returns:
        The explanations, the best set or the model as given first; none if that has no start values.
    """
    others = {name for group in confusable for name in group[1:]}
    if best is not None and others:
        # A second effect of one id counts as another: of leaks at both tanks one may stand for what is at an outlet.
        beside = [(r, set(Counter(r.ids) - Counter(best.ids))) for r in refitted if len(r.ids) == len(best.ids)]
        rivals = [r for r, come in beside if come and come <= others]
        return [_of(best), *(_beyond(best, r) for r in _best_of_each(rivals))]
    try:
        start = nominal.record(learning.trials[0]).start
    except MisfitError:
        return []
    nothing = np.zeros(0)
    singles = [] if unseen else [r for r in refitted if len(r.ids) == 1]
    return [
        Explanation("nothing added", nominal, nothing, nothing, nothing, start),
        *(member for effects in unseen for member in _typical(effects, unseen, learning)),
        *(_of(r, enlarged=True) for r in _best_of_each(singles)),
    ]


def _best_of_each(refits: Sequence[Refit]) -> list[Refit]:
    """The best set of each combination of ids, best first."""
    found: dict[tuple[str, ...], Refit] = {}
    for refit in sorted(refits, key=lambda r: r.half_bic):
        found.setdefault(tuple(sorted(refit.ids)), refit)
    return list(found.values())


def _beyond(best: Refit, rival: Refit) -> Explanation:
    """A rival as an explanation; of a law that holds one of the best set, fitted, little more than that may be left."""
    gone = [c for c in best.effects.candidates if c.label not in rival.labels]
    come = [c for c in rival.effects.candidates if c.label not in best.labels]
    found = _of(rival)
    if len(gone) == len(come) == 1 and gone[0].site == come[0].site and holds(come[0].card, gone[0].card):
        return replace(found, values=at_least(rival, come[0], gone[0].card), simpler=_label(best))
    return found


def _label(refit: Refit) -> str:
    return " + ".join(refit.ids)


def _of(refit: Refit, *, enlarged: bool = False) -> Explanation:
    """A refit as an explanation, its parameters moved to meaningful sizes if they are smaller and `enlarged`."""
    low, high = refit.effects.bounds()
    values = refit.values.copy()
    for k, parameter in enumerate(refit.effects.card_parameters if enlarged else ()):
        if np.isfinite(parameter.meaningful) and not parameter.matters(values[k]):
            direction = 1.0 if values[k] >= parameter.zero else -1.0
            values[k] = np.clip(parameter.zero + direction * parameter.meaningful, low[k], high[k])
    return Explanation(_label(refit), refit.effects.model, values, low, high, refit.fit.starts[0])


def _typical(effects: EffectSet, others: Sequence[EffectSet], learning: LearningData) -> list[Explanation]:
    """An effect at its card's first guess; none if it cannot be built."""
    own = effects.candidates[0]
    simpler = [c.card.id for each in others for c in each.candidates if c.site == own.site and holds(own.card, c.card)]
    try:
        low, high = effects.bounds()
        values = np.clip(effects.first_guess(), low, high)
        model = effects.model
        start = model.record(learning.trials[0], model.compiled.with_values(values)).start
    except MisfitError:
        return []
    return [Explanation(own.card.id, model, values, low, high, start, *simpler[:1])]
