"""What was tried and why it was not named, one line for each set of effects."""

from collections.abc import Sequence

import numpy as np

from orchestrator.diagnosis.fit.evidence import Refit
from orchestrator.diagnosis.linear.thresholds import SIGNIFICANT
from orchestrator.diagnosis.search.trace import Trace
from orchestrator.library.cards import Candidate
from orchestrator.verdicts.result import RankedSet, Tried

Key = tuple[tuple[str, str], ...]


def tried(
    ranking: Sequence[RankedSet], trace: Trace, named: Refit | None, accepted: Sequence[Refit]
) -> tuple[Tried, ...]:
    """Say of each ranked set why it was named or left, in the order of the ranking.

    Args:
        named: the set that was named, None if none was.
        accepted: sets that held-out trials confirmed on the way.
    """
    # Variants of an effect share a row, that of the better one.
    refits = {_key(r): r for r in sorted(trace.refitted, key=trace.half_bic, reverse=True)}
    gains = {_key_of(s.candidates): s.gain for s in sorted(trace.screened, key=lambda s: np.nan_to_num(s.gain))}
    failed = {_key_of(sets): reason for sets, reason in trace.failed.items()}
    best = min((trace.half_bic(r) for r in trace.refitted), default=np.inf)
    steps = {_key(r) for r in accepted}
    last = _key(accepted[-1]) if accepted else None
    final = None if named is None else _key(named)
    found = []
    for entry in ranking:
        key = tuple(sorted(zip(entry.effects, entry.sites, strict=True)))
        if key == final:
            outcome = "named: held-out trials confirm it"
        elif key == last:
            outcome = "fits best and held-out trials confirm it, but it leaves what no effect of the library explains"
        elif key in steps:
            outcome = "a step on the way: held-out trials confirm it, a larger set explains more"
        elif key in refits:
            outcome = _refitted(refits[key], trace.half_bic(refits[key]) - best, trace)
        elif key in failed:
            outcome = f"not tried to the end: {failed[key]}"
        else:
            outcome = _left_out(gains.get(key), trace)
        found.append(Tried(entry.effects, entry.sites, outcome))
    return tuple(found)


def _left_out(gain: float | None, trace: Trace) -> str:
    """Why an effect was never refitted by free runs."""
    if not trace.screened:
        p = trace.stages[0].p_value
        if p > SIGNIFICANT:
            return f"not refitted: the error of the model as given is not told from noise (p = {p:.2g})"
        return "not refitted: the error of the model as given is too small to matter"
    if gain is None or np.isnan(gain):
        return "not refitted: it does not stand out in what free runs do to first order"
    return f"explains {max(gain, 0.0):.1%} of the missing force by itself, others more: not refitted"


def _refitted(refit: Refit, behind: float, trace: Trace) -> str:
    """Why a set that was refitted by free runs was not named."""
    error = f"weighted error {refit.cost**0.5:.3g} (noise alone: 1)"
    if not refit.fit.converged:
        error += " when its fit, which did not settle, was given up"
    if not refit.is_present():
        return f"{error}: the data do not tell {'it' if len(refit.ids) == 1 else 'each of its effects'} from absence"
    if behind > 0:
        return f"{error}: explains less than the best set for its size (BIC/2 behind by {behind:.3g})"
    objection = trace.objection(refit)
    if objection:
        return f"{error}: {objection}"
    return f"{error}: the best fit of the learning trials, but none that held-out trials confirmed"


def _key(refit: Refit) -> Key:
    return _key_of(refit.effects.candidates)


def _key_of(candidates: Sequence[Candidate]) -> Key:
    return tuple(sorted((c.card.id, c.site) for c in candidates))
