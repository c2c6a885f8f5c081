"""Order everything that was tried, from the best explanation to the worst."""

from collections.abc import Sequence

import numpy as np

from orchestrator.diagnosis.candidates import Candidate
from orchestrator.diagnosis.evidence import Refit, half_bic
from orchestrator.diagnosis.result import RankedSet
from orchestrator.diagnosis.search import Trace

# Sets whose errors differ by less than this share cannot be told apart.
INDISTINGUISHABLE = 0.05


def rank(trace: Trace, nominal_cost: float, candidates: Sequence[Candidate], samples: int) -> tuple[RankedSet, ...]:
    """Rank all sets tried by BIC = n log(error^2) + k log n, with k parameters and n = `samples` independent samples.

    `score` is the share of the reducible error (root mean square over the floor) that a set removes on the learning
    trials; `probability` is proportional to exp(-BIC/2), the nominal model being one of the choices. A set that was
    only screened is taken to remove half the share of the error that it explains of the residual.
    """
    nominal = float(np.sqrt(nominal_cost))
    entries: dict[tuple[str, ...], tuple[tuple[Candidate, ...], float, int]] = {}
    for screened in trace.screened:
        gain = 0.0 if np.isnan(screened.gain) else max(screened.gain, 0.0)
        error = nominal - 0.5 * gain * (nominal - 1.0)
        entries[_key(screened.candidates)] = (screened.candidates, error, len(screened.values))
    for refit in trace.refitted:
        # An effect fitted to no meaningful size explains nothing, whatever its start values have absorbed.
        counts = refit.is_meaningful() or (len(refit.ids) == 1 and refit.matters(nominal_cost))
        error = refit.cost**0.5 if counts else nominal
        entries[_key(refit.effects.candidates)] = (refit.effects.candidates, error, len(refit.fit.values))
    for candidate in candidates:
        entries.setdefault(_key((candidate,)), ((candidate,), nominal, 1))
    criteria = [half_bic(error**2, size, samples) for _, error, size in entries.values()]
    half = np.array([half_bic(nominal_cost, 0, samples), *criteria])
    weights = np.exp(half.min() - half)
    probabilities = (weights / weights.sum())[1:]
    ranked = [
        RankedSet(
            effects=tuple(c.card.id for c in chosen),
            sites=tuple(c.site for c in chosen),
            score=float((nominal - error) / max(nominal - 1.0, 1e-9)) if nominal > 1.0 else 0.0,
            probability=float(weight),
        )
        for (chosen, error, _), weight in zip(entries.values(), probabilities, strict=True)
    ]
    order = np.argsort(half[1:], kind="stable")
    return tuple(ranked[i] for i in order)


def confusable_with(best: Refit, trace: Trace) -> tuple[tuple[str, ...], ...]:
    """Groups of effect ids that fit as well as those of the best set, each group led by the named one."""
    own = {c.card.id for c in best.effects.candidates}
    groups: list[tuple[str, ...]] = []
    for other in trace.refitted:
        ids = set(other.ids)
        near = other.is_present() and other.cost**0.5 < (1 + INDISTINGUISHABLE) * best.cost**0.5
        if near and len(ids) == len(own) and len(ids - own) == 1:
            groups.append((next(iter(own - ids)), next(iter(ids - own))))
    return tuple(dict.fromkeys(groups))


def _key(candidates: Sequence[Candidate]) -> tuple[str, ...]:
    return tuple(sorted(c.label for c in candidates))
