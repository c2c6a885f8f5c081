"""What a physics model lacks along measured trials, learned as a block over its positions, speeds and drives."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fmus.errors import MisfitError
from orchestrator.gp.block import Block, Output, Term
from orchestrator.gp.covariance import Latents
from orchestrator.gp.observations import Observation
from orchestrator.gp.posterior import condition
from orchestrator.gp.trials.data import observation, smoothed, states_and_inputs, table, trials_of
from orchestrator.gp.trials.functions import Verdict, needed_functions
from orchestrator.gp.trials.judged import Fold, Judgement, judge
from orchestrator.gp.trials.own_effect import Share, shares
from orchestrator.gp.trials.places import MISSING, Place, coordinates, drives, places_of
from orchestrator.measurements import BoundSet, BoundTrial
from orchestrator.models.missing_force import Force, missing_forces
from orchestrator.models.symbolic import SymbolicModel

Array = NDArray[np.float64]
# Cross-validation leaves out every learning trial once, together with others where there are more than so many.
MOST_FOLDS = 4


@dataclass(frozen=True)
class Shortfall:
    """RMS of the force that is missing on an output along held-out trials, in `unit`: of the model, and with the block
    beside it."""

    output: str
    unit: str
    before: float
    after: float


@dataclass(frozen=True, eq=False)
class Learned:
    """A block with outputs `<signal>_missing`, the number of data it holds, and how it does on trials that it has not seen.

    `block` is None where it was refused, and holds shares of what was learned where it was shrunk (see `judgement`,
    None without held-out trials). `functions` says of each latent function whether the data need it, `shares` which of
    these are a share of what the model itself lets their input do.
    """

    block: Block | None
    count: int
    held_out: tuple[Shortfall, ...]
    functions: tuple[Verdict, ...]
    judgement: Judgement | None
    shares: tuple[Share, ...] = ()


def learn_missing(
    model: SymbolicModel, data: BoundSet, most: int = 300, factors: Sequence[str] | None = None
) -> Learned:
    """Learn the force that a model lacks on each measured output: f(positions, speeds) + sum of factor times a function
    of them.

    Data are the missing forces along the learning trials (`missing_forces`); hyperparameters are those that make them most
    probable; functions that the data do not need are left out; the block is judged by free runs along the held-out trials.

    Args:
        data: trials in the model's units; their outputs are those of `model`.
        most: data for each output; longer records are taken at longer intervals.
        factors: inputs of the model, such as activations; all that move in the trials if left out.

    Raises:
        MisfitError: if there are no learning trials, the model does not show which force it lacks, or a factor is not there.
    """
    if not data.learning:
        raise MisfitError("there is no learning trial to learn from; name some in case.toml")
    model = model.with_held(data.trials[0].held)
    noise = np.array([data.noise_std[name] for name in data.output_names])
    points = coordinates(model, data.learning)
    chosen = drives(model, data.learning, points) if factors is None else places_of(model, factors)
    forces = missing_forces(model, smoothed(data.learning, noise))
    latents: Latents = {}
    kept: list[Observation] = []
    verdicts: list[Verdict] = []
    own: list[Share] = []
    at = states_and_inputs(forces, data.learning, most)
    for k, output in enumerate(forces[0].names):
        fitted, said = needed_functions(observation(k, forces, data.learning, points, chosen, most), output)
        verdicts += said
        own += shares(model, fitted, [each for each in said if each.needed], *at)
        if any(each.needed for each in said):
            latents = {**latents, **fitted.latents}
            kept += fitted.observations
    units = dict(zip(forces[0].names, forces[0].units, strict=True))
    block = _block(latents, kept, {name: place.unit(model) for name, place in points.items()}, units) if kept else None
    count = sum(len(each.inputs) for each in kept)
    if not data.held_out:
        return Learned(block, count, (), tuple(verdicts), None, tuple(own))
    folds = cross_validation(block, data.learning, trials_of(forces, most)) if block is not None else ()
    judgement = judge(model, block, data.held_out, noise, folds)
    used = _shared(block, judgement) if block is not None else None
    left = missing_forces(model, smoothed(data.held_out, noise))
    return Learned(used, count, _shortfalls(used, left, data, points, chosen), tuple(verdicts), judgement, tuple(own))


def _block(latents: Latents, kept: Sequence[Observation], inputs: dict[str, str], units: dict[str, str]) -> Block:
    outputs = []
    for each in kept:
        terms = (Term(name, 1.0, name.removeprefix(each.name).removeprefix(":")) for name in each.coefficients)
        outputs.append(Output(each.name + MISSING, units[each.name], tuple(terms)))
    return Block(condition(latents, kept), inputs, outputs, tuple(kept))


def cross_validation(block: Block, trials: Sequence[BoundTrial], of_row: NDArray[np.int64]) -> list[Fold]:
    """Blocks with the same hyperparameters, each without the data of some trials, and these trials.

    One trial alone leaves nothing to learn from without it: there the block is asked about what it has seen.

    Args:
        block: learned from all trials.
        trials: the trials.
        of_row: number of the trial of each row of data, from 0.
    """
    if len(trials) < 2:
        return [(block, trials)]
    groups = [np.arange(len(trials))[k :: min(MOST_FOLDS, len(trials))] for k in range(min(MOST_FOLDS, len(trials)))]
    found: list[Fold] = []
    for left_out in groups:
        rest = tuple(each.rows(~np.isin(of_row, left_out)) for each in block.observations)
        made = replace(block, posterior=condition(block.posterior.latents, rest), observations=rest)
        found.append((made, [trials[k] for k in left_out]))
    return found


def _shared(block: Block, judgement: Judgement) -> Block | None:
    """The block with the shares of its outputs that were judged to help."""
    outputs = [
        replace(o, terms=tuple(replace(term, factor=share) for term in o.terms))
        for o in block.outputs
        if (share := judgement.shares.get(o.name, 0.0)) > 0.0
    ]
    return replace(block, outputs=outputs) if outputs else None


def _shortfalls(
    block: Block | None, forces: Sequence[Force], data: BoundSet, points: dict[str, Place], factors: dict[str, Place]
) -> tuple[Shortfall, ...]:
    x, a = table(points, forces, data.held_out), table(factors, forces, data.held_out)
    outputs = {} if block is None else {o.name: o for o in block.outputs}
    found = []
    for k, name in enumerate(forces[0].names):
        missing = np.concatenate([force.mean[:, k] for force in forces])
        expected = np.zeros(len(missing))
        if block is not None and name + MISSING in outputs:
            places = list(factors)
            of = {
                term.latent: term.factor * (a[:, places.index(term.input)] if term.input else np.ones(len(x)))
                for term in outputs[name + MISSING].terms
            }
            expected = block.posterior.mean(of, x)[:, 0]
        before, after = (float(np.sqrt(np.mean(part**2))) for part in (missing, missing - expected))
        found.append(Shortfall(name + MISSING, forces[0].units[k], before, after))
    return tuple(found)
