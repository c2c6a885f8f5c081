"""Order everything that was tried, from the best explanation to the worst."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from orchestrator.diagnosis.decide.thresholds import DECISIVE
from orchestrator.diagnosis.fit.evidence import Refit
from orchestrator.diagnosis.linear.calibration import Stage
from orchestrator.diagnosis.linear.subsets import log_sets
from orchestrator.diagnosis.referee.thresholds import UNFITTED
from orchestrator.diagnosis.search.trace import Trace
from orchestrator.library.cards import Candidate
from orchestrator.verdicts.result import RankedSet


def rank(
    trace: Trace,
    nominal: Stage,
    candidates: Sequence[Candidate],
    best: Refit | None = None,
    least_odds: Mapping[frozenset[str], float] | None = None,
    trust: float = 1.0,
) -> tuple[RankedSet, ...]:
    """Rank all sets tried by extended BIC, with the misfit in units of the noise that the best of them leaves.

    `score` is the share of the reducible error (root mean square in the metric) that a set removes on the learning
    trials; `probability` is proportional to exp(-BIC/2), the nominal model being one of the choices. Candidates that were
    not refitted are taken to do what they do to first order, never better than the refitted ones. Variants of an effect
    at one site are one row: its score is that of the best, its probability their sum.

    Args:
        best: the set that held-out trials confirmed last. Larger sets that hold it were not worth their effects, others
            that the search left for it neither, whatever they make of an error that no set explains. They rank behind it.
        least_odds: of the best set against others (by their labels), as of those that held-out trials did not confirm. They
            rank no higher than these let them.
        trust: probability that the truth is among the choices; the probabilities of all sum to it.
    """
    base, odds = nominal.tangent.base, least_odds or {}
    nothing = trace.half_bic(base)
    scale = min(stage.colour.scale for stage in trace.stages)
    found: list[tuple[tuple[Candidate, ...], float, float]] = []
    least = base.cost
    ahead = nothing if best is None else trace.half_bic(best)
    for r in trace.refitted:
        if r.is_present():
            criterion = trace.half_bic(r)
            if best is not None and len(r.labels) > len(best.labels):
                criterion = max(criterion, ahead + float(np.log(DECISIVE)))
            criterion = max(criterion, ahead + float(np.log(odds[r.labels]))) if r.labels in odds else criterion
            found.append((r.effects.candidates, r.cost, criterion))
            least = min(least, r.cost)
        else:
            pays = UNFITTED * r.size + log_sets(trace.choices, len(r.ids))
            found.append((r.effects.candidates, base.cost, nothing + pays))
    tried = {r.labels for r in trace.refitted}
    for candidate in candidates:
        if frozenset({candidate.label}) not in tried:
            rest = max(base.cost - nominal.gains.get(candidate.label, 0.0) / base.fit.rows, least)
            drop = 0.5 * (base.cost - rest) * base.fit.rows / scale
            found.append(((candidate,), rest, nothing - drop + UNFITTED + log_sets(trace.choices, 1)))
    half = np.array([nothing, *(criterion for _, _, criterion in found)])
    weights = np.exp(half.min() - half)
    probabilities = trust * (weights / weights.sum())[1:]
    rows: dict[tuple[tuple[str, str], ...], RankedSet] = {}
    for i in map(int, np.argsort(half[1:], kind="stable")):
        chosen, cost, _ = found[i]
        key = tuple(sorted((c.card.id, c.site) for c in chosen))
        if key in rows:
            rows[key] = replace(rows[key], probability=rows[key].probability + float(probabilities[i]))
            continue
        rows[key] = RankedSet(
            effects=tuple(c.card.id for c in chosen),
            sites=tuple(c.site for c in chosen),
            score=_removed(base.cost, cost),
            probability=float(probabilities[i]),
        )
    return tuple(rows.values())


def _removed(before: float, after: float) -> float:
    """Share of the reducible error that is gone; mean squares in the metric, where noise has 1."""
    if before <= 1.0:
        return 0.0
    return float((before**0.5 - after**0.5) / max(before**0.5 - 1.0, 1e-9))
