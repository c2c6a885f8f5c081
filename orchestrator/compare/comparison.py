"""Compare a model with measurements: free runs from estimated start values, against the noise floor."""

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import scipy

from orchestrator.compare.estimates import REFUTED, WITHIN_NOISE, FloorEstimate, estimate_floor, not_refuted
from orchestrator.compare.result import Comparison, SetErrors, TrialCurves, TrialErrors
from orchestrator.compare.where import findings, where_it_fails
from orchestrator.datacheck.check import check_data
from orchestrator.datacheck.findings import Finding
from orchestrator.datacheck.holding import with_interpolation
from orchestrator.measurements import BoundSet, BoundTrial, MeasurementSet, bind
from orchestrator.models.contract import FittedTrial, Model, with_held_inputs

DRAWS = 8
# Step of a start value, as a share of it (of its unit if it is smaller).
NUDGE = 1e-4


def noise_floor(
    model: Model, data: BoundSet, followed: Sequence[tuple[BoundTrial, FittedTrial]], *, seed: int = 0
) -> dict[str, float]:
    """Expected rmse of each signal if the model were right, in the signal's unit.

    Two independent parts add as squares: the sensor's own noise, and the noise of measured inputs (a force, say)
    carried through the model, estimated with `DRAWS` perturbed free runs of each given trial. A fit of the start values
    takes part of what is carried away, as far as they may be moved.

    Args:
        model: the model whose inputs carry noise.
        data: trials and the standard deviations of their columns' noise, in their units.
        followed: each trial with its free run; all of them are perturbed.
        seed: of the random perturbations.
    """
    sensor = np.array([data.noise_std[name] for name in data.output_names])
    carried = np.zeros(len(sensor))
    if any(data.noise_std.get(name, 0.0) > 0 for name in data.input_names):
        random = np.random.default_rng(seed)
        squares = [each for t, f in followed for each in _carried_squares(model, data, t, f, random)]
        carried = np.sqrt(np.mean(squares, axis=0))
    return {name: float(np.hypot(sensor[i], carried[i])) for i, name in enumerate(data.output_names)}


def _carried_squares(
    model: Model, data: BoundSet, trial: BoundTrial, followed: FittedTrial, random: np.random.Generator
) -> list[np.ndarray]:
    """Mean squares (ny,) of what each draw leaves once start values have been fitted to it, to first order."""
    noises = [data.noise_of(name) for name in data.input_names]
    sensor = np.array([data.noise_std[name] for name in data.output_names])
    slopes, reach = _start_slopes(model, data, trial, followed, sensor)
    found = []
    for _ in range(DRAWS):
        noisy = trial.inputs + np.column_stack([noise.draw((len(trial.time),), random) for noise in noises])
        outputs = model.simulate(trial.time, noisy, data.output_names, followed.start)
        change = ((outputs - followed.outputs) / sensor).ravel()
        if slopes.size:
            change = change - slopes @ scipy.optimize.lsq_linear(slopes, change, (-reach, reach)).x
        found.append(np.mean((change.reshape(outputs.shape) * sensor) ** 2, axis=0))
    return found


def _start_slopes(
    model: Model, data: BoundSet, trial: BoundTrial, followed: FittedTrial, sensor: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """What changes of the start values do to the outputs over their noise: columns (n ny, k) of length 1, and how far
    each may be moved (k,)."""
    columns, reach = [], []
    for state, value in followed.start.items():
        step = NUDGE * max(abs(value), 1.0)
        moved = {**followed.start, state: value + step}
        outputs = model.simulate(trial.time, trial.inputs, data.output_names, moved)
        column = ((outputs - followed.outputs) / (step * sensor)).ravel()
        length = float(np.linalg.norm(column))
        if length > 0:
            columns.append(column / length)
            reach.append(length * followed.reach.get(state, np.inf))
    return np.column_stack(columns) if columns else np.zeros((followed.outputs.size, 0)), np.array(reach)


def over_floor(rmse: Mapping[str, float], floor: Mapping[str, float]) -> float:
    """Root mean square over signals of rmse / floor."""
    return float(np.sqrt(np.mean([(rmse[name] / floor[name]) ** 2 for name in rmse])))


def within_noise(given: Comparison, factor: float, signals: Sequence[str] = ()) -> bool:
    """Whether free runs of the model as given leave no more than a factor times the noise floor of some signals, all of them by
    default, along trials of both kinds."""
    sides = [({s: e.rmse[s] for s in signals or e.rmse} if e else {}) for e in (given.learning, given.held_out)]
    return all(side and over_floor(side, given.noise_floor) <= factor for side in sides)


def error_left(before: Mapping[str, float], after: Mapping[str, float], floor: Mapping[str, float]) -> float:
    """Largest share of a signal's squared error beyond the noise that is left, 0 to 1; those within the noise leave none.

    >>> error_left({"x": 30.0, "p": 41.0}, {"x": 1.0, "p": 9.0}, {"x": 1.0, "p": 1.0})
    0.047619047619047616
    """
    beyond = (s for s in after if after[s] > WITHIN_NOISE * floor[s])
    return max((share_left(before[s] ** 2, after[s] ** 2, floor[s] ** 2) for s in beyond), default=0.0)


def share_left(before: float, after: float, noise: float) -> float:
    """Share of a squared error beyond the squared noise that is left, 0 to 1.

    >>> share_left(901.0, 10.0, 1.0), share_left(4.0, 9.0, 1.0), share_left(4.0, 0.5, 1.0)
    (0.01, 1.0, 0.0)
    """
    left = max(after - noise, 0.0)
    return left / max(before - noise, left, 1e-300)


def compare(
    model: Model,
    measurements: MeasurementSet,
    *,
    workers: int = 2,
    floor: Mapping[str, float] | None = None,
    checks: Sequence[Finding] | None = None,
) -> Comparison:
    """Run the model freely along every trial and measure its errors.

    Args:
        workers: number of trials that run at a time.
        floor: noise floor of each signal, in its unit; estimated with this model if not given.
        checks: what the data checks found; they are made if neither these nor the floor are given.

    Raises:
        MisfitError: if columns and variables do not fit each other.
        ComponentError: if the model fails while running.
    """
    measurements = with_interpolation(model, measurements)
    data = bind(measurements, model.inputs, model.outputs)
    model = with_held_inputs(model, data.trials[0].held)
    noise = np.array([data.noise_std[name] for name in data.output_names])

    def follow(trial: BoundTrial) -> FittedTrial:
        return model.follow(trial.time, trial.inputs, trial.outputs, data.output_names, noise)

    with ThreadPoolExecutor(workers) as pool:
        runs = list(pool.map(follow, data.trials))
    followed = list(zip(data.trials, runs, strict=True))
    if floor is None:
        floor = noise_floor(model, data, [pair for pair in followed if pair[0].subset == "learning"])
        estimates = estimate_floor(data, floor)
        found = summarise(model, measurements, data, followed, _used(estimates))
        kept = not_refuted(estimates, data.noise_std, found.learning.rmse)
        if kept != estimates:
            estimates, found = kept, summarise(model, measurements, data, followed, _used(kept))
        checks = check_data(model, measurements) if checks is None else checks
        return replace(found, noise_estimates=estimates, data_checks=tuple(checks))
    return summarise(model, measurements, data, followed, floor)


def _used(estimates: Mapping[str, FloorEstimate]) -> dict[str, float]:
    return {name: estimate.used for name, estimate in estimates.items()}


def is_refuted(found: Comparison) -> bool:
    """Whether free runs along learning trials leave far less of some signal than its noise floor."""
    return any(found.learning.rmse[name] < REFUTED * floor for name, floor in found.noise_floor.items())


def with_floor_of(
    better: Model, model: Model, given: Comparison, measurements: MeasurementSet, workers: int
) -> Comparison:
    """The comparison of a model, judged by a lower floor where a better model's free runs show that there is less noise.

    Args:
        better: the model with what was found in it. model: the model as it is, whose comparison, with its estimates, is `given`.

    Raises:
        MisfitError, ComponentError: as `compare`.
    """
    other = compare(better, measurements, workers=workers, checks=given.data_checks).noise_estimates
    estimates = {n: min(each, other[n], key=lambda e: e.used) for n, each in given.noise_estimates.items()}
    again = compare(model, measurements, workers=workers, floor=_used(estimates))
    return replace(again, noise_estimates=estimates, data_checks=given.data_checks)


def summarise(
    model: Model,
    measurements: MeasurementSet,
    data: BoundSet,
    followed: Sequence[tuple[BoundTrial, FittedTrial]],
    floor: Mapping[str, float],
) -> Comparison:
    """Arrange free runs that have been made into a comparison.

    Args:
        model: what was run.
        measurements: the whole record, with its notes.
        data: the record as the model reads it.
        followed: each trial with its free run, in the order of the record.
        floor: rms of each signal that a right model would leave, in the signal's unit.
    """
    declared = {variable.name: variable.unit for variable in model.outputs}
    units = {name: declared[name] for name in data.output_names}
    moving = _moving(data)
    curves = tuple(_curves(trial, run, data.output_names, moving) for trial, run in followed)
    learning = [c for c in curves if c.set == "learning"]
    held_out = [c for c in curves if c.set == "held_out"]
    where = where_it_fails(learning or curves, units, floor, {v.name: v.unit for v in model.inputs})
    return Comparison(
        model=model.name,
        data=str(measurements.path),
        signals=data.output_names,
        units=units,
        noise_floor=dict(floor),
        trials=tuple(_errors(c) for c in curves),
        learning=_set_errors(learning or list(curves), floor),
        held_out=_set_errors(held_out, floor) if held_out else None,
        where=where,
        findings=findings(where, floor),
        notes=(*measurements.notes, *data.notes),
        curves=curves,
        mended=measurements.mended,
    )


def _moving(data: BoundSet) -> dict[str, int]:
    """Inputs that move in some trial, with their places."""
    every = np.concatenate([t.inputs for t in data.trials])
    return {name: i for i, name in enumerate(data.input_names) if np.ptp(every[:, i]) > 0}


def _curves(trial: BoundTrial, run: FittedTrial, names: Sequence[str], inputs: Mapping[str, int]) -> TrialCurves:
    return TrialCurves(
        file=trial.name,
        set=trial.subset,
        time=trial.time,
        measured={name: trial.outputs[:, i] for i, name in enumerate(names)},
        modelled={name: run.outputs[:, i] for i, name in enumerate(names)},
        inputs={name: trial.inputs[:, i] for name, i in inputs.items()},
    )


def _errors(curve: TrialCurves) -> TrialErrors:
    rmse, fit_percent = {}, {}
    for name, measured in curve.measured.items():
        rmse[name] = float(np.sqrt(np.mean((measured - curve.modelled[name]) ** 2)))
        spread = float(np.std(measured))
        fit_percent[name] = 100 * (1 - rmse[name] / spread) if spread > 0 else 0.0
    return TrialErrors(curve.file, curve.set, rmse, fit_percent)


def _set_errors(curves: Sequence[TrialCurves], floor: Mapping[str, float]) -> SetErrors:
    rmse = {}
    for name in curves[0].measured:
        squares = np.concatenate([(c.measured[name] - c.modelled[name]) ** 2 for c in curves])
        rmse[name] = float(np.sqrt(np.mean(squares)))
    return SetErrors(rmse, over_floor(rmse, floor))
