"""Order everything that was tried, from the best explanation to the worst."""

from collections.abc import Sequence

import numpy as np

from orchestrator.diagnosis.calibration import Stage
from orchestrator.diagnosis.candidates import Candidate
from orchestrator.diagnosis.result import RankedSet
from orchestrator.diagnosis.search import Trace
from orchestrator.diagnosis.subsets import log_sets


def rank(trace: Trace, nominal: Stage, candidates: Sequence[Candidate]) -> tuple[RankedSet, ...]:
    """Rank all sets tried by extended BIC, with the misfit in units of the noise that the best of them leaves.

    `score` is the share of the reducible error (root mean square in the metric) that a set removes on the learning
    trials; `probability` is proportional to exp(-BIC/2), the nominal model being one of the choices. Candidates that were
    not refitted are taken to do what they do to first order, never better than the refitted ones.
    """
    base = nominal.tangent.base
    nothing = trace.half_bic(base)
    scale = min(stage.colour.scale for stage in trace.stages)
    refits = [r for r in trace.refitted if r.is_present()]
    criteria = [trace.half_bic(r) for r in refits]
    chosen: list[tuple[Candidate, ...]] = [r.effects.candidates for r in refits]
    errors = [r.cost**0.5 for r in refits]
    tried = {r.labels for r in trace.refitted}
    for candidate, gain in _untried(nominal, candidates, tried).items():
        rest = max(base.cost - gain / base.fit.rows, min([*(r.cost for r in refits), base.cost]))
        errors.append(rest**0.5)
        drop = (rest - base.cost) * base.fit.rows / scale
        criteria.append(nothing + 0.5 * (drop + 20.0) + log_sets(trace.choices, 1))
        chosen.append((candidate,))
    for failed in trace.refitted:
        if not failed.is_present():
            chosen.append(failed.effects.candidates)
            errors.append(base.cost**0.5)
            criteria.append(nothing + 10.0 * failed.size + log_sets(trace.choices, len(failed.ids)))
    half = np.array([nothing, *criteria])
    weights = np.exp(half.min() - half)
    probabilities = (weights / weights.sum())[1:]
    before, floor = base.cost**0.5, min(1.0, base.cost**0.5)
    ranked = [
        RankedSet(
            effects=tuple(c.card.id for c in entry),
            sites=tuple(c.site for c in entry),
            score=float((before - error) / max(before - floor, 1e-9)) if before > 1.0 else 0.0,
            probability=float(weight),
        )
        for entry, error, weight in zip(chosen, errors, probabilities, strict=True)
    ]
    return tuple(ranked[i] for i in np.argsort(half[1:], kind="stable"))


def _untried(nominal: Stage, candidates: Sequence[Candidate], tried: set[frozenset[str]]) -> dict[Candidate, float]:
    """Candidates that were never refitted alone, with what they explain of the nominal misfit to first order."""
    gains = nominal.gains
    return {c: gains.get(c.label, 0.0) for c in candidates if frozenset({c.label}) not in tried}
