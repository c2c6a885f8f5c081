"""A block learned from columns of numbers: inputs in, outputs out, hyperparameters fitted."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from fmus.errors import MisfitError
from orchestrator.gp.block import Block, Output, Term
from orchestrator.gp.covariance import Latent
from orchestrator.gp.integrated import fit_for_intervals
from orchestrator.gp.kernels import Kernel, Matern32, Matern52, SquaredExponential
from orchestrator.gp.noise import constant_noise
from orchestrator.gp.observations import observe
from orchestrator.gp.robust import trusted
from orchestrator.gp.sparse import EXACT, conditioned
from orchestrator.measurements.load import load_records
from orchestrator.measurements.trial import Array, Record
from orchestrator.measurements.wording import nearest

KERNELS: dict[str, Callable[[float, tuple[float, ...]], Kernel]] = {
    "squared_exponential": SquaredExponential,
    "matern32": Matern32,
    "matern52": Matern52,
}
# First guess of the noise, as a share of the spread of an output.
_NOISE_SHARE = 0.1


def learned_block(
    inputs: Mapping[str, Array],
    outputs: Mapping[str, Array],
    units: Mapping[str, str],
    kernel: str,
    noise: Mapping[str, float],
    outliers: bool = False,
    seed: int = 0,
) -> Block:
    """Learn each output, (n,), as a function of the inputs, (n,) each, with hyperparameters of its own.

    Hyperparameters are those of `fit_for_intervals`; of many data the posterior is `sparse.conditioned`.

    Args:
        units: by name of inputs and outputs; "" where one is missing.
        noise: standard deviation of the measurement of an output, in its unit; learned where it is not given.
        outliers: whether some data may be far worse than that, see `trusted`.

    Raises:
        MisfitError: if there is no such kernel, there are too many data to look for outliers, or they give no likelihood.
    """
    if kernel not in KERNELS:
        raise MisfitError(f"kernel = {kernel!r}; {nearest(kernel, KERNELS)}")
    x = np.column_stack(list(inputs.values()))
    if outliers and (count := len(x) * len(outputs)) > EXACT:
        raise MisfitError(f"{count} data to look for outliers in; expected at most {EXACT}, so take fewer of them")
    scales = tuple(map(float, np.where(np.ptp(x, axis=0) > 0.0, np.std(x, axis=0), 1.0)))
    latents, seen = {}, []
    for name, y in outputs.items():
        size = float(np.std(y)) or 1.0
        deviation = noise[name] if name in noise else constant_noise(_NOISE_SHARE * size, len(y))
        data = observe(name, x, name, y, deviation)
        latents[name], best = fit_for_intervals(name, Latent(KERNELS[kernel](size**2, scales)), data, seed)
        seen.append(best)
    observations = trusted(latents, seen, list(latents)) if outliers else tuple(seen)
    ports = [Output(name, units.get(name, ""), (Term(name),)) for name in outputs]
    named = {name: units.get(name, "") for name in inputs}
    return Block(conditioned(latents, observations), named, ports, observations)


def learn(
    path: Path, inputs: Sequence[str], outputs: Sequence[str], kernel: str = "matern52", noise: float | None = None
) -> Block:
    """Learn output columns from all rows of the files that `path` names.

    Args:
        noise: standard deviation of the output columns in their unit, where known; otherwise it is learned.

    Raises:
        MisfitError: if a column is not there, or as `learned_block`.
    """
    records = load_records(path)
    columns = {name: _column(records, name) for name in (*inputs, *outputs)}
    return learned_block(
        {name: columns[name] for name in inputs},
        {name: columns[name] for name in outputs},
        {name: records[0].units.get(name, "") for name in columns},
        kernel,
        {} if noise is None else dict.fromkeys(outputs, noise),
    )


def _column(records: Sequence[Record], name: str) -> Array:
    for record in records:
        if name not in record.columns:
            raise MisfitError(f"{record.name} has no column {name!r}; {nearest(name, record.columns)}")
        if record.units.get(name) != records[0].units.get(name):
            raise MisfitError(f"{name} is in {record.units.get(name)} in {record.name}, in another unit before it")
    return np.concatenate([record.columns[name] for record in records])
