"""Where the forces of two laws that explain a record alike differ, in reach of the machine."""

import re
from collections.abc import Mapping
from itertools import product
from typing import Any

import numpy as np

from orchestrator.greybox.candidates import Candidate
from orchestrator.greybox.diagnose import Outcome
from orchestrator.greybox.expression import evaluate_numbers
from orchestrator.greybox.places import along, coordinate
from orchestrator.greybox.search import FittedSet

# So many points of a variable's range are looked at, from the range recorded to that share of it beyond.
POINTS, BEYOND = 13, 0.5
# Forces that differ by less than this share of the larger one, wherever they are, are alike.
ALIKE_FORCES = 0.1
# Of the points at which two forces differ by this share of the most, the one nearest to the record is proposed.
NEARLY = 0.9


def where_forces_differ(outcome: Outcome, one: tuple[FittedSet, Candidate], other: tuple[FittedSet, Candidate]) -> str:
    """The nearest place where two forces at one balance differ, such as `w = -20 rad/s: there it is 0.2 against -0.2 N.m`.

    Args:
        outcome: the search that found both.
        one: a fitted set, and the effect of it whose force is asked for.
        other: the same of a rival.

    Returns:
        Empty if either force has a memory or goes with an acceleration, they act at different places, or differ nowhere by much.
    """
    a, b = one[1], other[1]
    moved = a.law.states or b.law.states or "net" in a.law.asks_for | b.law.asks_for
    if a.place.site != b.place.site or not a.place.adds or moved:
        return ""
    texts = sorted({*_used(a), *_used(b)})
    if not texts:
        return ""
    units = {v.name: v.unit for v in (*outcome.case.base.states, *outcome.case.inputs)} | {"time": "s"}
    reached = [_reached(outcome, text, moves=a.place.kind == "motion") for text in texts]
    points = list(product(*(grid for grid, _ in reached)))
    columns = dict(zip(texts, np.array(points).T, strict=True))
    with np.errstate(all="ignore"):  # a law may be undefined beyond what was seen
        forces = np.nan_to_num([_force(*each, columns) for each in (one, other)], posinf=0.0, neginf=0.0)
    gap = np.abs(forces[0] - forces[1])
    far = sum(
        np.abs(columns[text] - usual) / (np.ptp(grid) or 1.0)
        for text, (grid, usual) in zip(texts, reached, strict=True)
    )
    k = int(np.argmin(np.where(gap >= NEARLY * gap.max(), far, np.inf)))
    if gap[k] < ALIKE_FORCES * np.abs(forces).max():
        return ""
    at = " and ".join(
        f"{text} = {value:.3g} {units.get(text, '')}".rstrip() for text, value in zip(texts, points[k], strict=True)
    )
    return f"{at}: there it is {forces[0][k]:.3g} against {forces[1][k]:.3g} {a.place.unit}"


def _used(candidate: Candidate) -> list[str]:
    """Variables of the model that a law's force depends on."""
    names = candidate.place.coordinates
    return [text for key, text in names.items() if re.search(rf"\b{key}\b", candidate.law.expression)]


def _reached(outcome: Outcome, text: str, *, moves: bool) -> tuple[np.ndarray, float]:
    """Values (POINTS,) over what was recorded of a variable and somewhat beyond, and the median of the record."""
    fit = outcome.nominal.fit
    known = {v.name: np.concatenate([run.mean[:, i] for run in fit.runs]) for i, v in enumerate(fit.box.system.states)}
    given = np.concatenate([trial.inputs for trial in fit.trials])
    known |= {v.name: given[:, i] for i, v in enumerate(fit.box.system.inputs)}
    known["time"] = np.concatenate([trial.time for trial in fit.trials])
    own = [v.name for v in outcome.case.base.states]
    known = along(outcome.case.base, np.array([known[name] for name in own]).T) | known
    values = coordinate(text, known)
    low, high = float(values.min()), float(values.max())
    reach = BEYOND * (high - low)
    if text == "time":
        return np.linspace(low, high + reach, POINTS), float(np.median(values))
    if moves and low * high > 0:  # what went one way only can go the other
        low, high = min(low, -high), max(high, -low)
        reach = BEYOND * (high - low)
    return np.linspace(low - reach, high + reach, POINTS), float(np.median(values))


def _force(found: FittedSet, candidate: Candidate, columns: Mapping[str, np.ndarray]) -> np.ndarray:
    """The force (n,) of a fitted law at points of its variables."""
    names: dict[str, Any] = {key: columns[text] for key, text in candidate.place.coordinates.items() if text in columns}
    names |= {p.name: found.value(candidate, p.name)[0] for p in candidate.law.parameters}
    count = len(next(iter(columns.values())))
    return np.broadcast_to(np.asarray(evaluate_numbers(candidate.law.expression, names), dtype=float), count)
