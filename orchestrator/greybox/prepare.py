"""Measured trials for the filter: first states as the record shows them, first guesses of the noise."""

from collections.abc import Sequence
from contextlib import suppress

import casadi as ca
import numpy as np

from fmus.errors import ComponentError
from fmus.symbolic.balances import Balance
from fmus.symbolic.system import SymbolicSystem
from orchestrator.greybox.extended import own_inputs
from orchestrator.greybox.filtering import GreyBox, Trial
from orchestrator.greybox.fit import Noise
from orchestrator.greybox.places import Seen
from orchestrator.greybox.thinning import thinned
from orchestrator.measurements import BoundTrial
from orchestrator.measurements.noise import rounding_error

# Samples from which a first speed is read.
FIRST = 8
# Steps towards states that give the first sample.
FIRST_STEPS = 6
DECADES = range(-4, 4)


def trials_of(
    bound: Sequence[BoundTrial], system: SymbolicSystem, signals: Sequence[str], balances: Sequence[Balance]
) -> list[Trial]:
    """Trials with mean and spread of the first states.

    A state that an output shows starts at what was measured, its rate at the slope of the first samples; both may be off by
    as much as they vary in the record, so that the first measurements decide. Others start as declared.

    Args:
        bound: trials in the model's units.
        system: the equations, with an input at each balance.
        signals: outputs that are measured.
        balances: the balances.
    """
    return [_trial(each, system, signals, balances) for each in bound]


def _trial(bound: BoundTrial, system: SymbolicSystem, signals: Sequence[str], balances: Sequence[Balance]) -> Trial:
    names = [v.name for v in system.states]
    start = np.array([v.start or 0.0 for v in system.states])
    spread = np.array([_spread(v) for v in system.states])
    speed_of = {b.position: b.state for b in balances if b.position}
    for k, (state, scale, offset) in shown_states(system, signals).items():
        series = (bound.outputs[:, k] - offset) / scale
        good = np.isfinite(series)
        values, time = series[good], bound.time[good]
        i = names.index(state)
        start[i], spread[i] = values[0], float(np.std(values)) or 1.0
        if state in speed_of:
            j = names.index(speed_of[state])
            part = slice(0, min(FIRST, len(values)))
            start[j] = np.polyfit(time[part] - time[0], values[part], 1)[0]
            spread[j] = float(np.std(np.diff(values) / np.diff(time))) or 1.0
    start = _at_first_sample(bound, system, signals, balances, start, spread)
    return Trial(bound.name, bound.time, bound.inputs, thinned(bound.outputs, bound.inputs), start, spread)


def _at_first_sample(
    bound: BoundTrial,
    system: SymbolicSystem,
    signals: Sequence[str],
    balances: Sequence[Balance],
    start: np.ndarray,
    spread: np.ndarray,
) -> np.ndarray:
    """States (nx,) that give the first sample, by Gauss and Newton's steps, each the shortest in units of `spread`."""
    x, u = ca.SX.sym("x", len(system.states)), np.zeros(len(system.inputs))
    given = own_inputs(system, balances)
    u[[k for k, v in enumerate(system.inputs) if v in given]] = bound.inputs[0]
    p = ca.DM([v.start or 0.0 for v in system.parameters])
    time, wanted = float(bound.time[0]), bound.outputs[0]
    d, _ = system.history(time, u, p)
    z = system.rhs(time, x, u, d, p)[1]
    values = {v.name: z[k] for k, v in enumerate(system.algebraics)} | {
        v.name: x[k] for k, v in enumerate(system.states)
    }
    shown = ca.vertcat(*(values[name] for name in signals))
    read = ca.Function("read", [x], [shown, ca.densify(ca.jacobian(shown, x))])
    found, seen = start, np.isfinite(wanted)
    for _ in range(FIRST_STEPS):
        here, slopes = (np.array(part) for part in read(found))
        step = spread * (np.linalg.pinv(slopes[seen] * spread, rcond=1e-6) @ (wanted - here.ravel())[seen])
        if not np.isfinite(step).all():
            return start
        found = found + step
    left = wanted[seen] - np.array(read(found)[0]).ravel()[seen]
    worse = np.abs(left) > np.abs(wanted - np.array(read(start)[0]).ravel())[seen] + 1e-12
    return start if worse.any() or not np.isfinite(left).all() else found


def _spread(variable: object) -> float:
    low, high, start, nominal = (getattr(variable, key) for key in ("minimum", "maximum", "start", "nominal"))
    if low is not None and high is not None:
        return 0.3 * (high - low)
    return abs(start) if start else float(nominal or 1.0)


def shown_states(system: SymbolicSystem, signals: Sequence[str]) -> dict[int, tuple[str, float, float]]:
    """By signal, the state that it reads, with scale and offset: signal = scale * state + offset."""
    t, d = ca.SX.sym("t"), ca.SX.sym("d", system.n_delays)
    x, u = ca.SX.sym("x", len(system.states)), ca.SX.sym("u", len(system.inputs))
    p = ca.DM([v.start or 0.0 for v in system.parameters])
    _, z = system.rhs(t, x, u, d, p)
    values = {v.name: z[i] for i, v in enumerate(system.algebraics)} | {
        v.name: x[i] for i, v in enumerate(system.states)
    }
    found = {}
    for k, name in enumerate(signals):
        slope = ca.simplify(ca.jacobian(values[name], x))
        entries = [i for i in range(len(system.states)) if not slope[0, i].is_zero()]
        if len(entries) == 1 and slope[0, entries[0]].is_constant():
            scale = float(slope[0, entries[0]])
            rest = ca.substitute(values[name], x, ca.DM.zeros(x.numel()))
            if rest.is_constant():
                found[k] = (system.states[entries[0]].name, scale, float(rest))
    return found


def least_noise(trials: Sequence[Trial]) -> np.ndarray:
    """A sensor is no better than its resolution or its last digits allow, (ny,)."""
    spread = np.nanstd(np.concatenate([t.measured for t in trials]), axis=0)
    columns = (
        [column[np.isfinite(column)] for column in each] for each in zip(*(t.measured.T for t in trials), strict=True)
    )
    rounding = [rounding_error(*(part for part in parts if part.size)) for parts in columns]
    return np.maximum(np.maximum(rounding, 1e-9 * spread), 1e-300)


def first_noise(box: GreyBox, trials: Sequence[Trial], balances: Sequence[Balance], theta: np.ndarray) -> Noise:
    """Noise that makes the record most probable among powers of ten: process noise from the size of the states' rates.

    Args:
        box: the model as given.
        trials: the trials.
        balances: its balances.
        theta: values (k,) of its free parameters.

    Raises:
        ComponentError: if the filter follows the trials with no noise that is tried.
    """
    sensors = white_noise([t.measured for t in trials])
    unit = _typical_intensity(box, trials, balances)
    tried: list[tuple[float, Noise]] = []
    for steps in (1, 4, 16):  # a stiff model fails with long steps
        for decade in DECADES:
            for louder in (1.0, 0.1):
                noise = Noise(unit * 10.0**decade, np.maximum(sensors * louder, 1e-300))
                with suppress(ComponentError):
                    runs = [box.run(t.in_steps(steps), theta, noise.intensity, noise.sensors) for t in trials]
                    tried.append((-sum(run.log_likelihood for run in runs), noise))
        if any(np.isfinite(cost) for cost, _ in tried):
            break
    likely = [pair for pair in tried if np.isfinite(pair[0])]
    if not likely:
        raise ComponentError(f"{box.system.name} cannot follow {trials[0].name}, whatever disturbs it")
    return min(likely, key=lambda pair: pair[0])[1]


def white_noise(measured: Sequence[np.ndarray]) -> np.ndarray:
    """Standard deviation of each signal's white noise (ny,), from trials (n, ny); of fast signals it is too large."""
    return np.array([_white(column) for column in np.concatenate(measured).T])


def _white(column: np.ndarray) -> float:
    """Standard deviation of white noise by third differences, which hardly see slow signals."""
    column = column[np.isfinite(column)]
    parts = np.diff(column, n=3) / np.sqrt(20.0)
    return float(np.median(np.abs(parts)) / 0.6745) or float(np.sqrt(np.mean(parts**2))) or 1e-12


def _typical_intensity(box: GreyBox, trials: Sequence[Trial], balances: Sequence[Balance]) -> np.ndarray:
    """What disturbs each balance about as much as its state moves, (nb,)."""
    system = box.system
    names = [v.name for v in system.states]
    found = []
    for balance in balances:
        j = names.index(balance.state)
        spread = np.mean([t.spread[j] for t in trials])
        duration = np.mean([np.ptp(t.time) for t in trials])
        gain = abs(_gain(box, trials[0], balance, j)) or 1.0
        found.append(spread / gain / np.sqrt(duration))
    return np.array(found)


def _gain(box: GreyBox, trial: Trial, balance: Balance, j: int) -> float:
    """By how much a unit of force changes the rate of its state, at the start."""
    system = box.system
    values = np.array(box.compiled.parameters)  # as declared: shapes of laws are no zeros
    moved = values.copy()
    moved[[v.name for v in system.parameters].index(balance.input)] = 1.0
    d, _ = system.history(trial.time[0], trial.inputs[0], values)
    start = np.concatenate([trial.start, np.zeros(len(system.states) - len(trial.start))])
    before, after = (
        np.array(system.rhs(trial.time[0], start, trial.inputs[0], d, p)[0]).ravel() for p in (values, moved)
    )
    return float((after - before)[j])


def seen_by(
    box: GreyBox, runs: Sequence[object], trials: Sequence[Trial], balances: Sequence[Balance], signals: Sequence[str]
) -> Seen:
    """Series of all variables as the filter shows them, and the size of the forces at each balance.

    Args:
        box: the model as given.
        runs: the filter along each trial.
        trials: the trials.
        balances: the model's balances.
        signals: names of what was measured, in the order of its columns.
    """
    system = box.system
    means = np.concatenate([run.mean for run in runs])  # type: ignore[attr-defined]
    values = {v.name: means[:, i] for i, v in enumerate(system.states)}
    inputs = np.concatenate([t.inputs for t in trials])
    values |= {v.name: inputs[:, i] for i, v in enumerate(system.inputs)}
    values |= {name: np.concatenate([t.measured[:, k] for t in trials]) for k, name in enumerate(signals)}
    values["time"] = np.concatenate([t.time for t in trials])
    forces = {}
    names = [v.name for v in system.states]
    for balance in balances:
        j = names.index(balance.state)
        rates = np.concatenate([_rate(run.mean[:, j], t.time) for run, t in zip(runs, trials, strict=True)])  # type: ignore[attr-defined]
        gain = abs(_gain(box, trials[0], balance, j)) or 1.0
        forces[balance.input] = float(np.sqrt(np.mean(rates**2))) / gain or 1.0
    return Seen(values, forces)


def _rate(series: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Rate of change (n,) over steps that may be very short."""
    even = np.linspace(time[0], time[-1], len(time))
    return np.gradient(np.interp(even, time, series), even)
