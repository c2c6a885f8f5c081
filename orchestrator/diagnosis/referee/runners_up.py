"""Who is asked after a set that held-out trials refused: those that the learning trials do not tell from it."""

from collections.abc import Callable

import numpy as np

from orchestrator.diagnosis.decide.confusion import half_bic, reach
from orchestrator.diagnosis.decide.thresholds import DECISIVE
from orchestrator.diagnosis.fit.evidence import Refit
from orchestrator.diagnosis.search.trace import Accepted, Trace


def runners_up(refused: Refit, trace: Trace, scale: float, finished: Callable[[Refit], Refit]) -> list[Accepted]:
    """Sets that the learning trials do not tell from a refused one and against which nothing else speaks; the likeliest first.

    Args:
        scale: power of the noise in the metric.
        finished: fits a set to the end that was fitted roughly; `trace` keeps what it gives.
    """
    best, tried = half_bic(refused, scale, trace.choices), trace.refitted
    for k, found in enumerate(tried):
        if half_bic(found, scale, trace.choices) < best + reach(refused, scale):
            tried[k] = finished(found)
    behind = {k: half_bic(found, scale, trace.choices) - best for k, found in enumerate(tried)}
    tied = [tried[k] for k in sorted(behind, key=lambda k: behind[k]) if behind[k] < np.log(DECISIVE)]
    able = [r for r in tied if r.labels != refused.labels and r.is_present() and not trace.objection(r)]
    return [Accepted(r, trace.p_value(r)) for r in able]
