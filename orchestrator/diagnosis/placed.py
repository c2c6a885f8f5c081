"""First guesses where a record has been: levels beyond which an effect begins to act lie within what was seen.

A card cannot know how far a user's machine moves, nor about which angle: a pole hangs at pi. Where it declares that its effect
acts above, below or beyond a level that is one of its parameters, that parameter starts from the range of the quantity in the
nominal runs. A level above or below which an effect acts stays near that range: an end stop far from all that was seen is
a spring, or a constant force, in disguise.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from orchestrator.diagnosis.candidates import Candidate
from orchestrator.diagnosis.coverage import variables_of
from orchestrator.diagnosis.response import Response

# Shares of the range seen, from the side on which the effect does not act.
LEVELS = (0.95, 0.85, 0.75, 0.6, 0.45, 0.3)
FIRST = 0.6
SIDES = ("above", "below", "beyond")
# The machine itself may have gone farther than its nominal runs, by this share of their range.
FARTHER = 0.25
# What moves by less than this share of its size rests but for rounding.
AT_REST = 1e-9


def placed(candidates: Sequence[Candidate], response: Response) -> tuple[Candidate, ...]:
    """The candidates, those with such a level with a first guess and a grid of it."""
    if not response.is_formula:
        return tuple(candidates)
    known = {v.name for v in (*response.model.system.states, *response.model.system.algebraics)}
    wanted = {
        (candidate, need): variables_of(candidate, need, known)
        for candidate in candidates
        for need in candidate.card.needs
        if need.kind in SIDES and isinstance(need.limit, str)
    }
    series = response.series(list(dict.fromkeys(name for names in wanted.values() for name in names)))
    found = []
    for candidate in candidates:
        card = candidate.card
        for need in card.needs:
            names = wanted.get((candidate, need), [])
            if names:
                seen = np.concatenate([part for name in names for part in series[name]])
                low, high = _range(seen, need.kind)
                levels = tuple(float(low + share * (high - low)) for share in LEVELS)
                first = float(low + FIRST * (high - low))
                least, most = _bounds(seen, need.kind)
                parameters = [
                    replace(p, start=first, grid=levels, low=least, high=most) if p.name == need.limit else p
                    for p in card.parameters
                ]
                card = replace(card, parameters=tuple(parameters))
        found.append(replace(candidate, card=card))
    return tuple(found)


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
