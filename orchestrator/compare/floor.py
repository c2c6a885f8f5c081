"""The noise floor: the error that a perfect model would still show in a free run."""

from collections.abc import Mapping, Sequence

import numpy as np

from orchestrator.measurements import BoundSet, BoundTrial
from orchestrator.models.contract import FittedTrial, Model

DRAWS = 8


def noise_floor(
    model: Model, data: BoundSet, followed: Sequence[tuple[BoundTrial, FittedTrial]], *, seed: int = 0
) -> dict[str, float]:
    """Expected rmse of each signal if the model were right, in the signal's unit.

    Two independent parts add as squares: the sensor's own noise, and the noise of measured inputs (a force, say)
    carried through the model, estimated with `DRAWS` perturbed free runs of each given trial.
    """
    input_std = np.array([data.noise_std.get(name, 0.0) for name in data.input_names])
    sensor = np.array([data.noise_std[name] for name in data.output_names])
    carried = np.zeros(len(sensor))
    if np.any(input_std > 0):
        random = np.random.default_rng(seed)
        squares = [_carried_square(model, data, t, f, input_std, random) for t, f in followed for _ in range(DRAWS)]
        carried = np.sqrt(np.mean(squares, axis=0))
    return {name: float(np.hypot(sensor[i], carried[i])) for i, name in enumerate(data.output_names)}


def _carried_square(
    model: Model,
    data: BoundSet,
    trial: BoundTrial,
    followed: FittedTrial,
    input_std: np.ndarray,
    random: np.random.Generator,
) -> np.ndarray:
    noisy = trial.inputs + random.standard_normal(trial.inputs.shape) * input_std
    outputs = model.simulate(trial.time, noisy, data.output_names, followed.start)
    return np.mean((outputs - followed.outputs) ** 2, axis=0)


def over_floor(rmse: Mapping[str, float], floor: Mapping[str, float]) -> float:
    """Root mean square over signals of rmse / floor."""
    return float(np.sqrt(np.mean([(rmse[name] / floor[name]) ** 2 for name in rmse])))
