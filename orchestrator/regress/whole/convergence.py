"""Shorter communication steps change less and less."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from orchestrator.cosim.system import System
from orchestrator.regress.case import Case
from orchestrator.regress.comparison import Signal
from orchestrator.regress.outcome import WholeVerdict
from orchestrator.regress.prepare import system_of
from orchestrator.regress.recording import record, wanted_signals
from orchestrator.regress.watched import Watched

# Differences below this share of the range are those of the FMU's own solver.
_ROUNDING = 1e-7


def judge(case: Case, system: System, settings: Mapping[str, Any], progress: Watched) -> WholeVerdict:
    """Halve the step so many times; the last halving may change no output by more than a share of its range.

    The order is log2 of the ratio of two successive changes, nan where they are as small as the FMU's own errors.
    """
    step, halvings = system.run.step, max(2, settings["halvings"])
    assert step is not None
    wanted, _ = wanted_signals(system)
    runs = []
    for k in range(halvings + 1):
        finer = system_of(replace(case, step=step / 2**k))
        runs.append(record(finer, wanted, progress).signals)
    figures: dict[str, Any] = {}
    worst = ("", 0.0, math.nan)
    for name in wanted.addresses:
        changes = [_change(runs[k][name], runs[k + 1][name], 2**k) for k in range(halvings)]
        figures[name] = {"changes": changes, "order": _order(changes)}
        grows = changes[-1] > 1.5 * changes[0] + _ROUNDING
        if grows or changes[-1] > worst[1] or not math.isfinite(changes[-1]):
            worst = (name, math.inf if grows or not math.isfinite(changes[-1]) else changes[-1], _order(changes))
        if grows:
            words = f"{name} changes by {_shares(changes)} of its range as the step is halved from {step:g} s: it does not settle"
            return WholeVerdict("convergence", False, words, figures)
    name, change, order = worst
    smallest = step / 2**halvings
    words = f"the last halving, to {smallest:g} s, changes {name or 'nothing'} most: by {change:.3g} of its range"
    words += f" (order {order:.2g})" if math.isfinite(order) else ""
    if change > settings["within"]:
        return WholeVerdict("convergence", False, f"{words}; at most {settings['within']:g} is allowed", figures)
    return WholeVerdict("convergence", True, words, figures)


def _change(coarse: Signal, fine: Signal, stride: int) -> float:
    """Largest difference at the points of the coarsest run, as a share of the range."""
    one, other = coarse.values[::stride], fine.values[:: 2 * stride]
    count = min(len(one), len(other))
    size = float(np.ptp(other)) or float(np.abs(other).max(initial=0.0)) or 1.0
    return float(np.abs(one[:count] - other[:count]).max(initial=0.0)) / size


def _order(changes: Sequence[float]) -> float:
    if not (changes[-1] > _ROUNDING and changes[-2] > 0.0):
        return math.nan
    return math.log2(changes[-2] / changes[-1])


def _shares(changes: Sequence[float]) -> str:
    return ", ".join(f"{change:.2g}" for change in changes)
