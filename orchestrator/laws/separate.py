"""The experiment that tells two laws apart: where, in reach of the machine, their forces differ most."""

from dataclasses import replace
from itertools import product

import numpy as np

from orchestrator.greybox.expression import evaluate_numbers
from orchestrator.laws.proposal import LawProposal

# Beyond what was seen, by this share of its range, an experiment may go.
REACH = 0.5


def separated_by(one: LawProposal, other: LawProposal) -> str:
    """Such as `they differ most at v = 3 m/s (1.2 against 0.9 N), beyond what was seen: record a trial that goes there`."""
    if one.law.states or other.law.states or one.site != other.site:
        return "they differ in what they remember: record a longer trial, with pauses"
    units = {**one.coordinates, **other.coordinates}
    seen = {**one.seen, **other.seen}
    points = list(product(*(_grid(*seen[name], name == "time") for name in units)))
    forces = [_forces(law, list(units), points) for law in (one, other)]
    gap = np.abs(forces[0] - forces[1])
    k = int(np.nanargmax(gap))
    there = [f"{name} = {value:.3g} {units[name]}" for name, value in zip(units, points[k], strict=True)]
    beyond = any(not seen[name][0] <= value <= seen[name][1] for name, value in zip(units, points[k], strict=True))
    values = f"{forces[0][k]:.3g} against {forces[1][k]:.3g} {one.unit}"
    where = ", beyond what was seen" if beyond else ""
    return f"they differ most at {', '.join(there)} ({values}){where}: record a trial that goes there"


def _grid(low: float, high: float, is_time: bool) -> np.ndarray:
    reach = REACH * (high - low)
    return np.linspace(low if is_time else low - reach, high + reach, 9)


def _forces(law: LawProposal, names: list[str], points: list[tuple[float, ...]]) -> np.ndarray:
    columns = dict(zip(names, np.array(points).T, strict=True))
    own = {key: columns[variable] for key, variable in zip(law.law.seen, law.coordinates, strict=True)}
    values = {name: estimate.value for name, estimate in law.parameters.items()}
    with np.errstate(all="ignore"):
        found = np.asarray(evaluate_numbers(law.law.expression, {**own, **values}), dtype=float)
    return np.broadcast_to(found, len(points)).copy()


def with_rivals(proposals: list[LawProposal]) -> tuple[LawProposal, ...]:
    """Proposals that explain the record alike, each with the formulas of the others and what separates it from the first."""
    found = []
    for law in proposals:
        others = [other for other in proposals if other is not law]
        words = separated_by(law, others[0]) if others else ""
        found.append(replace(law, alike=tuple(other.formula for other in others), separated_by=words))
    return tuple(found)
