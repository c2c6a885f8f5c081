"""A block learned from a measured file: columns in, columns out, hyperparameters fitted."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from fmus.errors import MisfitError
from orchestrator.gp.block import Block, Output, Term
from orchestrator.gp.covariance import Latent
from orchestrator.gp.fit import fit
from orchestrator.gp.kernels import Kernel, Matern32, Matern52, SquaredExponential
from orchestrator.gp.noise import LearntNoise, constant_noise
from orchestrator.gp.observations import observe
from orchestrator.gp.posterior import condition
from orchestrator.measurements.load import load_records
from orchestrator.measurements.trial import Array, Record
from orchestrator.measurements.wording import nearest

KERNELS: dict[str, Callable[[float, tuple[float, ...]], Kernel]] = {
    "squared_exponential": SquaredExponential,
    "matern32": Matern32,
    "matern52": Matern52,
}
# Exact conditioning takes time in the cube of the number of points; a longer record is thinned by the user, knowingly.
MOST_ROWS = 2000


def learn(
    path: Path, inputs: Sequence[str], outputs: Sequence[str], kernel: str = "matern52", noise: float | None = None
) -> list[Block]:
    """Fit one block for each output column, each with hyperparameters of its own, to all rows of the files that `path` names.

    Args:
        noise: standard deviation of the output columns in their unit, where known; otherwise it is learnt.

    Raises:
        MisfitError: if a column is not there, there are more than `MOST_ROWS` rows, or the fit finds nothing.
    """
    if kernel not in KERNELS:
        raise MisfitError(f"kernel = {kernel!r}; {nearest(kernel, KERNELS)}")
    records = load_records(path)
    x = np.column_stack([_column(records, name) for name in inputs])
    if len(x) > MOST_ROWS:
        raise MisfitError(
            f"{path} has {len(x)} rows; expected at most {MOST_ROWS}, so give every {len(x) // MOST_ROWS + 1}th"
        )
    units = {name: records[0].units.get(name, "") for name in (*inputs, *outputs)}
    blocks = []
    for name in outputs:
        y = _column(records, name)
        spread = float(np.std(y)) or 1.0
        scales = np.where(np.ptp(x, axis=0) > 0.0, np.std(x, axis=0), 1.0)
        latents = {name: Latent(KERNELS[kernel](spread**2, tuple(map(float, scales))))}
        given: LearntNoise | float = constant_noise(0.1 * spread, len(y)) if noise is None else noise
        best = fit(latents, [observe(name, x, name, y, given)])
        ports = {each: units[each] for each in inputs}
        output = Output(name, units[name], (Term(name),))
        posterior = condition(best.latents, best.observations)
        blocks.append(Block(posterior, ports, [output], best.observations))
    return blocks


def _column(records: Sequence[Record], name: str) -> Array:
    for record in records:
        if name not in record.columns:
            raise MisfitError(f"{record.name} has no column {name!r}; {nearest(name, record.columns)}")
        if record.units.get(name) != records[0].units.get(name):
            raise MisfitError(f"{name} is in {record.units.get(name)} in {record.name}, in another unit before it")
    return np.concatenate([record.columns[name] for record in records])
