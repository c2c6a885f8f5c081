"""Wrong values that only events show: the threshold of a switch, the gain of a sampled controller.

They are in no equation, so no slope tells them; but they say when events come and what they set. The record is read again with
other values, one at a time, and the likelihood of the model as given says which is right.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize_scalar

from fmus.errors import ComponentError
from orchestrator.greybox.effects import Z90
from orchestrator.greybox.evidence import Case, filtered_states
from orchestrator.greybox.kept import event_parameters, with_events, with_value
from orchestrator.greybox.prepare import trials_of
from orchestrator.greybox.search import FittedSet
from orchestrator.verdicts.result import Estimate, NamedEffect

# Shares by which a value is tried to be off, up and down; the best one is found within a share of it.
SHARES, CLOSE = (0.001, 0.003, 0.01, 0.03, 0.1, 0.3), 0.01
# By what share of itself a share may be another when it is looked at again.
AGAIN = 0.5


def event_value(case: Case, nominal: FittedSet, nats: float) -> NamedEffect | None:
    """The value that makes the record most probable beside the model as given, if it is off beyond doubt; None without one.

    Args:
        case: the model beside its trials.
        nominal: the model as given, fitted.
        nats: what a value has to bring, beside the price of a parameter.
    """
    best: tuple[float, str, float] | None = None
    for name in event_parameters(case.base):
        share, value = _least(_cost(case, case, nominal, name))
        if best is None or value < best[0]:
            best = value, name, share
    if best is None or nominal.cost - best[0] < nats + nominal.price:
        return None
    _, name, share = best
    return _effect(name, share, 0.0)


def refined(case: Case, changed: Case, nominal: FittedSet) -> NamedEffect:
    """The value with its uncertainty, by the states and the noise that the model shows with the first one.

    Args:
        case: the model as given beside its trials.
        changed: the model with the first value.
        nominal: that, fitted.
    """
    first = changed.changed[-1]
    share = first.parameters["share"].value
    cost = _cost(case, changed, nominal, first.site)
    bounds = sorted((share * (1 - AGAIN), share * (1 + AGAIN)))
    found = minimize_scalar(cost, bounds=bounds, method="bounded", options={"xatol": CLOSE * AGAIN * abs(share)})
    return _effect(first.site, float(found.x), _deviation(cost, float(found.x), float(found.fun)))


def _effect(name: str, share: float, std: float) -> NamedEffect:
    return NamedEffect("parameter_error", name, {"share": Estimate(share, "1", (share - Z90 * std, share + Z90 * std))})


def _cost(case: Case, about: Case, nominal: FittedSet, name: str) -> Callable[[float], float]:
    """Minus the log likelihood of the learning trials by the share that a value is off from the model of a case, with states
    `about` which events are read, and the noise of the nominal fit there."""
    assert case.recorded is not None
    whole, recorded = (replace(data, trials=data.learning) for data in (about.data, case.recorded))
    states = filtered_states(replace(about, data=whole))
    balances = [b.input for b in case.balances]
    fit = nominal.fit
    steps = int(max(t.parts.max() for t in fit.trials))

    def cost(share: float) -> float:
        base = with_value(case.base, name, share)
        try:
            data = with_events(base, balances, recorded, whole, states)
            trials = trials_of(data.trials, case.base, case.signals, case.balances)
            runs = [
                fit.box.run(t.in_steps(steps), fit.theta, noise.intensity, noise.sensors)
                for t, noise in zip(trials, fit.noise, strict=True)
            ]
        except ComponentError:
            return np.inf
        return -sum(run.log_likelihood for run in runs)

    return cost


def _least(cost: Callable[[float], float]) -> tuple[float, float]:
    """The share with the least cost, and that."""
    shares = sorted([0.0, *(sign * size for size in SHARES for sign in (-1, 1))])
    costs = [cost(share) for share in shares]
    k = int(np.argmin(costs))
    bounds = shares[max(k - 1, 0)], shares[min(k + 1, len(shares) - 1)]
    found = minimize_scalar(
        cost, bounds=bounds, method="bounded", options={"xatol": CLOSE * max(abs(shares[k]), SHARES[0])}
    )
    return (float(found.x), float(found.fun)) if found.fun < costs[k] else (float(shares[k]), float(costs[k]))


def _deviation(cost: Callable[[float], float], share: float, value: float) -> float:
    """Standard deviation of a share, by the parabola through its likelihood and one that is a nat less or more."""
    step = CLOSE * abs(share)
    while step < abs(share):
        risen = 0.5 * (cost(share + step) + cost(share - step)) - value
        if risen > 1.0:
            return step / float(np.sqrt(2.0 * risen))
        step *= 2.0
    return step
