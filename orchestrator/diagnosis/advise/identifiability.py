"""What a fit cannot know: parameters that the data do not show, or show only in combination, in plain words."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from orchestrator.diagnosis.advise.thresholds import FLAT_MEMBERS, MEMBER, TRADED, UNCERTAIN, UNSEEN
from orchestrator.diagnosis.fit.evidence import LearningData, Refit, linearised
from orchestrator.diagnosis.linear.tangent import orthonormal
from orchestrator.models.estimation import Z90
from orchestrator.verdicts.open_questions import Doubt


@dataclass(frozen=True)
class Fitted:
    """A fitted parameter: `size` is a change of it that counts as large, `std` its standard deviation.

    `is_tolerance` marks a parameter of the model that was fitted within a stated tolerance: it is part of combinations, and
    no news on its own.
    """

    name: str
    unit: str
    value: float
    std: float
    size: float
    at_bound: bool = False
    is_tolerance: bool = False

    def amount(self, value: float) -> str:
        """A value with the unit."""
        return f"{value:.3g} {'' if self.unit == '1' else self.unit}".rstrip()


def doubts(parameters: Sequence[Fitted], columns: np.ndarray) -> list[Doubt]:
    """Everything that the data leave open about fitted parameters.

    Args:
        parameters: k of them.
        columns: (m, k) slopes of the whitened data, and of what is known beforehand, in the parameters; start values and
            clocks projected away.

    >>> two = [Fitted("a", "N", 1.0, 3.0, 1.0), Fitted("b", "N", 2.0, 3.0, 2.0)]
    >>> [d.message for d in doubts(two, np.array([[30.0, -15.0], [0.0, 0.1]]))]
    ['the data do not show whether a rises by 0.707 N while b rises by 1.41 N']
    """
    sizes = np.array([p.size for p in parameters])
    effect = columns * sizes
    dead = np.linalg.norm(effect, axis=0) < UNSEEN
    found = [_dead(p) for p, is_dead in zip(parameters, dead, strict=True) if is_dead and not p.is_tolerance]
    alive = [k for k in range(len(parameters)) if not dead[k]]
    flat = _flat([parameters[k] for k in alive], effect[:, alive])
    traded = _traded([parameters[k] for k in alive], effect[:, alive], [set(d.parameters) for d in flat])
    told = {name for d in (*found, *flat) for name in d.parameters}
    alone = [_alone(parameters[k]) for k in alive if not parameters[k].is_tolerance and parameters[k].name not in told]
    return [*found, *flat, *traded, *(d for d in alone if d is not None)]


def _dead(p: Fitted) -> Doubt:
    return Doubt(
        "dead", (p.name,), f"the data do not depend on {p.name}: a change by {p.amount(p.size)} would not show"
    )


def _alone(p: Fitted) -> Doubt | None:
    if p.at_bound:
        return Doubt(
            "at bound", (p.name,), f"{p.name} = {p.amount(p.value)} is at its bound; the data may not determine it"
        )
    if p.std >= p.size:
        low, high = p.value - Z90 * p.std, p.value + Z90 * p.std
        return Doubt("not pinned", (p.name,), f"{p.name} is not pinned: between {p.amount(low)} and {p.amount(high)}")
    if p.std > UNCERTAIN * p.size:
        return Doubt("not pinned", (p.name,), f"{p.name} = {p.amount(p.value)} is uncertain by {p.std / p.size:.0%}")
    return None


def _flat(parameters: Sequence[Fitted], effect: np.ndarray) -> list[Doubt]:
    """Combinations that can change as a whole without leaving a trace."""
    if not parameters:
        return []
    _, singular, right = np.linalg.svd(effect, full_matrices=effect.shape[0] < effect.shape[1])
    singular = np.r_[singular, np.zeros(len(right) - len(singular))]
    found = []
    for row in right[singular < UNSEEN]:
        largest = np.argsort(-np.abs(row), kind="stable")[:FLAT_MEMBERS]
        members = sorted(int(k) for k in largest if abs(row[k]) > MEMBER * np.abs(row).max())
        if all(parameters[k].is_tolerance for k in members):
            continue
        sign = np.sign(row[members[0]])
        steps = [(parameters[k], float(sign * row[k] * parameters[k].size)) for k in members]
        words = [f"{p.name} {'rises' if step > 0 else 'falls'} by {p.amount(abs(step))}" for p, step in steps]
        message = f"the data do not show whether {' while '.join([words[0], ' and '.join(words[1:])])}"
        found.append(Doubt("flat", tuple(p.name for p, _ in steps), message))
    return found


def _traded(parameters: Sequence[Fitted], effect: np.ndarray, flat: Sequence[set[str]]) -> list[Doubt]:
    """Pairs that the data pin together and not one by one."""
    inverse = np.linalg.pinv(effect.T @ effect, hermitian=True)
    spread = np.sqrt(np.diag(inverse))
    found = []
    for i, j in combinations(range(len(parameters)), 2):
        first, second = parameters[i], parameters[j]
        names = (first.name, second.name)
        if (first.is_tolerance and second.is_tolerance) or any(set(names) <= part for part in flat):
            continue
        correlation = float(inverse[i, j] / max(spread[i] * spread[j], 1e-300))
        if abs(correlation) > TRADED:
            way = "in opposite directions" if correlation < 0 else "together"
            message = (
                f"{names[0]} and {names[1]} trade off, they can move {way} (correlation {correlation:+.3f}): the data pin"
                " them less well one by one than in combination"
            )
            found.append(Doubt("trade-off", names, message))
    return found


def doubts_of(found: Refit, learning: LearningData) -> list[Doubt]:
    """What the data leave open about the parameters of a fitted set of effects.

    Raises:
        ComponentError: if the model fails along the way.
    """
    parameters, columns = whitened(found, learning)
    return doubts(parameters, columns)


def whitened(found: Refit, learning: LearningData) -> tuple[list[Fitted], np.ndarray]:
    """Parameters of effects and tolerances, and their columns in units of what is left, starts and clocks projected away."""
    _, jacobian = linearised(found, learning)
    count = len(found.fit.values)
    data = slice(0, found.fit.rows)
    jacobian[data] /= max(found.cost**0.5, 1e-300)
    basis = orthonormal(jacobian[:, count:], 1e-9)
    columns = jacobian[:, :count] - basis @ (basis.T @ jacobian[:, :count])
    return _parameters(found), columns


def parameter_names(found: Refit) -> list[str]:
    """Names of the effects' parameters as a reader knows them: `viscous_friction b[1]`."""
    chosen = found.effects.candidates
    if not chosen:
        return []
    pairs = zip(found.effects.owners(), found.effects.variables, strict=True)
    return [f"{chosen[owner].card.id} {v.name.removeprefix(f'{chosen[owner].slot}.')}" for owner, v in pairs]


def _parameters(found: Refit) -> list[Fitted]:
    size, fit = found.size, found.fit
    rows = (
        zip(parameter_names(found), found.effects.variables, found.effects.card_parameters, strict=True) if size else ()
    )
    result = [
        Fitted(
            name,
            variable.unit,
            float(fit.values[k]),
            float(fit.std[k]),
            max(abs(float(fit.values[k]) - (p.absent if np.isfinite(p.absent) else 0.0)), 0.1 * abs(p.start)),
            bool(fit.at_bound[k]),
        )
        for k, (name, variable, p) in enumerate(rows)
    ]
    units: Mapping[str, str] = {v.name: v.unit for v in found.model.system.parameters}
    for k, name in enumerate(found.model.compiled.free[size:], start=size):
        value, std = float(fit.values[k]), float(fit.std[k])
        result.append(Fitted(name, units[name], value, std, abs(value), is_tolerance=True))
    return result
