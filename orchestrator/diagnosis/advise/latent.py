"""The latent force: what is left of the residual as a curve over the two coordinates that tell most about it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from orchestrator.diagnosis.advise.thresholds import FOLDS, GRID, LATENT_SAMPLES, LENGTHS, NOISES, ROUGH
from orchestrator.gp.covariance import Latent
from orchestrator.gp.fit import fit
from orchestrator.gp.kernels import SquaredExponential
from orchestrator.gp.limits import Limits
from orchestrator.gp.noise import constant_noise
from orchestrator.gp.observations import observe
from orchestrator.gp.posterior import Posterior, condition
from orchestrator.models.estimation import Z90
from orchestrator.verdicts.latent_force import LatentForce

FORCE = "force"
# Nats; a fit that would gain less is done.
_ENOUGH = 0.01


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
    alone, both = (_explained(part, target, fitted=True) for part in (x[:, :1], x))
    curve = _curve(x, target, fitted=True)
    grids = [np.linspace(np.quantile(x[:, k], 0.02), np.quantile(x[:, k], 0.98), GRID) for k in (0, 1)]
    line = np.column_stack([grids[0], np.zeros(GRID)])
    mean, std = curve.mean(FORCE, line)[:, 0], np.sqrt(curve.variance(FORCE, line))
    surface = curve.mean(FORCE, np.array(list(product(*grids)))).reshape(GRID, GRID)

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
    return max(choices, key=lambda names: _explained(np.column_stack([scaled[n] for n in names]), target, fitted=False))


def _explained(x: np.ndarray, target: np.ndarray, fitted: bool) -> float:
    """Share of the target's square explained on contiguous blocks left out, one after another."""
    error = np.empty(len(target))
    for block in np.array_split(np.arange(len(target)), FOLDS):
        rest = np.setdiff1d(np.arange(len(target)), block)
        error[block] = target[block] - _curve(x[rest], target[rest], fitted).mean(FORCE, x[block])[:, 0]
    return 1.0 - float(np.mean(error**2) / np.mean(target**2))


def _curve(x: np.ndarray, target: np.ndarray, fitted: bool) -> Posterior:
    """What the target says of a smooth function of x, (n, coordinates); `ROUGH` hyperparameters where they are not fitted."""
    size, d = float(np.sqrt(np.mean(target**2))) or 1.0, x.shape[1]
    latents = {FORCE: Latent(SquaredExponential(size**2, (ROUGH[0],) * d))}
    if not fitted:
        return condition(latents, [observe("residual", x, FORCE, target, ROUGH[1] * size)])
    limits = {f"{FORCE}.length_scales[{k + 1}]": Limits(*LENGTHS) for k in range(d)}
    limits["residual.log deviation"] = Limits(*np.log(size * np.array(NOISES)))
    data = observe("residual", x, FORCE, target, constant_noise(ROUGH[1] * size, len(target)))
    best = fit(latents, [data], limits, starts=1, promise=_ENOUGH)
    return condition(best.latents, best.observations)
