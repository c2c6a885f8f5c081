"""Which effects act alike in these data, to first order: angles between what they do, beyond start values and tolerances.

The cosine of two effects is that of the angle between what the one does here and the nearest that the other can do. Above
0.98 the data hardly see a difference (one class), above 0.9 they are weakly separable; how well, the odds tell, which grow
with the record.
"""

from collections.abc import Sequence

import numpy as np

from orchestrator.diagnosis.fit.evidence import Refit
from orchestrator.diagnosis.linear.calibration import Stage
from orchestrator.diagnosis.linear.tangent import Block, orthonormal
from orchestrator.diagnosis.linear.thresholds import MOST_LOG_ODDS
from orchestrator.library.cards import Candidate
from orchestrator.verdicts.open_questions import WEAK, CollinearPair


def principal_cosines(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Cosines of the principal angles between two spaces of columns (m, j) and (m, k), largest first, min(j, k) of them.

    Source: Bjorck and Golub, Numerical methods for computing angles between linear subspaces, Mathematics of Computation
    27 (1973).

    >>> principal_cosines(np.array([[1.0], [0.0], [0.0]]), np.array([[1.0, 0.0], [1.0, 0.0], [0.0, 1.0]])).round(3)
    array([0.707])
    """
    inner = orthonormal(first, 1e-3).T @ orthonormal(second, 1e-3)
    if not inner.size:
        return np.zeros(0)
    return np.clip(np.linalg.svd(inner, compute_uv=False), 0.0, 1.0)


def collinear_effects(best: Refit, stages: Sequence[Stage]) -> list[CollinearPair]:
    """Every candidate that acts like an effect of the best set, most alike first; none for models without a first order.

    Each effect is looked at where the tests of the search had the others and not yet itself in the model.
    """
    found = []
    for effect in best.effects.candidates:
        rest = best.labels - {effect.label}
        stage = max((s for s in stages if s.tangent.base.labels <= rest), key=lambda s: len(s.tangent.base.ids))
        found += _collinear_with(effect, stage)
    return sorted(found, key=lambda entry: -entry.cosine)


def _collinear_with(effect: Candidate, stage: Stage) -> list[CollinearPair]:
    error, scale = stage.tangent.error, stage.colour.scale
    own = _strongest(effect.label, stage.blocks, error)
    if own is None:
        return []
    basis = orthonormal(own.columns, 1e-3)
    pattern = basis @ (basis.T @ error)
    if not pattern.any():
        return []
    labels = dict.fromkeys(b.candidate.label for b in stage.blocks if b.candidate.card.id != effect.card.id)
    found = []
    for label in labels:
        others = [block for block in stage.blocks if block.candidate.label == label]
        bases = [orthonormal(block.columns, 1e-3) for block in others]
        cosines = [float(principal_cosines(pattern[:, None], other)[0]) if other.size else 0.0 for other in bases]
        if max(cosines) > WEAK:
            gains = [float(np.sum((other.T @ error) ** 2)) for other in bases]
            k = int(np.argmax(gains))
            charge = (_parameters(others[k]) - _parameters(own)) * float(np.log(len(error)))
            behind = 0.5 * ((float(np.sum((basis.T @ error) ** 2)) - gains[k]) / scale + charge)
            odds = float(np.exp(np.clip(behind, -MOST_LOG_ODDS, MOST_LOG_ODDS)))
            found.append(CollinearPair(effect, others[k].candidate, max(cosines), odds))
    return found


def _parameters(block: Block) -> int:
    """Number of parameters behind a block's columns; the step from absence to the first guess is none."""
    return sum(1 for name in block.names if name)


def _strongest(label: str, blocks: Sequence[Block], error: np.ndarray) -> Block | None:
    """The block of a candidate that explains most of an error."""
    own = [block for block in blocks if block.candidate.label == label]
    return max(own, key=lambda b: float(np.sum((orthonormal(b.columns, 1e-3).T @ error) ** 2)), default=None)
