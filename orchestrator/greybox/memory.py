"""Forces of terms along a record, those with a memory included."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from orchestrator.greybox.candidates import Candidate
from orchestrator.greybox.expression import evaluate_numbers


def force(candidate: Candidate, coordinates: Mapping[str, np.ndarray], time: np.ndarray) -> np.ndarray:
    """The force (n,) of a law with one gain, which is 1, along coordinates (n,)."""
    names: dict[str, Any] = dict(coordinates) | dict(candidate.shapes)
    for state, rate in candidate.law.states.items():
        names[state] = remembered(rate, state, names, time)
    values = evaluate_numbers(candidate.law.expression, names | {p.name: 1.0 for p in candidate.gains})
    return np.broadcast_to(np.asarray(values, dtype=float), time.shape)


def remembered(rate: str, state: str, names: Mapping[str, Any], time: np.ndarray) -> np.ndarray:
    """A memory (n,) that begins at zero and whose rate is a + b * memory: the exact step for constant a and b."""
    start = np.broadcast_to(np.asarray(evaluate_numbers(rate, {**names, state: 0.0}), dtype=float), time.shape)
    slope = np.asarray(evaluate_numbers(rate, {**names, state: 1.0}), dtype=float) - start
    step = np.diff(time, prepend=time[0])
    reach = slope * step
    kept = np.exp(np.minimum(reach, 0.0))
    gained = np.where(np.abs(reach) > 1e-9, np.expm1(np.minimum(reach, 0.0)) / np.where(reach == 0, 1.0, reach), 1.0)
    pushed = gained * step * start
    found, value = np.zeros(len(time)), 0.0
    for k, (keep, push) in enumerate(zip(kept.tolist(), pushed.tolist(), strict=True)):
        value = keep * value + push
        found[k] = value
    return found
