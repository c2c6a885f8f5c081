"""Forces of terms along a record, those with a memory included."""

import re
from collections.abc import Mapping
from typing import Any

import casadi as ca
import numpy as np

from orchestrator.greybox.candidates import Candidate
from orchestrator.greybox.expression import evaluate, evaluate_numbers

# Steps in a sample interval for a memory whose rate is no line in it.
SUBSTEPS = 8


def force(candidate: Candidate, coordinates: Mapping[str, np.ndarray], time: np.ndarray) -> np.ndarray:
    """The force (n,) of a law with one gain, which is 1, along coordinates (n,)."""
    names: dict[str, Any] = dict(coordinates) | dict(candidate.shapes)
    for state, rate in candidate.law.states.items():
        names[state] = remembered(rate, state, names, time)
    values = evaluate_numbers(candidate.law.expression, names | {p.name: 1.0 for p in candidate.gains})
    return np.broadcast_to(np.asarray(values, dtype=float), time.shape)


def remembered(rate: str, state: str, names: Mapping[str, Any], time: np.ndarray) -> np.ndarray:
    """A memory (n,) that begins at zero: where its rate is a + b * memory, by the exact step for constant a and b."""
    start = np.broadcast_to(np.asarray(evaluate_numbers(rate, {**names, state: 0.0}), dtype=float), time.shape)
    slope = np.asarray(evaluate_numbers(rate, {**names, state: 1.0}), dtype=float) - start
    step = np.diff(time, prepend=time[0])
    twice = np.asarray(evaluate_numbers(rate, {**names, state: 2.0}), dtype=float)
    if not np.allclose(twice, start + 2.0 * slope, rtol=1e-9, atol=1e-12 * float(np.abs(slope).max() + 1e-300)):
        return _stepped(rate, state, names, step)
    reach = slope * step
    kept = np.exp(np.minimum(reach, 0.0))
    gained = np.where(np.abs(reach) > 1e-9, np.expm1(np.minimum(reach, 0.0)) / np.where(reach == 0, 1.0, reach), 1.0)
    pushed = gained * step * start
    found, value = np.zeros(len(time)), 0.0
    for k, (keep, push) in enumerate(zip(kept.tolist(), pushed.tolist(), strict=True)):
        value = keep * value + push
        found[k] = value
    return found


def _stepped(rate: str, state: str, names: Mapping[str, Any], step: np.ndarray) -> np.ndarray:
    """A memory (n,) with any other rate, by short steps of Euler's method."""
    used = [name for name in names if re.search(rf"\b{re.escape(name)}\b", rate)]
    symbols = {name: ca.SX.sym(name) for name in (state, *used)}
    dt, value = ca.SX.sym("dt"), symbols[state]
    for _ in range(SUBSTEPS):
        value = value + dt / SUBSTEPS * evaluate(rate, {**symbols, state: value})
    function = ca.Function("step", [symbols[state], ca.vertcat(dt, *(symbols[name] for name in used))], [value])
    rows = np.stack([step, *(np.broadcast_to(np.asarray(names[name], dtype=float), step.shape) for name in used)])
    return np.array(function.mapaccum(len(step))(0.0, rows)).ravel()
