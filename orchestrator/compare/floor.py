"""The noise floor: the error that a perfect model would still show in a free run."""

from collections.abc import Mapping, Sequence

import numpy as np
import scipy

from orchestrator.measurements import BoundSet, BoundTrial
from orchestrator.models.contract import FittedTrial, Model

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
