"""The latent force: what is left of the residual as a curve over the two coordinates that tell most about it.

A Gaussian process with a squared-exponential kernel over two coordinates, each divided by its spread. Rasmussen and
Williams, Gaussian Processes for Machine Learning (2006), equations 2.23 to 2.26 and 2.30.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.linalg import cho_solve, cholesky, solve_triangular

from orchestrator.diagnosis.advise.thresholds import FOLDS, GRID, LATENT_SAMPLES, LENGTHS, NOISES, ROUGH
from orchestrator.models.estimation import Z90
from orchestrator.verdicts.latent_force import LatentForce


@dataclass(frozen=True)
class Series:
    """One quantity along all trials: `values` has one array (n,) for each trial."""

    name: str
    unit: str
    values: tuple[np.ndarray, ...]


def latent_force(residual: Series, coordinates: Sequence[Series]) -> LatentForce | None:
    """Find the two coordinates that explain a residual best on data left out, and the curve over them.

    Returns:
        None if there are fewer than two coordinates that vary, or too few samples.
    """
    target = np.concatenate(residual.values)
    columns = {c.name: np.concatenate(c.values) for c in coordinates}
    units = {c.name: c.unit for c in coordinates}
    columns = {name: values for name, values in columns.items() if np.ptp(values) > 1e-9 * (1 + np.abs(values).max())}
    if len(columns) < 2 or len(target) < 40:
        return None
    keep = np.unique(np.linspace(0, len(target) - 1, LATENT_SAMPLES).astype(int))
    target = target[keep]
    scaled = {name: (v[keep] - np.median(v)) / np.std(v) for name, v in columns.items()}
    first = _best([[name] for name in scaled], scaled, target)
    pair = _best([[*first, name] for name in scaled if name not in first], scaled, target)
    x = np.column_stack([scaled[name] for name in pair])
    alone, both = (_explained(part, target, LENGTHS, NOISES) for part in (x[:, :1], x))
    process = _Process.fitted(x, target)
    grids = [np.linspace(np.quantile(x[:, k], 0.02), np.quantile(x[:, k], 0.98), GRID) for k in (0, 1)]
    line = np.column_stack([grids[0], np.zeros(GRID)])
    mean, std = process.predict(line)
    surface = process.predict(np.array(list(product(*grids))))[0].reshape(GRID, GRID)

    def real(k: int) -> tuple[float, ...]:
        values = columns[pair[k]]
        return tuple(map(float, np.median(values) + grids[k] * np.std(values)))

    return LatentForce(
        signal=residual.name,
        unit=residual.unit,
        coordinates=(pair[0], pair[1]),
        coordinate_units=(units[pair[0]], units[pair[1]]),
        explained=(max(alone, 0.0), max(both, 0.0)),
        at=real(0),
        force=tuple(map(float, mean)),
        low=tuple(map(float, mean - Z90 * std)),
        high=tuple(map(float, mean + Z90 * std)),
        surface_at=real(1),
        surface=tuple(tuple(map(float, row)) for row in surface),
    )


def _best(choices: Sequence[list[str]], scaled: Mapping[str, np.ndarray], target: np.ndarray) -> list[str]:
    """The choice of coordinates that explains most on blocks left out."""
    return max(choices, key=lambda names: _explained(np.column_stack([scaled[n] for n in names]), target, *ROUGH))


def _explained(x: np.ndarray, target: np.ndarray, lengths: Sequence[float], noises: Sequence[float]) -> float:
    """Share of the target's square explained on contiguous blocks left out, one after another."""
    error = np.empty(len(target))
    for block in np.array_split(np.arange(len(target)), FOLDS):
        rest = np.setdiff1d(np.arange(len(target)), block)
        error[block] = target[block] - _Process.fitted(x[rest], target[rest], lengths, noises).predict(x[block])[0]
    return 1.0 - float(np.mean(error**2) / np.mean(target**2))


@dataclass(frozen=True)
class _Process:
    """A Gaussian process given data; targets are divided by `size`."""

    x: np.ndarray
    weights: np.ndarray
    factor: np.ndarray
    length: float
    noise: float
    size: float

    @staticmethod
    def fitted(
        x: np.ndarray, target: np.ndarray, lengths: Sequence[float] = LENGTHS, noises: Sequence[float] = NOISES
    ) -> "_Process":
        """The process whose length scale and noise level make the data most likely, on a small grid."""
        size = float(np.sqrt(np.mean(target**2))) or 1.0
        y = target / size
        best: tuple[float, _Process] | None = None
        squares = _squares(x, x)
        for length, noise in product(lengths, noises):
            kernel = np.exp(-0.5 * squares / length**2)
            factor = cholesky(kernel + noise**2 * np.eye(len(y)), lower=True, overwrite_a=True, check_finite=False)
            weights = cho_solve((factor, True), y)
            likelihood = -0.5 * float(y @ weights) - float(np.sum(np.log(np.diag(factor))))
            if best is None or likelihood > best[0]:
                best = likelihood, _Process(x, weights, factor, length, noise, size)
        assert best is not None
        return best[1]

    def predict(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean and standard deviation of the curve itself, without noise."""
        across = np.exp(-0.5 * _squares(x, self.x) / self.length**2)
        half = solve_triangular(self.factor, across.T, lower=True)
        variance = np.maximum(1.0 - np.sum(half**2, axis=0), 0.0)
        return self.size * across @ self.weights, self.size * np.sqrt(variance)


def _squares(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Squared distances between the rows of two arrays."""
    return np.sum((a[:, None, :] - b[None, :, :]) ** 2, axis=-1)
