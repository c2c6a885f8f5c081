"""The picture of the missing force: its size over the coordinate that explains it best, with the fitted law through it."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from fmus.symbolic.balances import Balance
from orchestrator.greybox.evidence import Case
from orchestrator.greybox.expression import evaluate_numbers
from orchestrator.greybox.filtering import Filtered, GreyBox, Trial
from orchestrator.greybox.fit import Fit
from orchestrator.greybox.memory import memories
from orchestrator.greybox.places import along, coordinate
from orchestrator.greybox.search import FittedSet

BINS = 30
Z90 = 1.645


@dataclass(frozen=True)
class Witness:
    """A missing force by bins of a coordinate: mean, half width of its 90 % band, and the mean of the fitted law there."""

    balance: str
    unit: str
    coordinate: str
    coordinate_unit: str
    x: tuple[float, ...]
    force: tuple[float, ...]
    band: tuple[float, ...]
    law: tuple[float, ...]


def witnesses(case: Case, nominal: FittedSet, chosen: FittedSet) -> tuple[Witness, ...]:
    """One picture for each balance that the chosen set acts on, or for all if it acts on none.

    Args:
        case: the model beside its trials.
        nominal: the model as given, fitted.
        chosen: the set that was chosen.
    """
    touched = {name for c in chosen.candidates for name in c.place.adds}
    shown = [b for b in case.balances if b.input in touched] or list(case.balances)
    return tuple(found for b in shown if (found := _witness(case, nominal, chosen, b)) is not None)


def _witness(case: Case, nominal: FittedSet, chosen: FittedSet, balance: Balance) -> Witness | None:
    rows = [_forces(case, nominal.fit, chosen, k, balance) for k in range(len(nominal.fit.trials))]
    force, law = (np.concatenate([row[i] for row in rows]) for i in (0, 1))
    series = {name: np.concatenate([row[2][name] for row in rows]) for name in rows[0][2]}
    good = np.isfinite(force)
    if np.count_nonzero(good) < 2 * BINS:
        return None
    name = max(series, key=lambda key: _explained(series[key][good], force[good]))
    x, values, laws = series[name][good], force[good], law[good]
    edges = np.unique(np.quantile(x, np.linspace(0, 1, BINS + 1)))
    place = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, max(len(edges) - 2, 0))
    bins = [place == k for k in np.unique(place)]
    units = {v.name: v.unit or "1" for v in (*case.base.algebraics, *case.base.states, *case.inputs)}
    units |= {"time": "s"}
    return Witness(
        balance.position or balance.state,
        balance.unit or "1",
        name,
        units.get(name, "1"),
        tuple(float(x[b].mean()) for b in bins),
        tuple(float(values[b].mean()) for b in bins),
        tuple(float(Z90 * values[b].std() / np.sqrt(b.sum())) for b in bins),
        tuple(float(laws[b].mean()) for b in bins),
    )


def _explained(x: np.ndarray, force: np.ndarray) -> float:
    """Share of a force's variance that its means over bins of a coordinate explain."""
    edges = np.unique(np.quantile(x, np.linspace(0, 1, BINS + 1)))
    if len(edges) < 3:
        return 0.0
    place = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, len(edges) - 2)
    counts = np.bincount(place, minlength=len(edges) - 1)
    means = np.bincount(place, weights=force, minlength=len(edges) - 1) / np.maximum(counts, 1)
    return float(np.var(means[place]) / max(float(np.var(force)), 1e-300))


def _forces(
    case: Case, fit: Fit, chosen: FittedSet, number: int, balance: Balance
) -> tuple[np.ndarray, np.ndarray, dict[str, np.ndarray]]:
    """The force that disturbs a balance of the model as given, the chosen law's value, and the coordinates, all (n - 1,)."""
    trial, noise = fit.trials[number], fit.noise[number]
    run = fit.box.run(trial, fit.theta, noise.intensity, noise.sensors, slopes=False, covariances=True)
    states = _smoothed(run)
    nx = len(case.base.states)
    push = _push(fit.box, trial, states, balance)
    assert run.transition is not None
    ahead = run.ahead[1:] + np.einsum("kij,kj->ki", run.transition[1:], states[:-1] - run.mean[:-1])
    step = np.diff(trial.time)
    gap = (states[1:] - ahead)[:, :nx]
    reach = push * step[:, None]
    force = np.einsum("ki,ki->k", gap, reach) / np.maximum(np.einsum("ki,ki->k", reach, reach), 1e-300)
    force[~np.isfinite(force) | (step < 1e-3 * np.median(step))] = np.nan
    middle = 0.5 * (states[1:] + states[:-1])
    series = {v.name: middle[:, i] for i, v in enumerate(case.base.states)}
    series |= {v.name: trial.inputs[1:, i] for i, v in enumerate(case.inputs)}
    asked = {text for c in chosen.candidates for text in c.place.coordinates.values()}
    series |= {name: values for name, values in along(case.base, middle).items() if name in asked}
    series["time"] = trial.time[1:]
    return force, _law(chosen, trial, middle, case, balance, _rates(fit.box, trial, middle)), series


def _push(box: GreyBox, trial: Trial, states: np.ndarray, balance: Balance) -> np.ndarray:
    """Rates (n - 1, nx) that a unit of force gives."""
    system = box.system
    values = box.compiled.with_values(np.zeros(len(box.compiled.free)))
    moved = values.copy()
    moved[[v.name for v in system.parameters].index(balance.input)] = 1.0
    rates = system.rhs.map(len(states) - 1)
    delayed = np.zeros((system.n_delays, len(states) - 1))
    given = (trial.time[None, :-1], states[:-1].T, trial.inputs[:-1].T, delayed)
    one, other = (np.array(rates(*given, np.tile(p[:, None], (1, len(states) - 1)))[0]) for p in (moved, values))
    return (one - other).T


def _rates(box: GreyBox, trial: Trial, states: np.ndarray) -> np.ndarray:
    """Rates (n - 1, nx) of the model as given."""
    n, p = len(states), box.compiled.with_values(np.zeros(len(box.compiled.free)))
    given = (trial.time[None, :-1], states.T, trial.inputs[:-1].T, np.zeros((box.system.n_delays, n)))
    return np.array(box.system.rhs.map(n)(*given, np.tile(p[:, None], (1, n)))[0]).T


def _law(
    chosen: FittedSet, trial: Trial, states: np.ndarray, case: Case, balance: Balance, rates: np.ndarray
) -> np.ndarray:
    """What the chosen set adds to a balance along states (n - 1, nx), at which the model has these rates."""
    own = [v.name for v in case.base.states].index(balance.state)
    known = along(case.base, states) | {v.name: states[:, i] for i, v in enumerate(case.base.states)}
    known |= {v.name: trial.inputs[1:, i] for i, v in enumerate(case.inputs)} | {"time": trial.time[1:]}
    total = np.zeros(len(states))
    for candidate in chosen.candidates:
        factor = candidate.place.adds.get(balance.input)
        if factor is not None:
            names: dict[str, Any] = {k: coordinate(text, known) for k, text in candidate.place.coordinates.items()}
            names |= {p.name: chosen.value(candidate, p.name)[0] for p in candidate.law.parameters}
            names["storage"] = candidate.place.storage or 0.0
            names["net"] = names["storage"] * rates[:, own]
            names |= memories(candidate.law.states, names, trial.time[1:])
            total = total + factor * evaluate_numbers(candidate.law.expression, names)
    return total


def _smoothed(run: Filtered) -> np.ndarray:
    """States given the whole trial, (n, nx), by Rauch, Tung and Striebel (AIAA J. 3, 1965)."""
    assert run.transition is not None and run.covariance is not None and run.ahead_covariance is not None
    states = run.mean.copy()
    for k in range(len(states) - 2, -1, -1):
        gain = run.covariance[k] @ run.transition[k + 1].T @ np.linalg.pinv(run.ahead_covariance[k + 1], hermitian=True)
        states[k] += gain @ (states[k + 1] - run.ahead[k + 1])
    return states
