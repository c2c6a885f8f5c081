"""Whether two fitted sets are one model in other parameters: a further spring, and a wrong value of the one there is.

Equal likelihoods do not say so: where a shaft turned one way only, dry friction and a constant torque explain a record alike,
and are two models. So their equations are compared where the record has not been, too.
"""

import numpy as np

from orchestrator.greybox.search import FittedSet
from orchestrator.greybox.thresholds import Thresholds

# Random points at which equations are compared, how far beyond the record, and how near they are, as a share of what the effects do.
POINTS, BEYOND, NEAR = 64, 2.0, 0.05


def is_same_model(one: FittedSet, other: FittedSet, nominal: FittedSet, limits: Thresholds) -> bool:
    """Whether sets with as many parameters explain the record alike and change the rates and outputs of the model as given alike."""
    if one is other or one.counted != other.counted or not one.candidates:
        return False
    if abs(one.loss - other.loss) > limits.nats:
        return False
    states, inputs = _points(nominal)
    first, second, given = (_equations(each, states, inputs) for each in (one, other, nominal))
    if first is None or second is None or given is None:
        return False
    apart, change = (np.sqrt(np.mean(d**2, axis=0)) for d in (first - second, first - given))
    rounding = 1e-9 * np.sqrt(np.mean(given**2, axis=0))
    return bool(np.all(apart <= NEAR * change + rounding))


def _points(nominal: FittedSet) -> tuple[np.ndarray, np.ndarray]:
    """Random states (n, nx) and inputs (n, nu) around those of the record, and as far again on both sides of it."""
    random, fit = np.random.default_rng(0), nominal.fit
    found = []
    for series in (np.concatenate([run.mean for run in fit.runs]), np.concatenate([t.inputs for t in fit.trials])):
        reach = BEYOND * (np.ptp(series, axis=0) + np.abs(series).max(axis=0, initial=0.0))
        found.append(series.mean(axis=0) + reach * random.uniform(-0.5, 0.5, (POINTS, series.shape[1])))
    return found[0], found[1]


def _equations(found: FittedSet, states: np.ndarray, inputs: np.ndarray) -> np.ndarray | None:
    """Rates and outputs of a fitted set at some points, (n, nx + ny); None where the set has states of its own."""
    box = found.fit.box
    system = box.system
    if len(system.states) != states.shape[1]:
        return None
    values, parameters = np.array(box.compiled.parameters), [v.name for v in system.parameters]
    values[[parameters.index(name) for name in box.theta]] = found.fit.theta
    names = [v.name for v in (*system.states, *system.algebraics)]
    shown = [names.index(name) for name in box.compiled.outputs]
    rows = []
    for x, u in zip(states, inputs, strict=True):
        rates, algebraic = (np.array(part).ravel() for part in system.rhs(0.0, x, u, [0.0] * system.n_delays, values))
        rows.append([*rates, *np.concatenate([x, algebraic])[shown]])
    table = np.array(rows)
    return table if np.isfinite(table).all() else None
