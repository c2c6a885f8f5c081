"""Which named effects parameters of the model explain as well, if these may be a little off: a warning beside the name.

Free runs take parameters for exact where no tolerance is stated. A scale error of 1 % of an encoder may be an inertia that is 1 % off.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from fmus.errors import ComponentError
from orchestrator.diagnosis.advise.thresholds import LISTED, SHOWN_SHARE, TAKEN_UP
from orchestrator.diagnosis.decide.confusion import half_bic
from orchestrator.diagnosis.decide.thresholds import DECISIVE
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.evidence import LearningData, Refit, fit_nominal, linearised, refit, with_nuisances
from orchestrator.diagnosis.noise.nuisances import nuisances
from orchestrator.diagnosis.noise.thresholds import ASSUMED
from orchestrator.diagnosis.referee.adjusted import adjusted_parameters
from orchestrator.models.symbolic import SymbolicModel
from orchestrator.verdicts.result import Adjusted, Diagnosis


def with_parameters_alike(
    found: Diagnosis, named: Refit | None, plain: SymbolicModel, learning: LearningData, scale: float, choices: int
) -> Diagnosis:
    """The diagnosis, with a warning for each effect that wrong parameters would stand for.

    Args:
        found: the diagnosis.
        named: the fitted set that is named, None if none is.
        plain: the model without effects.
        learning: the learning trials in their metrics.
        scale: power of the noise in the metric.
        choices: number of candidates that sets are chosen from.
    """
    if named is None or learning.nuisances.names:
        return found
    extra = nuisances(plain.system, {"default": ASSUMED}, learning.nuisances.shift_std)
    if not extra.names:
        return found
    wide, notes = replace(learning, nuisances=extra), list[str]()
    limit = half_bic(named, scale, choices) + np.log(DECISIVE)
    # A model that cannot be run with other parameters says nothing of them.
    with suppress(ComponentError, np.linalg.LinAlgError):
        for k in _taken_up(named, wide):
            again = _without(named, k, plain, wide)
            if half_bic(again, scale, choices) <= limit:
                notes.append(_note(named, k, adjusted_parameters(again)))
    return replace(found, warnings=(*found.warnings, *notes))


def _taken_up(named: Refit, wide: LearningData) -> list[int]:
    """Positions of the effects of which parameters take up most, to first order: the rest of the set is fitted again, too."""
    extra = wide.nuisances
    model, blank = with_nuisances(named.effects, wide), np.full(len(extra.names), np.nan)
    at = replace(named.fit, values=np.r_[named.values, extra.mean], std=np.r_[named.std, blank])
    errors, slopes = linearised(Refit(named.effects, model, named.records, at, named.substeps), wide)
    cards, owners = named.effects.card_parameters, np.array(named.effects.owners())
    size = np.array([np.isfinite(p.meaningful) for p in cards])
    absent = np.array([p.absent for p in cards])
    columns = np.arange(slopes.shape[1])
    is_extra = (columns >= named.size) & (columns < named.size + len(extra.names))
    found = []
    for k in range(len(named.effects.candidates)):
        own = np.flatnonzero((owners == k) & size)
        gone = errors + slopes[:, own] @ (absent[own] - named.values[own])
        others = ~np.isin(columns, np.flatnonzero(owners == k))
        left, covered = (_least(gone, slopes[:, kept]) for kept in (others & ~is_extra, others))
        if covered - named.fit.misfit < (1 - TAKEN_UP) * (left - named.fit.misfit):
            found.append(k)
    return found


def _least(errors: np.ndarray, slopes: np.ndarray) -> float:
    """Least sum of squares of errors (m,) once the columns of `slopes` (m, k) are fitted to them."""
    moves = np.linalg.lstsq(slopes, -errors, rcond=None)[0]
    return float(np.sum((errors + slopes @ moves) ** 2))


def _without(named: Refit, position: int, plain: SymbolicModel, wide: LearningData) -> Refit:
    """The set without one of its effects, and with parameters that may be off."""
    owners = np.array(named.effects.owners())
    rest = [c for k, c in enumerate(named.effects.candidates) if k != position]
    effects = EffectSet(named.effects.base, rest, named.effects.signals)
    return refit(effects, wide, named.values[owners != position]) if rest else fit_nominal(effects, plain, wide)


def _note(named: Refit, position: int, adjusted: Sequence[Adjusted]) -> str:
    candidate = named.effects.candidates[position]
    by_share = sorted(adjusted, key=lambda each: -abs(each.share))
    far = [each for each in by_share if abs(each.share) >= SHOWN_SHARE * ASSUMED] or by_share[:1]
    words = ", ".join(str(each) for each in far[:LISTED])
    return (
        f"instead of {candidate.card.id} at {candidate.site} parameters of the model may be a little off: {words};"
        " nobody said how well they are known (--tolerance)"
    )
