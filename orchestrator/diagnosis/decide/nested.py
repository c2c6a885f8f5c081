"""Laws that hold a simpler one, such as dry friction that is larger near rest: whether data rule the rest of them out.

Where the larger law explains no more, the simpler one is named. That the data rule the rest out is another matter: a part
that acts only near rest, in a record that is hardly ever near rest, may be as large as the friction itself. Then both are
listed.
"""

from collections.abc import Iterator, Mapping
from itertools import product

import numpy as np

from orchestrator.diagnosis.decide.thresholds import MATTERS, SHAPES, SIZES
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.evidence import Refit
from orchestrator.diagnosis.fit.thresholds import PINNED
from orchestrator.library.cards import Candidate, EffectCard
from orchestrator.models.estimation import Z90


def holds(larger: EffectCard, smaller: EffectCard) -> bool:
    """Whether a law has all parameters of another one in the same slots, and one of the cards calls them confusable."""
    outer, inner = ({p.name for p in card.parameters} for card in (larger, smaller))
    alike = larger.id in smaller.confusable or smaller.id in larger.confusable
    return alike and inner < outer and set(larger.slots) == set(smaller.slots)


def rest_share(found: Refit, larger: Candidate, smaller: EffectCard) -> float:
    """How large what a fitted law has beyond a simpler one may be within its 90 % interval, as a share of what they share.

    Of parameters of one unit; NaN if no parameter of the rest has the unit of one that both have.

    Args:
        found: a fitted set with the larger law in it.
        larger: the law, as the candidate of that set.
        smaller: the simpler law, which the larger one holds.
    """
    own, rest = _own(found, larger), _rest(found, larger, smaller)
    counts = rest & np.isfinite([p.meaningful for p in found.effects.card_parameters])
    most, units = np.abs(_away(found)) + Z90 * found.std, np.array([v.unit for v in found.effects.variables])
    shares = [
        most[counts & (units == unit)].max() / max(np.abs(found.values[own & ~rest & (units == unit)]).max(), 1e-300)
        for unit in set(units[counts]) & set(units[own & ~rest])
    ]
    return float(max(shares, default=np.nan))


def at_least(found: Refit, larger: Candidate, smaller: EffectCard) -> np.ndarray:
    """Values (k,) of a fitted set in which what a law has beyond a simpler one is as large as matters, if it is smaller.

    What hardly shows has no shape of its own, a fit may have left that anywhere: it is the card's then.

    Args:
        found: a fitted set with the larger law in it.
        larger: the law, as the candidate of that set.
        smaller: the simpler law, which the larger one holds.
    """
    own, rest = _own(found, larger), _rest(found, larger, smaller)
    units, away = np.array([v.unit for v in found.effects.variables]), _away(found)
    shared = [np.abs(found.values[own & ~rest & (units == unit)]).max(initial=0.0) for unit in units]
    least, (low, high), values = MATTERS * np.array(shared), found.effects.bounds(), found.values.copy()
    sizes = [k for k in np.flatnonzero(rest) if least[k] > 0]
    if all(abs(away[k]) < least[k] for k in sizes):
        for k in np.flatnonzero(rest):
            parameter = found.effects.card_parameters[k]
            side = -1.0 if away[k] < 0 and parameter.absent - least[k] >= low[k] else 1.0
            values[k] = parameter.absent + side * least[k] if least[k] > 0 else parameter.start
    return np.asarray(np.clip(values, low, high))


def rest_parts(found: Refit, larger: Candidate, smaller: EffectCard) -> tuple[np.ndarray, np.ndarray]:
    """Places of what a law has beyond a simpler one in a set's parameters: sizes, whose unit both share, and shapes.

    Args:
        found: a fitted set with the larger law in it.
        larger: the law, as the candidate of that set.
        smaller: the simpler law, which the larger one holds.
    """
    own, rest = _own(found, larger), _rest(found, larger, smaller)
    units = np.array([v.unit for v in found.effects.variables])
    sized = np.isin(units, units[own & ~rest])
    return np.flatnonzero(rest & sized), np.flatnonzero(rest & ~sized)


def with_simpler(best: Refit, other: Refit, old: Candidate, by: Candidate) -> tuple[np.ndarray, np.ndarray]:
    """Values (k,) of a set with the law `by` in which that is the simpler law `old` of the best set, and nothing else; and
    sizes (k,) of the rest that are those of the simpler law, element by element.

    Args:
        best: the best set, with the simpler law in it.
        other: a set with the larger law in its place, whose values are written.
        old: the simpler law, as the candidate of the best set.
        by: the larger law, as the candidate of the other set.
    """
    known = {
        (best.effects.candidates[owner].label, _own_name(best, k)): best.values[k]
        for k, owner in enumerate(best.effects.owners())
    }
    values, sizes = other.values.copy(), np.zeros(other.size)
    for k, owner in enumerate(other.effects.owners()):
        label = other.effects.candidates[owner].label
        values[k] = known.get((old.label if label == by.label else label, _own_name(other, k)), values[k])
    rest, _ = rest_parts(other, by, old.card)
    shared = np.setdiff1d(np.flatnonzero(_own(other, by)), rest)
    by_element = {(other.effects.variables[k].unit, _element(other, k)): values[k] for k in map(int, shared)}
    for k in map(int, rest):
        values[k] = other.effects.card_parameters[k].absent
        sizes[k] = by_element.get((other.effects.variables[k].unit, _element(other, k)), 0.0)
    return values, sizes


def acts_near_rest_only(found: Refit, larger: Candidate, smaller: EffectCard) -> bool:
    """Whether what a fitted law has beyond a simpler one acts at the slowest speeds only that it may act at.

    There laws of dry friction are smooth, so that machines creep which stand still: a rest that hinders creeping
    follows them better, whatever their friction.

    Args:
        found: a fitted set with the larger law in it.
        larger: the law, as the candidate of that set.
        smaller: the simpler law, which the larger one holds.
    """
    _, shapes = rest_parts(found, larger, smaller)
    low, high = found.effects.bounds()
    lowest = found.fit.at_bound[: found.size] & (found.values - low < high - found.values)
    return bool(lowest[shapes].any())


def unpinned(found: Refit, larger: Candidate, smaller: EffectCard) -> int:
    """Number of parameters of the rest that the data do not pin: what could be anything lowers no misfit by chance.

    Args:
        found: a fitted set with the larger law in it.
        larger: the law, as the candidate of that set.
        smaller: the simpler law, which the larger one holds.
    """
    loose = ~(found.std < PINNED * np.abs(_away(found)))
    return int(np.count_nonzero(_rest(found, larger, smaller) & loose))


def starts(larger: EffectSet, known: Mapping[str, float]) -> Iterator[np.ndarray]:
    """First values (k,) of a law, the only one of its set, given those of a simpler one by name (`tauC[1]`)."""
    slot, (low, high) = larger.candidates[0].slot, larger.bounds()
    rows = [
        (v.name.removeprefix(f"{slot}."), v.unit, first)
        for v, first in zip(larger.variables, larger.first_guess(), strict=True)
    ]
    sizes = {
        unit: max(abs(known[n]) for n, u, _ in rows if n in known and u == unit)
        for name, unit, _ in rows
        if name in known
    }
    for size, shape in product(SIZES, SHAPES):
        rest = [size * sizes[unit] if unit in sizes else shape * first for _, unit, first in rows]
        yield np.clip([known.get(name, value) for (name, _, _), value in zip(rows, rest, strict=True)], low, high)


def _own_name(found: Refit, k: int) -> str:
    return found.effects.variables[k].name.removeprefix(f"{found.effects.candidates[found.effects.owners()[k]].slot}.")


def _element(found: Refit, k: int) -> str:
    """Subscript of a parameter, as `[2]`."""
    return _own_name(found, k).removeprefix(found.effects.card_parameters[k].name)


def _own(found: Refit, candidate: Candidate) -> np.ndarray:
    return np.array([found.effects.candidates[k].label == candidate.label for k in found.effects.owners()])


def _rest(found: Refit, larger: Candidate, smaller: EffectCard) -> np.ndarray:
    """Which parameters (k,) of a set are those that a law of it has beyond a simpler one."""
    inner = {p.name for p in smaller.parameters}
    return _own(found, larger) & np.array([p.name not in inner for p in found.effects.card_parameters])


def _away(found: Refit) -> np.ndarray:
    return np.asarray(found.values - np.array([p.absent for p in found.effects.card_parameters]))
