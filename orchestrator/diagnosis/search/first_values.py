"""First values of a fit: what the first order of the free runs says of the effects' sizes."""

from collections.abc import Sequence

import numpy as np

from orchestrator.diagnosis.fit.evidence import Refit
from orchestrator.diagnosis.linear.calibration import Stage
from orchestrator.diagnosis.linear.tangent import Block, orthonormal
from orchestrator.diagnosis.search.thresholds import FAINTEST
from orchestrator.library.cards import Candidate


def first_values(stage: Stage, chosen: Sequence[Candidate], nearer: Sequence[Refit] = ()) -> list[np.ndarray]:
    """Rows of parameters (k,) for a set that contains the tested one: new effects by least squares, and just visible.

    Those of the tested set stay. No rows if the set does not contain the tested one, or a new effect has no first order.

    Args:
        nearer: fitted sets; from the best of them that lies between the tested set and this one starts a further row, in
            which the rest is just visible.
    """
    base = stage.tangent.base
    if not base.labels <= {c.label for c in chosen}:
        return []
    known = _values_of(base) if base.ids else {}
    blocks = [block for c in chosen if c.label not in known and (block := _best_block(stage, c.label)) is not None]
    if len(blocks) + len(known) < len(chosen):
        return []
    error = stage.tangent.error
    visible = {b.candidate.label: _values(b, _just_visible(b, stage.colour.level * len(error) ** 0.5)) for b in blocks}
    starts = [known | _sizes(blocks, error), known | visible]
    labels = {c.label for c in chosen}
    inside = [r for r in nearer if base.labels < r.labels < labels]
    if inside:
        starts.append(known | visible | _values_of(min(inside, key=lambda r: r.fit.misfit)))
    return [np.concatenate([start[c.label] for c in chosen]) for start in starts]


def _values_of(found: Refit) -> dict[str, np.ndarray]:
    owners = np.array(found.effects.owners())
    return {c.label: found.values[owners == k] for k, c in enumerate(found.effects.candidates)}


def _best_block(stage: Stage, label: str) -> Block | None:
    """The block of a candidate that explains the most alone."""
    found = [block for block in stage.blocks if block.candidate.label == label]
    return max(found, key=lambda block: _gain(block, stage.tangent.error), default=None)


def _gain(block: Block, error: np.ndarray) -> float:
    return float(np.sum((orthonormal(block.columns, 1e-3).T @ error) ** 2))


def _sizes(blocks: Sequence[Block], error: np.ndarray) -> dict[str, np.ndarray]:
    """Parameters of all blocks fitted together."""
    if not blocks:
        return {}
    columns = np.column_stack([block.columns for block in blocks])
    length = np.where(norms := np.linalg.norm(columns, axis=0), norms, 1.0)
    change = np.linalg.lstsq(columns / length, error, rcond=1e-4)[0] / length
    parts = np.split(change, np.cumsum([block.columns.shape[1] for block in blocks])[:-1])
    return {block.candidate.label: _values(block, part) for block, part in zip(blocks, parts, strict=True)}


def _just_visible(block: Block, length: float) -> np.ndarray:
    """Changes along a block's columns that do `length` each, in the direction of the card's first guess."""
    norms = np.linalg.norm(block.columns, axis=0)
    step = np.where(norms > 0, length / np.where(norms > 0, norms, 1.0), 0.0)
    if block.names[0] == "":
        return np.r_[step[0], np.zeros(len(step) - 1)]
    return step * np.where(block.sizes < 0, -1.0, 1.0) * (block.sizes != 0)


def _values(block: Block, change: np.ndarray) -> np.ndarray:
    """Parameters after a change along a block's columns; shapes stay at the point where the block was taken."""
    if block.names[0] != "":
        return block.point + change
    # The first column is the whole step from absence to the point, which a size scales.
    share, slopes = change[0], change[1:]
    by_name = {p.name: p.absent for p in block.candidate.card.parameters}
    prefix = f"{block.candidate.slot}."
    absent = np.array([by_name[name.removeprefix(prefix).split("[")[0]] for name in block.names[1:]])
    finite = np.where(np.isfinite(absent), absent, 0.0)
    moved = finite + share * (block.point - finite) + slopes
    # Of what is infinite at absence, the inverse is a size.
    inverse = np.maximum(share * block.point - slopes, FAINTEST * block.point)
    # A parameter that is finite at absence may be zero at the point.
    with np.errstate(divide="ignore", invalid="ignore"):
        moved = np.where(np.isfinite(absent), moved, block.point**2 / inverse)
    return np.where(np.isfinite(block.meaningful[1:]), moved, block.point)
