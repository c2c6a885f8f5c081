"""Which forces move which states, where a model's equations are solved for accelerations: a = (J*f - c*tau)/D.

A force that is missing there moves several states, with factors that change along the motion. It belongs where the model sums
up the forces: the accelerations' slopes in generalised forces are the inverse of the mass matrix, which is symmetric and
positive definite, so that the slopes tell which force drives which state.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

# More forces than that are not tried against each other.
MOST = 8
# Slopes that differ by less, as a share of those on the diagonal, are equal.
EQUAL = 1e-6


@dataclass(frozen=True, eq=False)
class Slopes:
    """Slopes (points, states, forces) of the rates of states that are speeds, at points near the start.

    `own` (points, states, states) are those in the forces of balances that are sums of forces already, `stands` (states,) tells
    which have one. `fits` (states, forces) tells whether force and speed make a power.
    """

    forces: np.ndarray
    own: np.ndarray
    stands: np.ndarray
    fits: np.ndarray


def forces_of(slopes: Slopes) -> dict[int, tuple[int, float]]:
    """For states by number the force that drives each of them, and the sign of its slope; as many as there are.

    A force that also moves a state without a force of its own counts if it does so with changing factors, as in a linkage; with
    constant ones it may as well act between the two. Where several forces drive one state alone they have to do so alike: torques on
    either side of a gear do not.
    """
    options = [_options(i, slopes) for i in range(len(slopes.stands))]
    if max(map(len, options), default=0) > MOST:
        return {}
    best: dict[int, tuple[int, float]] = {}
    for taken in _assignments(options, 0, {}):
        if len(taken) > len(best) and _is_mass_matrix(taken, options, slopes):
            best = taken
    return best


def _options(i: int, slopes: Slopes) -> list[tuple[int, float]]:
    """The forces that may drive a state, with signs: their slope there never changes its sign."""
    if slopes.stands[i]:
        return []
    own = slopes.forces[:, i, :]
    steady = np.all(own > 0, axis=0) | np.all(own < 0, axis=0)
    return [(int(k), float(np.sign(own[0, k]))) for k in np.flatnonzero(steady & slopes.fits[i])]


def _assignments(
    options: Sequence[Sequence[tuple[int, float]]], i: int, taken: dict[int, tuple[int, float]]
) -> Iterator[dict[int, tuple[int, float]]]:
    if i == len(options):
        yield taken
        return
    used = {force for force, _ in taken.values()}
    for option in options[i]:
        if option[0] not in used:
            yield from _assignments(options, i + 1, {**taken, i: option})
    yield from _assignments(options, i + 1, taken)


def _is_mass_matrix(
    taken: dict[int, tuple[int, float]], options: Sequence[Sequence[tuple[int, float]]], slopes: Slopes
) -> bool:
    """Whether the slopes in chosen forces, beside those of balances, are the inverse of a mass matrix as far as it is known."""
    n = len(slopes.stands)
    columns = {i: sign * slopes.forces[:, :, k] for i, (k, sign) in taken.items()}
    columns |= {i: slopes.own[:, :, i] for i in range(n) if slopes.stands[i]}
    known = sorted(columns)
    matrix = np.stack([columns[i][:, known] for i in known], axis=-1)
    size = np.sqrt(np.abs(np.einsum("pi,pj->pij", *(np.diagonal(matrix, axis1=1, axis2=2),) * 2)))
    if np.any(np.abs(matrix - matrix.transpose(0, 2, 1)) > EQUAL * size) or np.linalg.eigvalsh(matrix).min() <= 0:
        return False
    for i, (force, _) in taken.items():
        rivals = np.abs(slopes.forces[:, i, [k for k, _ in options[i]]])
        alike = np.all(np.ptp(rivals, axis=1) <= EQUAL * rivals[:, 0])
        if not alike and not np.any(np.delete(columns[i], i, axis=1)):
            return False
        others = [k for k in range(n) if k not in columns]
        ratios = columns[i][:, others] / columns[i][:, [i]]
        moves = np.any(np.abs(ratios) > EQUAL, axis=0)
        changes = np.ptp(ratios, axis=0) > EQUAL * np.abs(ratios).max(axis=0, initial=0.0)
        alone = sum(force == option for each in options for option, _ in each) == 1
        if np.any(moves & ~changes) or (np.any(moves) and not alone):
            return False
    return True
