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
# A gain that enters linearly near zero only is looked at there, at this share of its scale.
LINEAR = 1e-6


def force(candidate: Candidate, coordinates: Mapping[str, np.ndarray], time: np.ndarray) -> np.ndarray:
    """The force (n,) of a law per unit of its one gain, along coordinates (n,).

    Args:
        candidate: the law at its place, with its shapes.
        coordinates: what the law depends on, by its names for them.
        time: in s.
    """
    names: dict[str, Any] = dict(coordinates) | dict(candidate.shapes)
    names |= memories(candidate.law.states, names, time)
    (gain,) = candidate.gains
    unit = LINEAR * gain.scale(candidate.place.scales) if candidate.law.curved else 1.0
    values = evaluate_numbers(candidate.law.expression, names | {gain.name: unit})
    return np.broadcast_to(np.asarray(values, dtype=float) / unit, time.shape)


def memories(states: Mapping[str, str], names: Mapping[str, Any], time: np.ndarray) -> dict[str, np.ndarray]:
    """The states (n,) of a law, by name, that begin at zero.

    Args:
        states: rate of each state, as an expression.
        names: what the rates depend on: numbers, or series (n,).
        time: (n,) in s.
    """
    if len(states) == 1:
        return {state: remembered(rate, state, names, time) for state, rate in states.items()}
    return _stepped(states, names, np.diff(time, prepend=time[0])) if states else {}


def remembered(rate: str, state: str, names: Mapping[str, Any], time: np.ndarray) -> np.ndarray:
    """A memory (n,) that begins at zero: where its rate is a + b * memory, by the exact step for constant a and b.

    Args:
        rate: rate of the memory, as an expression.
        state: name of the memory in it.
        names: what the rate depends on: numbers, or series (n,).
        time: (n,) in s.
    """
    start = np.broadcast_to(np.asarray(evaluate_numbers(rate, {**names, state: 0.0}), dtype=float), time.shape)
    slope = np.asarray(evaluate_numbers(rate, {**names, state: 1.0}), dtype=float) - start
    step = np.diff(time, prepend=time[0])
    twice = np.asarray(evaluate_numbers(rate, {**names, state: 2.0}), dtype=float)
    if not np.allclose(twice, start + 2.0 * slope, rtol=1e-9, atol=1e-12 * float(np.abs(slope).max() + 1e-300)):
        return _stepped({state: rate}, names, step)[state]
    reach = slope * step
    kept = np.exp(np.minimum(reach, 0.0))
    gained = np.where(np.abs(reach) > 1e-9, np.expm1(np.minimum(reach, 0.0)) / np.where(reach == 0, 1.0, reach), 1.0)
    pushed = gained * step * start
    found, value = np.zeros(len(time)), 0.0
    for k, (keep, push) in enumerate(zip(kept.tolist(), pushed.tolist(), strict=True)):
        value = keep * value + push
        found[k] = value
    return found


def _stepped(states: Mapping[str, str], names: Mapping[str, Any], step: np.ndarray) -> dict[str, np.ndarray]:
    """Memories (n,) with any other rates, by short steps of Euler's method, each state with the new value of those before it."""
    rates = " ".join(states.values())
    used = [name for name in names if name not in states and re.search(rf"\b{re.escape(name)}\b", rates)]
    symbols = {name: ca.SX.sym(name) for name in (*states, *used)}
    dt, values = ca.SX.sym("dt"), {state: symbols[state] for state in states}
    for _ in range(SUBSTEPS):
        for state, rate in states.items():
            values[state] += dt / SUBSTEPS * evaluate(rate, {**symbols, **values})
    before = ca.vertcat(*(symbols[state] for state in states))
    given = ca.vertcat(dt, *(symbols[name] for name in used))
    function = ca.Function("step", [before, given], [ca.vertcat(*values.values())])
    rows = np.stack([step, *(np.broadcast_to(np.asarray(names[name], dtype=float), step.shape) for name in used)])
    found = np.array(function.mapaccum(len(step))(np.zeros(len(states)), rows))
    return dict(zip(states, found, strict=True))
