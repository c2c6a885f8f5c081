"""What else one could do with the same library: each method names effects and ranks single ones.

None of them knows its false alarms: random and correlation always name one effect.
"""

import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tests.benchmarks.diagnosis.baselines.regression import Regression, explained, unit

MOST = 5


@dataclass(frozen=True)
class Named:
    """Effects that a method names, and its ranking of single effects, best first."""

    effects: tuple[str, ...]
    ranking: tuple[str, ...]


def random_choice(problem: Regression, seed: int) -> Named:
    """One effect of the library by chance."""
    order = np.random.default_rng(seed).permutation(sorted(set(problem.ids)))
    return Named((str(order[0]),), tuple(map(str, order)))


def correlation(problem: Regression, seed: int) -> Named:
    """The effect with the column that is most like the residual."""
    problem = problem.compressed
    residual = problem.residual / np.linalg.norm(problem.residual)
    like = [float(np.abs(unit(group).T @ residual).max()) for group in problem.groups]
    ranking = tuple(dict.fromkeys(problem.ids[k] for k in sorted(range(len(like)), key=lambda k: -like[k])))
    return Named(ranking[:1], ranking)


def forward_bic(problem: Regression, seed: int) -> Named:
    """Forward selection of candidates by BIC = n log(left) + k log n, samples counted as independent."""
    problem = problem.compressed
    n, chosen = problem.samples, list[int]()
    best = n * np.log(float(problem.residual @ problem.residual))
    while len(chosen) < MOST:
        scores = {k: _bic(problem, [*chosen, k]) for k in range(len(problem.groups)) if k not in chosen}
        if not scores or min(scores.values()) >= best:
            break
        chosen.append(min(scores, key=scores.__getitem__))
        best = scores[chosen[-1]]
    return Named(_ids(problem, chosen), _by_share(problem))


def _bic(problem: Regression, chosen: list[int]) -> float:
    columns = np.hstack([problem.groups[k] for k in chosen])
    left = (1 - explained(problem.residual, columns)) * float(problem.residual @ problem.residual)
    n = problem.samples
    return n * float(np.log(max(left, 1e-300))) + columns.shape[1] * float(np.log(n))


def lasso(problem: Regression, seed: int) -> Named:
    """LASSO; its penalty is the largest whose cross-validated error is within one standard error of the best."""
    from sklearn.exceptions import ConvergenceWarning  # type: ignore[import-not-found]
    from sklearn.linear_model import Lasso, LassoCV  # type: ignore[import-not-found]

    x, y = problem.columns, problem.residual / np.std(problem.residual)
    x = x * np.sqrt(len(y))
    with warnings.catch_warnings():  # columns are nearly alike; the smallest penalties do not converge and do not win
        warnings.simplefilter("ignore", ConvergenceWarning)
        search = LassoCV(cv=5, alphas=30, max_iter=1000, tol=1e-3).fit(x, y)
        error = search.mse_path_.mean(axis=1)
        limit = error.min() + search.mse_path_[error.argmin()].std() / np.sqrt(5)
        penalty = float(search.alphas_[error <= limit].max())
        return _from_coefficients(problem, Lasso(alpha=penalty, max_iter=1000, tol=1e-3).fit(x, y).coef_)


def stlsq(problem: Regression, seed: int) -> Named:
    """Sequentially thresholded least squares (Brunton, Proctor, Kutz, PNAS 113, 2016), the heart of SINDy.

    Written out here, as PySINDy brings a differentiation of states and a library of its own that would have to be
    bypassed. The threshold, a share of the largest coefficient, is the one with the least BIC.
    """
    problem = problem.compressed
    x, y, n = problem.columns, problem.residual, problem.samples
    best, found = np.inf, np.zeros(x.shape[1])
    for threshold in (0.02, 0.05, 0.1, 0.2, 0.4):
        active, w = np.ones(x.shape[1], bool), np.zeros(x.shape[1])
        for _ in range(20):
            w[:] = 0.0
            w[active] = np.linalg.lstsq(x[:, active], y, rcond=1e-8)[0]
            still = np.abs(w) > threshold * np.abs(w).max()
            if np.array_equal(still, active):
                break
            active = still
        left = y - x @ w
        score = n * np.log(float(left @ left) + 1e-300) + active.sum() * np.log(n)
        if score < best:
            best, found = score, w.copy()
    return _from_coefficients(problem, found)


def _from_coefficients(problem: Regression, coefficients: np.ndarray) -> Named:
    used = sorted({int(problem.owners[k]) for k in np.flatnonzero(coefficients)})
    weight = [np.abs(coefficients[problem.owners == k]).sum() for k in range(len(problem.groups))]
    order = sorted(range(len(problem.groups)), key=lambda k: -weight[k])
    return Named(_ids(problem, used), tuple(dict.fromkeys(problem.ids[k] for k in order)))


def _by_share(problem: Regression) -> tuple[str, ...]:
    share = [explained(problem.residual, unit(group)) for group in problem.groups]
    order = sorted(range(len(share)), key=lambda k: -share[k])
    return tuple(dict.fromkeys(problem.ids[k] for k in order))


def _ids(problem: Regression, chosen: list[int]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(problem.ids[k] for k in chosen))


METHODS: dict[str, Callable[[Regression, int], Named]] = {
    "random": random_choice,
    "correlation": correlation,
    "forward selection, BIC": forward_bic,
    "LASSO": lasso,
    "STLSQ": stlsq,
}
