"""The best sets of blocks for many error vectors at once, by beam search on a Gram matrix."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import special

from orchestrator.diagnosis.linear.thresholds import BEAM, HIDDEN, MOST_EFFECTS, SEPARATE


@dataclass(frozen=True)
class BestSet:
    """A set of blocks for one error vector: its positions, the drop of the sum of squares, and its score.

    `score` is minus the logarithm of the chance that noise gives some set of this size so large a drop, each taken by
    itself and then times the number of sets: it lets sets of different size be compared.
    """

    blocks: tuple[int, ...]
    gain: float
    score: float


class Library:
    """Orthonormal bases of blocks (columns (m, k) of the same rows), for best subset regressions.

    `owners[i]` names the candidate of block i; of one candidate's blocks a set holds one at most.
    """

    def __init__(self, bases: Sequence[np.ndarray], owners: Sequence[str]) -> None:
        self.owners = tuple(owners)
        self.distinct = len(set(owners))
        self.sizes = np.array([basis.shape[1] for basis in bases], dtype=int)
        self.stacked = np.column_stack(bases) if bases else np.zeros((0, 0))
        width, edges = max(self.sizes, default=0), np.r_[0, np.cumsum(self.sizes)]
        total = self.stacked.shape[1]
        # Positions of each block's columns; `total` stands for none, a column of zeros.
        self._index = np.full((len(bases), width), total)
        for k, size in enumerate(self.sizes):
            self._index[k, :size] = np.arange(edges[k], edges[k + 1])
        self._gram = np.zeros((total + 1, total + 1))
        self._gram[:total, :total] = self.stacked.T @ self.stacked
        names = np.array(owners)
        self._rivals = names[:, None] == names[None, :]
        self._kept: dict[tuple[int, ...], _Extension] = {}

    def best(self, error: np.ndarray, most: int = MOST_EFFECTS) -> list[BestSet]:
        """Best set of each number of blocks up to `most`, for one error vector (m,)."""
        return self.best_of_moments(self.stacked.T @ error, most) if len(self.sizes) else []

    def best_of_moments(self, moments: np.ndarray, most: int = MOST_EFFECTS) -> list[BestSet]:
        """The same for the inner products (P,) of the bases with the error."""
        if not len(self.sizes):
            return []
        beam: list[tuple[int, ...]] = [()]
        padded, found = np.r_[moments, 0.0], list[BestSet]()
        for _ in range(most):
            tried: dict[tuple[int, ...], float] = {}
            for blocks in beam:
                gains = self._extension(blocks).gains(padded)
                for k in np.argsort(-gains, kind="stable")[:BEAM]:
                    if np.isfinite(gains[k]):
                        tried[tuple(sorted((*blocks, int(k))))] = float(gains[k])
            ranked = sorted((-self._score(blocks, gain), blocks) for blocks, gain in tried.items())
            if not ranked:
                break
            beam = [blocks for _, blocks in ranked[:BEAM]]
            found.append(BestSet(beam[0], tried[beam[0]], -ranked[0][0]))
        return found

    def hidden_pair(self, error: np.ndarray) -> BestSet | None:
        """The pair that explains the most of those that explain `HIDDEN` times what their blocks do alone, for an error (m,).

        A beam never meets it: an encoder's offset and its scale may each be all but of one shape with the other, and hardly
        with the error, which they leave none of together.
        """
        moments = np.r_[self.stacked.T @ error, 0.0]
        alone, best = self._extension(()).gains(moments), None
        for k in range(len(self.sizes)):
            gains = self._extension((k,)).gains(moments)
            gains[gains < HIDDEN * (alone[k] + alone)] = -np.inf
            other = int(np.argmax(gains))
            if np.isfinite(gains[other]) and (best is None or gains[other] > best.gain):
                blocks, gain = (min(k, other), max(k, other)), float(gains[other])
                best = BestSet(blocks, gain, self._score(blocks, gain))
        return best

    def _score(self, blocks: tuple[int, ...], gain: float) -> float:
        return score(gain, int(self.sizes[list(blocks)].sum()), self.distinct, len(blocks))

    def _extension(self, blocks: tuple[int, ...]) -> "_Extension":
        if blocks in self._kept:
            return self._kept[blocks]
        inside = np.concatenate([self._index[b][: self.sizes[b]] for b in blocks]) if blocks else np.zeros(0, int)
        inverse = np.linalg.pinv(self._gram[np.ix_(inside, inside)], rcond=1e-8, hermitian=True)
        weights = inverse @ self._gram[inside]
        rows, columns = self._index[:, :, None], self._index[:, None, :]
        # What is left of each block's Gram matrix when `blocks` are projected out
        left = self._gram[rows, columns] - np.einsum(
            "pki,pkj->kij", self._gram[inside][:, self._index], weights[:, self._index]
        )
        values, vectors = np.linalg.eigh(left)
        roots = vectors * np.where(values > SEPARATE, values, np.inf)[:, None, :] ** -0.5
        excluded = self._rivals[list(blocks)].any(axis=0)
        made = _Extension(inside, inverse, weights, self._index, roots, excluded)
        if len(blocks) < 2:
            self._kept[blocks] = made
        return made


@dataclass(frozen=True)
class _Extension:
    """What it takes to tell the drop of the sum of squares by some blocks and any one more."""

    inside: np.ndarray
    inverse: np.ndarray
    weights: np.ndarray
    index: np.ndarray
    roots: np.ndarray
    excluded: np.ndarray

    def gains(self, moments: np.ndarray) -> np.ndarray:
        own = moments[self.inside]
        right = moments - self.weights.T @ own
        extra = np.einsum("kij,ki->kj", self.roots, right[self.index])
        gains = float(own @ self.inverse @ own) + np.sum(extra**2, axis=1)
        return np.where(self.excluded, -np.inf, gains)


def score(gain: float, parameters: int, candidates: int, effects: int) -> float:
    """Minus log(chance of a chi-squared drop >= `gain` with `parameters`) minus log(number of sets of `effects`).

    Args:
        gain: drop of the sum of squares in units of the noise's power.
        parameters: number of parameters of the set.
        candidates: number of candidates to choose from.
        effects: number of effects of the set.
    """
    return -log_tail(gain, parameters) - log_sets(candidates, effects)


def log_sets(candidates: int, effects: int) -> float:
    """Logarithm of the number of sets of `effects` among at least as many `candidates`.

    >>> round(np.exp(log_sets(5, 2)), 6).item()
    10.0
    """
    n, k = max(candidates, effects), effects
    return float(special.gammaln(n + 1) - special.gammaln(k + 1) - special.gammaln(n - k + 1))


def log_tail(gain: float, parameters: int) -> float:
    """Logarithm of the upper tail of a chi-squared distribution, also where it underflows.

    >>> round(log_tail(2.0, 2), 6)
    -1.0
    """
    half, x = 0.5 * parameters, 0.5 * gain
    tail = special.gammaincc(half, x)
    if tail > 1e-250:
        return float(np.log(tail))
    # Gamma(a, x) ~ x^(a - 1) exp(-x) (1 + (a - 1) / x) for large x
    return float((half - 1) * np.log(x) - x - special.gammaln(half) + np.log1p((half - 1) / x))
