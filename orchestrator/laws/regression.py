"""Beam search over sums of terms by linear regression on whitened innovations, under block cross-validation.

Each column is a term with one choice of its shapes. A sum of one to three terms is scored by the gain in the log likelihood of
left-out stretches of the record, less half the logarithm of the number of samples for each constant (Schwarz 1978).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from orchestrator.greybox.candidates import Candidate
from orchestrator.greybox.fit import Fit
from orchestrator.greybox.memory import force
from orchestrator.greybox.places import Place
from orchestrator.greybox.screen import FOLDS, stretches_of
from orchestrator.laws.response import Response
from orchestrator.laws.terms import Term, law_of, nearby, variants

BEAM = 12
LARGEST = 3
# Shapes are made finer for so many of the best sums.
ZOOMED = 30


@dataclass(frozen=True, eq=False)
class Column:
    """A term with its shapes: the place that its force has among the columns of a table."""

    term: Term
    candidate: Candidate


@dataclass(frozen=True, eq=False)
class Table:
    """Whitened innovations: `error` (rows,), their slopes in each column's gain `slopes` (rows, m) and in the gains that a
    fit has already, `kept` (rows, k); `fold` (rows,) numbers the block that a row is left out with."""

    columns: tuple[Column, ...]
    error: np.ndarray
    slopes: np.ndarray
    kept: np.ndarray
    fold: np.ndarray


@dataclass(frozen=True)
class Sum:
    """Columns of a table with the score of their sum."""

    columns: tuple[int, ...]
    score: float


def all_columns(terms: Sequence[Term], place: Place) -> tuple[Column, ...]:
    """Every term with every choice of its shapes."""
    return tuple(Column(term, c) for term in terms for c in variants(law_of([term], place), place))


def finer_columns(table: Table, sums: Sequence["Sum"], reach: float) -> tuple[Column, ...]:
    """The terms of the best sums with shapes about those that they have there.

    Args:
        table: the terms with the shapes that were looked at.
        sums: sums of them, best first.
        reach: how far the new shapes are from theirs, in doublings.
    """
    chosen = dict.fromkeys(c for each in sums[:ZOOMED] for c in each.columns)
    found = {}
    for column in (table.columns[c] for c in chosen):
        for candidate in nearby(column.candidate, reach):
            found[column.term.id, *candidate.shapes.values()] = Column(column.term, candidate)
    return tuple(found.values())


def table_of(fit: Fit, answers: Sequence[Response], columns: tuple[Column, ...]) -> Table:
    """Terms with their shapes as what their forces change of the innovations.

    Args:
        fit: the filter's fit whose innovations are explained.
        answers: how the innovations of each trial answer to a force.
        columns: the terms, each with its shape.
    """
    errors, slopes, kept, folds = [], [], [], []
    blocks = stretches_of([len(t.time) for t in fit.trials])
    for answer, (error, own, _), block in zip(answers, fit.whitened(), blocks, strict=True):
        forces = np.column_stack([force(c.candidate, answer.coordinates, answer.time) for c in columns])
        forces = np.where(np.isfinite(forces), forces, 0.0)
        scale = np.maximum(np.abs(forces).max(axis=0), 1e-300)
        found = answer.slopes(forces / scale) * scale
        errors.append(error.ravel())
        slopes.append(found.reshape(-1, len(columns)))
        kept.append(own.reshape(len(error.ravel()), -1))
        folds.append(np.repeat(block % FOLDS, error.shape[1]))
    return Table(columns, *(np.concatenate(part) for part in (errors, slopes, kept, folds)))


class BeamSearch:
    """Sums of terms, grown one term at a time from the best ones."""

    def __init__(self, table: Table) -> None:
        size = np.sqrt(np.mean(table.slopes**2, axis=0))
        self.useful = np.isfinite(size) & (size > 0)
        scale = np.where(self.useful, size, 1.0)
        self.table = table
        self.slopes = np.where(self.useful, table.slopes / scale, 0.0)
        folds = [table.fold == f for f in range(FOLDS)]
        self.folds = [rows for rows in folds if rows.any()]
        self.squares = np.array([table.error[rows] @ table.error[rows] for rows in self.folds])
        self.vectors = np.array([self.slopes[rows].T @ table.error[rows] for rows in self.folds])
        self.diagonals = np.array([np.einsum("rm,rm->m", self.slopes[rows], self.slopes[rows]) for rows in self.folds])
        self.samples = np.count_nonzero(table.error)
        self.prices = 0.5 * np.log(self.samples) * np.array([c.term.cost for c in table.columns])
        self.nothing = self._score_of(())

    def run(self) -> list[Sum]:
        """The best sums of each size, best first."""
        found: dict[tuple[int, ...], float] = {}
        beam: list[tuple[int, ...]] = [()]
        for _ in range(LARGEST):
            grown: dict[tuple[int, ...], float] = {}
            for start in beam:
                for column, score in self._extended(start):
                    grown.setdefault(tuple(sorted((*start, column))), score)
            ranked = sorted(grown, key=lambda s: -grown[s])
            beam = self._different(ranked)[:BEAM]
            found |= {s: grown[s] for s in beam}
        return [Sum(s, found[s]) for s in sorted(found, key=lambda s: -found[s])]

    def _different(self, ranked: Sequence[tuple[int, ...]]) -> list[tuple[int, ...]]:
        """The best choice of shapes of each sum of terms."""
        first: dict[tuple[str, ...], tuple[int, ...]] = {}
        for s in ranked:
            first.setdefault(tuple(sorted(self.table.columns[c].term.id for c in s)), s)
        return list(first.values())

    def _extended(self, start: tuple[int, ...]) -> list[tuple[int, float]]:
        """The best shapes of each further term beside a sum, with the score of both."""
        scores = self._scores_beside(start)
        taken = {self.table.columns[c].term.id for c in start}
        best: dict[str, int] = {}
        for column in np.argsort(-scores):
            term = self.table.columns[column].term
            if np.isfinite(scores[column]) and term.id not in taken:
                best.setdefault(term.id, int(column))
        return [(c, float(scores[c])) for c in list(best.values())[: 2 * BEAM]]

    def _score_of(self, start: tuple[int, ...]) -> float:
        base = np.column_stack([self.table.kept, self.slopes[:, list(start)]])
        if not base.shape[1]:
            return 0.0
        g = np.array([base[rows].T @ base[rows] for rows in self.folds])[:, None]
        v = np.array([base[rows].T @ self.table.error[rows] for rows in self.folds])[:, None]
        return float(self._gains(g, v)[0])

    def _scores_beside(self, start: tuple[int, ...]) -> np.ndarray:
        """Scores (m,) of a sum with each column beside it."""
        base = np.column_stack([self.table.kept, self.slopes[:, list(start)]])
        k, m = base.shape[1], self.slopes.shape[1]
        g, v = np.zeros((len(self.folds), m, k + 1, k + 1)), np.zeros((len(self.folds), m, k + 1))
        for f, rows in enumerate(self.folds):
            g[f, :, :k, :k] = base[rows].T @ base[rows]
            cross = self.slopes[rows].T @ base[rows]
            g[f, :, :k, k] = g[f, :, k, :k] = cross
            g[f, :, k, k] = self.diagonals[f]
            v[f, :, :k] = base[rows].T @ self.table.error[rows]
            v[f, :, k] = self.vectors[f]
        prices = self.prices[list(start)].sum() + self.prices
        scores = self._gains(g, v) - self.nothing - prices if start or k else self._gains(g, v) - prices
        return np.where(self.useful, scores, -np.inf)

    def _gains(self, g: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Gain in profiled log likelihood of left-out blocks for each set: g (folds, sets, k, k), v (folds, sets, k)."""
        whole, right = g.sum(axis=0), v.sum(axis=0)
        scale = np.sqrt(np.maximum(np.einsum("skk->sk", whole), 1e-300))
        ridge = 1e-9 * np.eye(g.shape[-1])
        matrix = (whole - g) / scale[:, :, None] / scale[:, None, :] + ridge
        left_out = -np.linalg.solve(matrix, ((right - v) / scale)[..., None])[..., 0] / scale
        loss = self.squares[:, None] + 2 * np.einsum("bsk,bsk->bs", v, left_out)
        loss = loss + np.einsum("bsk,bskl,bsl->bs", left_out, g, left_out)
        return -0.5 * self.samples * np.log(np.maximum(loss.sum(axis=0), 1e-300) / self.squares.sum())
