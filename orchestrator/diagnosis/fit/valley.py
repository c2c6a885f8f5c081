"""Other minima along a valley of the misfit: where a shape and a size make up for each other, a fit ends at the first.

The motor's share of an elastic drive and the stiffness of its shaft leave the motion below the resonance as it is when they
move together; what tells them apart is the resonance, of which one is as good as none unless it is met. So the misfit is
followed along the valley, the shape held at one value after another and all else corrected to first order.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from fmus.errors import ComponentError
from orchestrator.diagnosis.fit.evidence import LearningData, Refit, linearised
from orchestrator.diagnosis.fit.thresholds import CORRECTIONS, MOST_MINIMA, STEPS, TRADED
from orchestrator.models.estimation import Fit


def shapes_in_valleys(found: Refit) -> list[int]:
    """Parameters of a fitted set that give an effect no size, have no grid of their own, and trade off with one that does."""
    cards, owners, together = found.effects.card_parameters, found.effects.owners(), np.abs(found.fit.correlation)
    if not together.size:
        return []
    sizes = [i for i, p in enumerate(cards) if np.isfinite(p.meaningful)]
    return [
        k
        for k, p in enumerate(cards)
        if np.isinf(p.meaningful)
        and not p.grid
        and any(owners[i] == owners[k] and together[i, k] > TRADED for i in sizes)
    ]


def minima_along(found: Refit, learning: LearningData, shape: int) -> list[np.ndarray]:
    """Values (k,) of a set's parameters at the minima of the misfit along a valley, the lowest first, but for its own."""
    low, high = (bound[shape] for bound in found.effects.bounds())
    step = (high - low) / STEPS
    ways = [list(_way(found, learning, shape, sign * step)) for sign in (-1.0, 1.0)]
    path = [*ways[0][:0:-1], *ways[1]]
    misfits = np.r_[np.inf, [misfit for _, misfit in path], np.inf]
    own = len(ways[0]) - 1
    lowest = [i for i in range(len(path)) if misfits[i + 1] < min(misfits[i], misfits[i + 2]) and abs(i - own) > 1]
    return [path[i][0] for i in sorted(lowest, key=lambda i: path[i][1])[:MOST_MINIMA]]


def _way(found: Refit, learning: LearningData, shape: int, step: float) -> Iterator[tuple[np.ndarray, float]]:
    """Values and misfit at the fit, then step by step one way along the valley, as far as the bounds let it.

    Other shapes of the effect wait at the card's first values: a light damping would make each step a leap.
    """
    low, high = found.effects.bounds()
    low, high = np.r_[low, learning.nuisances.low], np.r_[high, learning.nuisances.high]
    owners, cards, first = found.effects.owners(), found.effects.card_parameters, found.effects.first_guess()
    held = [k for k, p in enumerate(cards) if owners[k] == owners[shape] and np.isinf(p.meaningful)]
    here = found.fit
    yield here.values[: found.size], here.misfit
    waiting = here.values.copy()
    others = [k for k in held if k != shape]
    waiting[others] = first[others]
    here = replace(here, values=waiting)
    while low[shape] < here.values[shape] + step < high[shape]:
        moved = here.values.copy()
        moved[shape] += step
        here = replace(here, values=moved)
        try:
            for _ in range(CORRECTIONS):
                here = _corrected(found, learning, here, held, low, high)
            residual, _ = linearised(replace(found, fit=here), learning)
        except ComponentError:
            return
        yield here.values[: found.size], float(residual @ residual)


def _corrected(
    found: Refit, learning: LearningData, here: Fit, held: list[int], low: np.ndarray, high: np.ndarray
) -> Fit:
    """A fit after one step of Gauss and Newton in all but what is held."""
    residual, slopes = linearised(replace(found, fit=here), learning)
    size, shifted = len(here.values), int(learning.nuisances.shift_std > 0)
    slopes[:, held] = 0.0
    length = np.where(norms := np.linalg.norm(slopes, axis=0), norms, 1.0)
    move = np.linalg.lstsq(slopes / length, -residual, rcond=1e-10)[0] / length
    starts = move[size + shifted :].reshape(len(here.starts), -1)
    return replace(
        here,
        values=np.clip(here.values + move[:size], low, high),
        shift=here.shift + float(move[size]) if shifted else 0.0,
        starts=tuple(a + b for a, b in zip(here.starts, starts, strict=True)),
    )
