"""First guesses where a record has been: levels beyond which an effect begins to act lie within what was seen.

A card cannot know how far a user's machine moves, nor about which angle: a pole hangs at pi. Where it declares that its
effect acts above, below or beyond a level that is one of its parameters, that parameter starts from the range of the
quantity in the nominal runs. A level above or below which an effect acts stays near that range: an end stop far from
all that was seen is a spring, or a constant force, in disguise. Waves over the position of a joint get out of step the
sooner the farther it moves: the grid of their number is as fine as that range asks for.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from orchestrator.diagnosis.linear.coverage import variables_of
from orchestrator.diagnosis.linear.response import Response
from orchestrator.diagnosis.search.thresholds import AT_REST, FARTHER, FIRST, LEVELS, MOST_POINTS
from orchestrator.library.cards import Candidate, CardParameter
from orchestrator.library.needs import Need

SIDES = ("above", "below", "beyond")


def with_ranges_of_levels(candidates: Sequence[Candidate], response: Response) -> tuple[Candidate, ...]:
    """The candidates, those with such a level with a first guess and a grid of it."""
    if not response.is_formula:
        return tuple(candidates)
    known = {v.name for v in (*response.model.system.states, *response.model.system.algebraics)}
    wanted = {
        (candidate, need): variables_of(candidate, need, known)
        for candidate in candidates
        for need in candidate.card.needs
        if (need.kind in SIDES and isinstance(need.limit, str))
        or any(p.waves_over == need.variable for p in candidate.card.parameters)
    }
    series = response.series(list(dict.fromkeys(name for names in wanted.values() for name in names)))
    found = []
    for candidate in candidates:
        card = candidate.card
        for need in card.needs:
            parts = [series[name] for name in wanted.get((candidate, need), [])]
            if parts:
                card = replace(card, parameters=tuple(_parameter(p, need, parts) for p in card.parameters))
        found.append(replace(candidate, card=card))
    return tuple(found)


def _parameter(parameter: CardParameter, need: Need, parts: Sequence[Sequence[np.ndarray]]) -> CardParameter:
    """A parameter of a card by what trials show of the variables of a need, each (n,) of each trial."""
    if parameter.waves_over == need.variable:
        span = max(float(np.ptp(trial)) for trials in parts for trial in trials)
        return replace(parameter, grid=in_step(parameter.grid, span))
    if need.kind not in SIDES or parameter.name != need.limit:
        return parameter
    seen = np.concatenate([trial for trials in parts for trial in trials])
    low, high = _range(seen, need.kind)
    least, most = _bounds(seen, need.kind)
    first, *levels = (float(low + share * (high - low)) for share in (FIRST, *LEVELS))
    return replace(parameter, start=first, grid=tuple(levels), low=least, high=most)


def in_step(grid: Sequence[float], span: float) -> tuple[float, ...]:
    """An ascending grid of numbers of waves over 2 pi of a variable, so fine that neighbours part by at most half a
    wave over its `span`.

    As fine as at most `MOST_POINTS` points make it.

    >>> in_step((3.0, 6.0), np.pi)
    (3.0, 4.0, 5.0, 6.0)
    """
    most = max(MOST_POINTS - len(grid), 1) / (grid[-1] - grid[0])
    finest = min(span / np.pi, most)
    steps = ((low, high, max(1, math.ceil((high - low) * finest))) for low, high in pairwise(grid))
    return (*(low + (high - low) * k / n for low, high, n in steps for k in range(n)), grid[-1])


def _bounds(seen: np.ndarray, kind: str) -> tuple[float, float]:
    """Bounds of a level above or below which an effect acts; none where nothing moved."""
    low, high = float(seen.min()), float(seen.max())
    margin = FARTHER * (high - low)
    if kind == "beyond" or high - low <= AT_REST * max(abs(low), abs(high)):
        return -np.inf, np.inf
    return low - margin, high + margin


def _range(seen: np.ndarray, kind: str) -> tuple[float, float]:
    """From where an effect does not act to the farthest that was seen on its side."""
    if kind == "beyond":
        return 0.0, float(np.abs(seen).max())
    middle = float(np.median(seen))
    return middle, float(seen.max() if kind == "above" else seen.min())
