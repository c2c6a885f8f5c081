"""Best subsets in the force domain: whitened innovations against those of each candidate, under block cross-validation.

The filter of a fitted model turns what a candidate's force would change into a series of whitened innovations. Linear
regression on them is the first step of the likelihood's search, costs one filter run for all candidates, and needs no free run.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from orchestrator.greybox.candidates import Candidate
from orchestrator.greybox.fit import Fit

# Stretches of the record whose losses are compared, and folds that each hold every so manieth of them: an effect that acts
# in one part of a record only, an overflow or a stop, is then seen in all folds.
STRETCHES, FOLDS = 144, 8
LARGEST = 3
BEAM = 40


def stretches_of(lengths: Sequence[int], count: int = STRETCHES) -> list[np.ndarray]:
    """Number of the stretch that each sample belongs to, for each trial; no stretch goes over two trials."""
    total, found, first = sum(lengths), [], 0
    for length in lengths:
        own = max(1, round(count * length / total), -(-FOLDS // len(lengths)))
        found.append(first + np.minimum(np.arange(length) * own // length, own - 1))
        first += own
    return found


@dataclass(frozen=True, eq=False)
class Normal:
    """Normal equations by stretch: `matrix` (ns, m, m), `vector` (ns, m), `square` (ns,), `count` (ns,)."""

    matrix: np.ndarray
    vector: np.ndarray
    square: np.ndarray
    count: np.ndarray

    def from_zero(self, theta: np.ndarray) -> "Normal":
        """The same for parameters (m,) counted from zero instead of from `theta`, where they were fitted: each may be left out."""
        vector = self.vector - self.matrix @ theta
        square = self.square - 2 * self.vector @ theta + np.einsum("k,bkl,l->b", theta, self.matrix, theta)
        return Normal(self.matrix, vector, square, self.count)

    @property
    def folds(self) -> "Normal":
        """The same, summed over the stretches of each fold."""
        fold = np.arange(len(self.square)) % FOLDS
        return Normal(
            *(
                np.array([part[fold == f].sum(axis=0) for f in range(min(FOLDS, len(fold)))])
                for part in (self.matrix, self.vector, self.square, self.count)
            )
        )


def normal_equations(fit: Fit) -> Normal:
    """Of the whitened innovations of a fit in its free parameters; columns are slopes of what is left."""
    lengths = [len(t.time) for t in fit.trials]
    blocks = stretches_of(lengths)
    number = int(blocks[-1][-1]) + 1
    m = len(fit.theta)
    matrix, vector = np.zeros((number, m, m)), np.zeros((number, m))
    square, count = np.zeros(number), np.zeros(number)
    for (error, slope, _), block, run in zip(fit.whitened(), blocks, fit.runs, strict=True):
        for b in np.unique(block):
            rows = slope[block == b].reshape(np.count_nonzero(block == b) * slope.shape[1], m)
            errors = error[block == b].ravel()
            matrix[b], vector[b] = rows.T @ rows, rows.T @ errors
            square[b], count[b] = errors @ errors, np.count_nonzero(run.variance[block == b] > 0)
    return Normal(matrix, vector, square, count)


@dataclass(frozen=True)
class Screened:
    """A set of candidates with the gain in cross-validated log likelihood and its first values."""

    candidates: tuple[Candidate, ...]
    score: float
    gains: tuple[float, ...]


def best_subsets(
    normal: Normal,
    columns: Sequence[tuple[Candidate, int]],
    kept: Sequence[int] = (),
    largest: int = LARGEST,
    spread: Sequence[float] | None = None,
) -> list[Screened]:
    """Sets of candidates that explain the innovations best, best first.

    Args:
        columns: for each free parameter the candidate that it belongs to, and 1 if it must not be negative, -1 if not positive.
        kept: places of parameters that take part in every set.
        spread: standard deviations of the parameters' priors.
    """
    places: dict[int, list[int]] = {}
    order: list[Candidate] = []
    for place, (candidate, _) in enumerate(columns):
        if place in kept:
            continue
        if not order or order[-1] is not candidate:
            order.append(candidate)
        places.setdefault(len(order) - 1, []).append(place)
    signs = np.array([sign for _, sign in columns])
    found: dict[tuple[int, ...], tuple[float, np.ndarray]] = {}

    normal = normal.folds
    inverse_prior = 1.0 / np.asarray(spread) ** 2 if spread is not None else np.zeros(len(columns))

    def tried(sets: Sequence[tuple[int, ...]]) -> None:
        by_size: dict[int, list[tuple[int, ...]]] = {}
        for each in sets:
            by_size.setdefault(sum(len(places[c]) for c in each), []).append(each)
        for group in by_size.values():
            rows = np.array([[*kept, *(p for c in each for p in places[c])] for each in group])
            scores, values = _scores(normal, rows, signs, len(kept), inverse_prior)
            found.update({each: (float(s), v) for each, s, v in zip(group, scores, values, strict=True)})

    singles: list[tuple[int, ...]] = [(c,) for c in places]
    tried(singles)
    beam = singles
    for _ in range(1, largest):
        ranked = sorted(beam, key=lambda s: -found[s][0])
        ranked = [s for s in ranked if np.isfinite(found[s][0])]
        wide = beam if len(singles) <= 60 and len(beam) == len(singles) else ranked[:BEAM]
        beam = list(
            {
                tuple(sorted({*s, c}))
                for s in wide
                for c in places
                if c not in s and all(order[c].is_apart_from(order[own]) for own in s)
            }
        )
        tried(beam)
    best = sorted((s for s in found if np.isfinite(found[s][0])), key=lambda s: -found[s][0])
    return [Screened(tuple(order[c] for c in s), found[s][0], tuple(found[s][1][len(kept) :])) for s in best]


def _scores(
    normal: Normal, rows: np.ndarray, signs: np.ndarray, kept: int, inverse_prior: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Gain in profiled log likelihood of left-out blocks for each set of columns (sets, k), and values with all blocks."""
    g = normal.matrix[:, rows[:, :, None], rows[:, None, :]]  # (blocks, sets, k, k)
    v = normal.vector[:, rows]
    whole, right = g.sum(axis=0) + inverse_prior[rows][:, :, None] * np.eye(rows.shape[1]), v.sum(axis=0)
    scale = np.sqrt(np.maximum(np.einsum("skk->sk", whole), 1e-300))

    def solved(matrix: np.ndarray, vector: np.ndarray) -> np.ndarray:
        scaled = matrix / scale[..., :, None] / scale[..., None, :] + 1e-9 * np.eye(rows.shape[1])
        return -np.linalg.solve(scaled, (vector / scale)[..., None])[..., 0] / scale

    values = solved(whole, right)
    left_out = solved(whole - g, right - v)
    loss = normal.square[:, None] + 2 * np.einsum("bsk,bsk->bs", v, left_out)
    loss = loss + np.einsum("bsk,bskl,bsl->bs", left_out, g, left_out)
    n = normal.count.sum()
    score = -0.5 * n * np.log(np.maximum(loss.sum(axis=0), 1e-300) / normal.square.sum())
    wrong = (values[:, kept:] * signs[rows[:, kept:]] < 0).any(axis=1)
    return np.where(wrong, -np.inf, score), values
