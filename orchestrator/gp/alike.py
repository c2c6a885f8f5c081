"""How far two blocks agree: at the data of both, against what is not known of either."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from orchestrator.gp.block import Block, Output

Z90 = 1.6448536269514722


@dataclass(frozen=True)
class Agreement:
    """Of an output that two blocks have: rms of their difference, of each mean (in `unit`), and the share of points at
    which it is inside 90 %.

    The interval is that of the difference of two independent estimates.
    """

    output: str
    unit: str
    difference: float
    first: float
    second: float
    inside: float


def agreements(one: Block, other: Block, most: int = 300) -> tuple[Agreement, ...]:
    """Outputs that both blocks have, compared at the data of both, at most `most` points of them.

    Blocks over other inputs have nothing to compare.

    Args:
        one: a block.
        other: another one.
        most: points at which they are compared, at most.
    """
    if list(one.inputs) != list(other.inputs):
        return ()
    points = np.concatenate([each.inputs for block in (one, other) for each in block.observations])
    points = points[np.linspace(0, len(points) - 1, min(most, len(points))).astype(int)]
    theirs = {output.name: output for output in other.outputs}
    return tuple(_agreement(one, mine, other, theirs[mine.name], points) for mine in one.outputs if mine.name in theirs)


def _agreement(one: Block, mine: Output, other: Block, theirs: Output, points: np.ndarray) -> Agreement:
    means, variances = [], []
    for block, output in ((one, mine), (other, theirs)):
        of = block.coefficients(output, dict.fromkeys((*block.inputs, *block.factors), 1.0))  # factors at 1
        means.append(block.posterior.mean(of, points)[:, output.component])
        variances.append(block.posterior.variance(of, points))
    off = means[0] - means[1]
    inside = float(np.mean(np.abs(off) <= Z90 * np.sqrt(variances[0] + variances[1]) + 1e-300))
    return Agreement(mine.name, mine.unit, _rms(off), _rms(means[0]), _rms(means[1]), inside)


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def pairs(blocks: Sequence[tuple[str, Block]]) -> list[tuple[str, str, tuple[Agreement, ...]]]:
    """Each block against each that comes behind it."""
    return [
        (name, other, agreements(block, with_))
        for k, (name, block) in enumerate(blocks)
        for other, with_ in blocks[k + 1 :]
    ]
