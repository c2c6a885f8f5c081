"""What a physics model lacks along measured trials, learned as a block over its positions and speeds."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fmus.errors import MisfitError
from orchestrator.gp.block import Block, Output, Term
from orchestrator.gp.covariance import Latent
from orchestrator.gp.fit import fit
from orchestrator.gp.kernels import SquaredExponential
from orchestrator.gp.observations import Observation
from orchestrator.gp.posterior import condition
from orchestrator.gp.residual import corrections
from orchestrator.measurements import BoundSet, BoundTrial
from orchestrator.models.missing_force import Force, missing_forces
from orchestrator.models.smoothing import SmoothedTrial
from orchestrator.models.symbolic import SymbolicModel


@dataclass(frozen=True)
class Shortfall:
    """RMS of the force that is missing on an output along held-out trials, in `unit`: of the model, and with the block beside it."""

    output: str
    unit: str
    before: float
    after: float


@dataclass(frozen=True, eq=False)
class Learned:
    """A block with outputs `<signal>_missing`, the number of data it holds, and how it does on trials that it has not seen."""

    block: Block
    count: int
    held_out: tuple[Shortfall, ...]


def learn_missing(model: SymbolicModel, data: BoundSet, most: int = 300) -> Learned:
    """Learn the force that a model lacks on each measured output, as a function of its positions and speeds.

    Data are the missing forces along the learning trials (`missing_forces`); hyperparameters are those that make them most
    probable.

    Args:
        data: trials in the model's units; their outputs are those of `model`.
        most: data for each output; longer records are taken at longer intervals.

    Raises:
        MisfitError: if there are no learning trials, or the model does not show which force it lacks.
    """
    if not data.learning:
        raise MisfitError("there is no learning trial to learn from; name some in case.toml")
    noise = np.array([data.noise_std[name] for name in data.output_names])
    coordinates = _coordinates(model)
    names = [v.name for v in model.system.states]
    places = [names.index(state) for state in coordinates.values()]
    forces = missing_forces(model, _smoothed(data.learning, noise))
    observations = _observations(forces, data.learning, places, most)
    latents = {}
    for k, output in enumerate(forces[0].names):
        seen = np.concatenate([each.inputs for each in observations if output in each.coefficients])
        spread = np.where(np.ptp(seen, axis=0) > 0.0, np.std(seen, axis=0), 1.0)
        latents[output] = Latent(SquaredExponential(float(forces[0].size[k]) ** 2, tuple(map(float, spread))))
    best = fit(latents, observations)
    units = dict(zip(names, (v.unit for v in model.system.states), strict=True))
    outputs = [
        Output(f"{name}_missing", unit, (Term(name),))
        for name, unit in zip(forces[0].names, forces[0].units, strict=True)
    ]
    inputs = {name: units[state] for name, state in coordinates.items()}
    block = Block(condition(best.latents, best.observations), inputs, outputs, tuple(best.observations))
    held_out = missing_forces(model, _smoothed(data.held_out, noise)) if data.held_out else ()
    return Learned(block, sum(len(each.inputs) for each in observations), _shortfalls(block, held_out, places))


def _coordinates(model: SymbolicModel) -> dict[str, str]:
    """Names of a block's inputs, and the states that they are: each signal that is a position, then their speeds."""
    if model.residual is None:
        raise MisfitError(f"{model.name} does not show which force it lacks on {', '.join(model.signals)}")
    positions = model.residual.positions
    found = {signal: at.state for signal, at in positions.items()}
    return found | {f"{signal}_speed": at.speed for signal, at in positions.items() if at.speed is not None}


def _smoothed(trials: Sequence[BoundTrial], noise: NDArray[np.float64]) -> list[SmoothedTrial]:
    return [SmoothedTrial(trial.time, trial.inputs, trial.outputs, noise) for trial in trials]


def _observations(
    forces: Sequence[Force], trials: Sequence[BoundTrial], places: Sequence[int], most: int
) -> list[Observation]:
    """Observations of every trial at equal intervals, about `most` for each output.

    Errors of a force are alike over its duration, in which several data may lie: their deviations grow so that all of them
    together say as much as one.
    """
    spacing = sum(float(force.time[-1] - force.time[0]) for force in forces) / most
    found = []
    for force, trial in zip(forces, trials, strict=True):
        alike = np.sqrt(np.maximum(force.duration / max(spacing, float(np.median(np.diff(force.time)))), 1.0))
        found += corrections(trial.name, replace(force, std=force.std * alike), force.states[:, places], spacing)
    return found


def _shortfalls(block: Block, forces: Sequence[Force], places: Sequence[int]) -> tuple[Shortfall, ...]:
    found = []
    for k, output in enumerate(block.outputs if forces else ()):
        missing = np.concatenate([force.mean[:, k] for force in forces])
        states = np.concatenate([force.states[:, places] for force in forces])
        left = missing - block.posterior.mean(output.terms[0].latent, states)[:, 0]
        found.append(
            Shortfall(output.name, output.unit, *(float(np.sqrt(np.mean(part**2))) for part in (missing, left)))
        )
    return tuple(found)
