"""What was tried and why it was not named, one line for each set of effects."""

from collections.abc import Sequence

import numpy as np

from orchestrator.diagnosis.evidence import Refit
from orchestrator.diagnosis.result import RankedSet, Tried
from orchestrator.diagnosis.search import Trace


def tried(
    ranking: Sequence[RankedSet], trace: Trace, named: Refit | None, accepted: Sequence[Refit]
) -> tuple[Tried, ...]:
    """Say of each ranked set why it was named or left, in the order of the ranking.

    Args:
        named: the set that was named, None if none was.
        accepted: sets that held-out trials confirmed on the way.
    """
    refits = {_key(r.ids, tuple(c.site for c in r.effects.candidates)): r for r in trace.refitted}
    gains = {
        _key(tuple(c.card.id for c in s.candidates), tuple(c.site for c in s.candidates)): s.gain
        for s in trace.screened
    }
    best = min((trace.half_bic(r) for r in trace.refitted), default=np.inf)
    steps = {_key(r.ids, tuple(c.site for c in r.effects.candidates)) for r in accepted}
    final = None if named is None else _key(named.ids, tuple(c.site for c in named.effects.candidates))
    found = []
    for entry in ranking:
        key = _key(entry.effects, entry.sites)
        refit, gain = refits.get(key), gains.get(key)
        if key == final:
            outcome = "named: held-out trials confirm it"
        elif key in steps:
            outcome = "a step on the way: held-out trials confirm it, a larger set explains more"
        elif refit is not None:
            outcome = _refitted(refit, trace.half_bic(refit) - best)
        elif gain is None:
            outcome = "not tried: it could not be simulated"
        elif np.isnan(gain):
            outcome = "its fit failed"
        else:
            outcome = (
                f"explains {max(gain, 0.0):.1%} of the missing force, too little or less than others: not refitted"
            )
        found.append(Tried(entry.effects, entry.sites, outcome))
    return tuple(found)


def _refitted(refit: Refit, behind: float) -> str:
    """Why a set that was refitted by free runs was not named."""
    error = f"error {refit.cost**0.5:.3g} times the floor"
    if not refit.is_present():
        return f"{error}: the data do not tell {_plural(refit)} from absence"
    if behind > 0:
        return f"{error}: explains less than the best set for its size (BIC/2 behind by {behind:.3g})"
    if not refit.is_meaningful():
        return f"{error}: fitted to a size that does not matter"
    return f"{error}: the best fit of the learning trials, but held-out trials do not confirm it"


def _plural(refit: Refit) -> str:
    return "it" if len(refit.ids) == 1 else "each of its effects"


def _key(effects: Sequence[str], sites: Sequence[str]) -> tuple[tuple[str, str], ...]:
    return tuple(sorted(zip(effects, sites, strict=True)))
