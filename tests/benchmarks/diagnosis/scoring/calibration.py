"""Whether the probabilities that a diagnosis gives its best set of effects come true."""

from collections.abc import Sequence
from typing import Any

from tests.benchmarks.diagnosis.scoring.wilson import Share

BINS = 5
# With fewer answers in a bin on average, the error would say more of chance than of the probabilities.
FEWEST = 4


def reliability(rows: Sequence[dict[str, Any]]) -> list[tuple[float, bool]]:
    """Probability of the first in the ranking and whether it is the truth, of cases in which something is missing.

    Effects of no library count, and nothing that is listed is right there: a diagnosis reserves some probability for them,
    which would look like too little confidence without them.
    """
    known = [r for r in rows if r["probability"] is not None and r["true"]]
    return [(r["probability"], bool(r["probability_right"])) for r in known]


def bins(pairs: Sequence[tuple[float, bool]]) -> list[tuple[float, Share]]:
    """Mean probability and share that is right in each of `BINS` bins of equal width that has any."""
    found = []
    for k in range(BINS):
        inside = [(p, right) for p, right in pairs if min(int(p * BINS), BINS - 1) == k]
        if inside:
            found.append((sum(p for p, _ in inside) / len(inside), Share.of(right for _, right in inside)))
    return found


def calibration_error(rows: Sequence[dict[str, Any]]) -> float | None:
    """Expected calibration error: mean over cases of |share right - mean probability| of their bin.

    >>> row = {"probability": 0.9, "probability_right": True, "true": ["cogging"], "kind": ""}
    >>> round(calibration_error([row] * 20), 3)
    0.1
    """
    pairs = reliability(rows)
    if len(pairs) < FEWEST * BINS:
        return None
    return sum(abs(share.hits - share.n * p) for p, share in bins(pairs)) / len(pairs)
