"""Excitation that effects need to show, as their cards declare it, and how much of it a record has."""

import operator
import re
from collections.abc import Callable, Collection, Mapping, Sequence

import numpy as np

from orchestrator.diagnosis.linear.response import Response
from orchestrator.library.cards import Candidate
from orchestrator.library.needs import Need
from orchestrator.verdicts.open_questions import Coverage

Limit = Callable[[np.ndarray, float], np.ndarray]
# What a sample must do to count, by the key of a need.
COUNTED: Mapping[str, tuple[str, Limit]] = {
    "within": ("|{}| below {}", lambda x, limit: np.abs(x) < limit),
    "beyond": ("|{}| above {}", lambda x, limit: np.abs(x) > limit),
    "below": ("{} below {}", operator.lt),
    "above": ("{} above {}", operator.gt),
}


def coverage(response: Response, candidates: Sequence[Candidate], values: Mapping[str, float]) -> list[Coverage]:
    """How far the runs of a fitted model excite effects; empty for an FMU, whose inside is closed.

    Args:
        candidates: effects in slots of the model, filled or free; those that declare no need are passed over.
        values: parameters that limits refer to, by `slot.name`; the cards' first guesses where they are left out.
    """
    if not response.is_formula:
        return []
    system = response.model.system
    known = {v.name: v for v in (*system.states, *system.algebraics)}
    wanted = [
        (candidate, need, name)
        for candidate in candidates
        for need in candidate.card.needs
        for name in variables_of(candidate, need, known)
    ]
    names = list(dict.fromkeys(name for _, _, name in wanted))
    if not names:
        return []
    series = response.series(names)
    return [_judged(c, need, name, known[name].unit, series[name], values) for c, need, name in wanted]


def variables_of(candidate: Candidate, need: Need, known: Collection[str]) -> list[str]:
    """Names of the variable of a need at one element, or at all; a pair `[i,j]` means what goes from i to j, so element i.

    Args:
        candidate: the effect, at one element or at all.
        need: what the effect needs to show in a record.
        known: names of the variables of the model with the effect.
    """
    name, own = f"{candidate.slot}.{need.variable}", re.sub(r",\d+", "", candidate.element)
    pattern = re.compile(re.escape(name) + (re.escape(own) if own else r"(\[\d+\])?"))
    return [name] if name in known else [full for full in known if pattern.fullmatch(full)]


def _judged(
    candidate: Candidate, need: Need, name: str, unit: str, trials: Sequence[np.ndarray], values: Mapping[str, float]
) -> Coverage:
    number = re.search(r"\[(\d+)\]$", name)
    site = candidate.site
    if "+" in site and number is not None:
        site = site.split("+")[int(number[1]) - 1]
    words, wanted, has = measured(need, _limit(candidate, need, number[0] if number else "", values), unit, trials)
    return Coverage(candidate.card.id, site, words, wanted, has)


def measured(need: Need, limit: float, unit: str, trials: Sequence[np.ndarray]) -> tuple[str, float, float]:
    """A need in words, how much is wanted, and how much the trials (each (n,), in `unit`) have.

    Args:
        need: what an effect needs to show in a record.
        limit: the limit that it counts by, in `unit`.
        unit: unit of the variable.
        trials: the variable along each trial, (n,) each.

    >>> measured(Need("w", "speed", "within", 0.2, 50), 0.2, "rad/s", [np.array([0.1, -0.1, 0.5])])
    ('|speed| below 0.2 rad/s for at least 50 samples', 50, 2.0)
    >>> measured(Need("w", "speed", "reversals", 4, 4), 4, "rad/s", [np.array([0.1, -0.1, 0.5])])
    ('at least 4 reversals of speed', 4, 2.0)
    """
    amount = f"{limit:.3g} {'' if unit == '1' else unit}".rstrip()
    if need.kind == "reversals":
        turns = sum(int(np.count_nonzero(np.diff(np.sign(x[x != 0])))) for x in trials)
        return f"at least {limit:.0f} reversals of {need.what}", need.wanted, float(turns)
    if need.kind == "spread":
        spread = float(max(x.max() for x in trials) - min(x.min() for x in trials))
        return f"{need.what} to range over at least {amount}", limit, spread
    text, counts = COUNTED[need.kind]
    samples = sum(int(np.count_nonzero(counts(x, limit))) for x in trials)
    return f"{text.format(need.what, amount)} for at least {need.wanted:.0f} samples", need.wanted, float(samples)


def _limit(candidate: Candidate, need: Need, element: str, values: Mapping[str, float]) -> float:
    """The limit: a number, or the value of a parameter of the effect."""
    if not isinstance(need.limit, str):
        return need.limit
    full = f"{candidate.slot}.{need.limit}"
    for name in (full, full + candidate.element, full + element):
        if name in values:
            return values[name]
    return next(p.start for p in candidate.card.parameters if p.name == need.limit)
