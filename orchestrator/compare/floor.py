"""The noise floor: the error that a perfect model would still show in a free run."""

from collections.abc import Mapping, Sequence

import numpy as np

from orchestrator.measurements import BoundSet, BoundTrial
from orchestrator.models.contract import FittedTrial, Model

DRAWS = 8
# Step of a start value, as a share of it (of its unit if it is smaller), and a slope that counts as none.
NUDGE = 1e-4
NEGLIGIBLE = 1e-6


def noise_floor(
    model: Model, data: BoundSet, followed: Sequence[tuple[BoundTrial, FittedTrial]], *, seed: int = 0
) -> dict[str, float]:
    """Expected rmse of each signal if the model were right, in the signal's unit.

    Two independent parts add as squares: the sensor's own noise, and the noise of measured inputs (a force, say)
    carried through the model, estimated with `DRAWS` perturbed free runs of each given trial. A fit of the start values
    takes part of what is carried away, nearly all of it where the model integrates its inputs.
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
    input_std = np.array([data.noise_std.get(name, 0.0) for name in data.input_names])
    sensor = np.array([data.noise_std[name] for name in data.output_names])
    basis = _start_basis(model, data, trial, followed, sensor)
    found = []
    for _ in range(DRAWS):
        noisy = trial.inputs + random.standard_normal(trial.inputs.shape) * input_std
        outputs = model.simulate(trial.time, noisy, data.output_names, followed.start)
        change = ((outputs - followed.outputs) / sensor).ravel()
        left = change - basis @ (basis.T @ change)
        found.append(np.mean((left.reshape(outputs.shape) * sensor) ** 2, axis=0))
    return found


def _start_basis(
    model: Model, data: BoundSet, trial: BoundTrial, followed: FittedTrial, sensor: np.ndarray
) -> np.ndarray:
    """Orthonormal columns (n ny, k): what small changes of the start values do to the outputs over their noise."""
    columns = []
    for state, value in followed.start.items():
        step = NUDGE * max(abs(value), 1.0)
        moved = {**followed.start, state: value + step}
        outputs = model.simulate(trial.time, trial.inputs, data.output_names, moved)
        columns.append(((outputs - followed.outputs) / (step * sensor)).ravel())
    if not columns:
        return np.zeros((followed.outputs.size, 0))
    left, singular, _ = np.linalg.svd(np.column_stack(columns), full_matrices=False)
    return left[:, singular > NEGLIGIBLE * singular[0]]


def over_floor(rmse: Mapping[str, float], floor: Mapping[str, float]) -> float:
    """Root mean square over signals of rmse / floor."""
    return float(np.sqrt(np.mean([(rmse[name] / floor[name]) ** 2 for name in rmse])))
