"""How many of 90 % intervals hold the truth: functions drawn with known hyperparameters, seen alone and in sums, with few data and many.

    python tests/benchmarks/gp/coverage.py [--sets 1.0] [--kinds mixed] [--counts 600]

"best set" are intervals at the most probable hyperparameters (`fit`), "integrated" those of `integrate`. Sets of data are drawn anew from
seeds from 1000 on; the standard error is that of the mean over the sets.
"""

import argparse
import time
from collections.abc import Callable

import numpy as np
from threadpoolctl import threadpool_limits

from orchestrator.gp.covariance import Latent, Latents
from orchestrator.gp.fit import fit
from orchestrator.gp.integrated import integrate
from orchestrator.gp.kernels import SquaredExponential
from orchestrator.gp.noise import constant_noise
from orchestrator.gp.observations import Observation, observe
from orchestrator.gp.posterior import condition

Z90 = 1.6448536269514722
# Number of data, and of sets of data: all that are drawn together hold about the same number of independent intervals.
SETS = {12: 160, 25: 100, 40: 80, 100: 40, 300: 16, 600: 8}
POINTS = 60
NOISE = 0.1
Drawn = tuple[Latents, Observation, str, np.ndarray, np.ndarray]


def alone(seed: int, count: int) -> Drawn:
    """A function of two inputs with length scales from 0.5 to 1.5 over a range of 4."""
    rng = np.random.default_rng(seed)
    x = rng.uniform(-2, 2, (count + POINTS, 2))
    f = _function(x, rng.uniform(0.5, 1.5, 2), rng)
    y = f[:count] + NOISE * rng.normal(size=count)
    data = observe("d", x[:count], "f", y, constant_noise(NOISE, count))
    return {"f": Latent(SquaredExponential(1.0, (1.0, 1.0)))}, data, "f", x[count:], f[count:]


def mixed(seed: int, count: int) -> Drawn:
    """What stands alone and what an activation multiplies, seen in their sum only; judged is the second, at rest of the first."""
    rng = np.random.default_rng(seed)
    x, a = rng.uniform(-2, 2, (count + POINTS, 1)), rng.uniform(size=count)
    rest, muscle = 0.5 * _function(x, rng.uniform(0.5, 1.5, 1), rng), 2.0 * _function(x, rng.uniform(0.5, 1.5, 1), rng)
    y = rest[:count] + a * muscle[:count] + NOISE * rng.normal(size=count)
    data = observe("d", x[:count], {"rest": 1.0, "muscle": a}, y, constant_noise(NOISE, count))
    latents = {name: Latent(SquaredExponential(1.0, (1.0,))) for name in ("rest", "muscle")}
    return latents, data, "muscle", x[count:], muscle[count:]


def _function(x: np.ndarray, scales: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    matrix = SquaredExponential(1.0, tuple(map(float, scales)))(x, x) + 1e-9 * np.eye(len(x))
    return np.asarray(np.linalg.cholesky(matrix) @ rng.normal(size=len(x)))


def held(draw: Callable[[int, int], Drawn], count: int, sets: int) -> tuple[np.ndarray, np.ndarray, float]:
    """Shares of intervals that hold in each set, (sets,): at the best hyperparameters and integrated; CPU s of one integration."""
    best, whole, spent = [], [], 0.0
    for seed in range(1000, 1000 + sets):
        latents, data, name, at, truth = draw(seed, count)
        found = fit(latents, [data])
        one = condition(found.latents, found.observations)
        began = time.process_time()
        many = integrate(latents, [data])
        spent += time.process_time() - began
        best.append(_inside(one.mean(name, at), one.variance(name, at), truth))
        whole.append(_inside(many.mean(name, at), many.variance(name, at), truth))
    return np.array(best), np.array(whole), spent / sets


def _inside(mean: np.ndarray, variance: np.ndarray, truth: np.ndarray) -> float:
    return float(np.mean(np.abs(mean.ravel() - truth) <= Z90 * np.sqrt(variance.ravel())))


KINDS = {"alone": alone, "mixed": mixed}


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sets", type=float, default=1.0, help="share of the sets")
    parser.add_argument("--kinds", nargs="+", choices=list(KINDS), default=list(KINDS))
    parser.add_argument("--counts", nargs="+", type=int, choices=list(SETS), default=list(SETS))
    args = parser.parse_args()
    print(f"{'seen':8s}{'n':>5s}{'sets':>6s}{'best set, %':>18s}{'integrated, %':>18s}{'CPU s':>8s}")
    with threadpool_limits(1, "blas"):
        for draw in (KINDS[kind] for kind in args.kinds):
            for count in args.counts:
                best, whole, seconds = held(draw, count, max(2, round(args.sets * SETS[count])))
                cells = [f"{100 * np.mean(e):.1f} +- {100 * np.std(e) / np.sqrt(len(e)):.1f}" for e in (best, whole)]
                print(
                    f"{draw.__name__:8s}{count:5d}{len(best):6d}"
                    + "".join(f"{c:>18s}" for c in cells)
                    + f"{seconds:8.2f}",
                    flush=True,
                )


if __name__ == "__main__":
    main()
