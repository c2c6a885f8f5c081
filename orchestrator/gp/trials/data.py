"""Missing forces along trials as data of latent functions."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from orchestrator.gp.noise import added_noise
from orchestrator.gp.observations import Observation, observe
from orchestrator.gp.trials.places import Place
from orchestrator.measurements import BoundTrial
from orchestrator.models.missing_force import Force
from orchestrator.models.smoothing import SmoothedTrial

Array = NDArray[np.float64]
# Of what is missing on an output, so much is first thought to be no function of the inputs.
_NO_FUNCTION = 0.3


def smoothed(trials: Sequence[BoundTrial], noise: Array) -> list[SmoothedTrial]:
    """Trials with what their measurements show of motion."""
    return [SmoothedTrial(trial.time, trial.inputs, trial.outputs, noise) for trial in trials]


def table(places: Mapping[str, Place], forces: Sequence[Force], trials: Sequence[BoundTrial]) -> Array:
    """What is at these places at all samples of all trials, (n, places).

    Args:
        places: what is wanted, by name.
        forces: the missing forces along each trial.
        trials: the trials.
    """
    pairs = list(zip(forces, trials, strict=True))
    columns = [np.concatenate([place.along(force, trial) for force, trial in pairs]) for place in places.values()]
    return np.column_stack(columns) if columns else np.zeros((sum(len(f.time) for f in forces), 0))


def observation(
    k: int,
    forces: Sequence[Force],
    trials: Sequence[BoundTrial],
    points: Mapping[str, Place],
    factors: Mapping[str, Place],
    most: int,
) -> Observation:
    """The missing force on output k along all trials, at equal intervals, about `most` data.

    It is the sum of a function of the points and of one such function for each factor, times that factor (see `function_of`).

    Errors of a force are alike over its duration, in which several data may lie: their deviations grow so that all of them
    together say as much as one. What no function of the inputs explains is noise of the same kind, whose size is learnt.

    Args:
        k: number of the output, from 0.
        forces: the missing forces along each trial.
        trials: the trials.
        points: the inputs of the functions.
        factors: what each further function is multiplied with.
        most: number of data, about.
    """
    spacing = _spacing(forces, most)
    steps = max(spacing, float(np.median(np.diff(forces[0].time))))
    alike = float(np.sqrt(max(float(forces[0].duration[k]) / steps, 1.0)))
    chosen = np.concatenate([_every(spacing, force) for force in forces])
    output = forces[0].names[k]
    of: dict[str, Array] = {output: np.ones(int(chosen.sum()))}
    for name, column in zip(factors, table(factors, forces, trials).T, strict=True):
        of[function_of(output, name)] = column[chosen]
    values, spread = (np.concatenate([getattr(f, part)[:, k] for f in forces])[chosen] for part in ("mean", "std"))
    size = max(float(np.sqrt(np.mean(values**2))), 1e-12)
    noise = added_noise(spread * alike, _NO_FUNCTION * size * alike)
    return observe(output, table(points, forces, trials)[chosen], of, values, noise)


def trials_of(forces: Sequence[Force], most: int) -> NDArray[np.int64]:
    """The number of the trial, from 0, that each datum of `observation` is from."""
    spacing = _spacing(forces, most)
    return np.repeat(np.arange(len(forces)), [int(_every(spacing, force).sum()) for force in forces])


def states_and_inputs(forces: Sequence[Force], trials: Sequence[BoundTrial], most: int) -> tuple[Array, Array]:
    """The model's states (n, nx) and inputs (n, nu) at each datum of `observation`.

    Args:
        forces: the missing forces along each trial.
        trials: the trials.
        most: number of data, as for `observation`.
    """
    spacing = _spacing(forces, most)
    pairs = [(_every(spacing, force), force, trial) for force, trial in zip(forces, trials, strict=True)]
    return (
        np.concatenate([force.states[chosen] for chosen, force, _ in pairs]),
        np.concatenate([trial.inputs[chosen] for chosen, _, trial in pairs]),
    )


def function_of(output: str, factor: str) -> str:
    """The name of the latent function that a factor multiplies in what is missing on an output."""
    return f"{output}:{factor}" if factor else output


def _spacing(forces: Sequence[Force], most: int) -> float:
    """Seconds between data, so that there are about `most`."""
    return sum(float(force.time[-1] - force.time[0]) for force in forces) / most


def _every(spacing: float, force: Force) -> NDArray[np.bool_]:
    return np.diff(np.floor((force.time - force.time[0]) / spacing), prepend=-1.0) > 0.0
