"""How many of 90 % intervals hold the truth: functions drawn with known hyperparameters, seen alone and in sums, with few data and many.

    python tests/benchmarks/gp/coverage.py [--sets 1.0] [--kinds mixed] [--counts 600] [--seed 1000]

"true set" are intervals at the hyperparameters that the functions were drawn with: how far these are from 90 % is the luck of the draw.
"best set" are those at the most probable hyperparameters (`fit`), "integrated" those of `integrate`, "one set" those
of the set of hyperparameters that represents it, as in `Block.fit`. Sets of data are drawn anew from seeds from --seed on; the standard error is
that of the mean over the sets.
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

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


@dataclass(frozen=True)
class Truth:
    """What functions are drawn with: length scales between two, over inputs in a range of 4, and the deviation of the noise."""

    lengths: tuple[float, float] = (0.5, 1.5)
    noise: float = 0.1

    def kernel(self, variance: float, inputs: int, rng: np.random.Generator) -> SquaredExponential:
        return SquaredExponential(variance, tuple(map(float, rng.uniform(*self.lengths, inputs))))


# What begins a search, and what the functions were drawn with; the data; the function judged, its points and values there.
Drawn = tuple[Latents, Latents, Observation, str, np.ndarray, np.ndarray]


def alone(seed: int, count: int, truth: Truth) -> Drawn:
    """A function of two inputs."""
    rng = np.random.default_rng(seed)
    x = rng.uniform(-2, 2, (count + POINTS, 2))
    kernel = truth.kernel(1.0, 2, rng)
    f = _function(x, kernel, rng)
    y = f[:count] + truth.noise * rng.normal(size=count)
    data = observe("d", x[:count], "f", y, constant_noise(0.1, count))
    start = {"f": Latent(SquaredExponential(1.0, (1.0, 1.0)))}
    return start, {"f": Latent(kernel)}, data, "f", x[count:], f[count:]


def mixed(seed: int, count: int, truth: Truth) -> Drawn:
    """What stands alone and what an activation multiplies, seen in their sum only; judged is the second, at rest of the first."""
    rng = np.random.default_rng(seed)
    x, a = rng.uniform(-2, 2, (count + POINTS, 1)), rng.uniform(size=count)
    kernels, functions = {}, {}
    for name, variance in (("rest", 0.25), ("muscle", 4.0)):
        kernels[name] = truth.kernel(variance, 1, rng)
        functions[name] = _function(x, kernels[name], rng)
    rest, muscle = functions.values()
    y = rest[:count] + a * muscle[:count] + truth.noise * rng.normal(size=count)
    data = observe("d", x[:count], {"rest": 1.0, "muscle": a}, y, constant_noise(0.1, count))
    start = {name: Latent(SquaredExponential(1.0, (1.0,))) for name in kernels}
    true = {name: Latent(kernel) for name, kernel in kernels.items()}
    return start, true, data, "muscle", x[count:], muscle[count:]


def _function(x: np.ndarray, kernel: SquaredExponential, rng: np.random.Generator) -> np.ndarray:
    matrix = kernel(x, x) + 1e-9 * kernel.variance * np.eye(len(x))
    return np.asarray(np.linalg.cholesky(matrix) @ rng.normal(size=len(x)))


def held(
    draw: Callable[[int, int, Truth], Drawn], count: int, sets: int, seed: int, drawn: Truth
) -> tuple[dict[str, np.ndarray], float]:
    """Shares of intervals that hold in each set, (sets,), by the way to choose hyperparameters; CPU s of one integration."""
    shares: dict[str, list[float]] = {"true set": [], "best set": [], "integrated": [], "one set": []}
    spent = 0.0
    for each in range(seed, seed + sets):
        latents, true, data, name, at, truth = draw(each, count, drawn)
        found = fit(latents, [data])
        known = condition(true, [replace(data, noise=np.full(count, drawn.noise))])
        best = condition(found.latents, found.observations)
        began = time.process_time()
        many = integrate(latents, [data])
        spent += time.process_time() - began
        one = many.posteriors[many.representative(name, at)]
        for share, each_way in zip(shares.values(), (known, best, many, one), strict=True):
            share.append(_inside(each_way.mean(name, at), each_way.variance(name, at), truth))
    return {way: np.array(share) for way, share in shares.items()}, spent / sets


def _inside(mean: np.ndarray, variance: np.ndarray, truth: np.ndarray) -> float:
    return float(np.mean(np.abs(mean.ravel() - truth) <= Z90 * np.sqrt(variance.ravel())))


KINDS = {"alone": alone, "mixed": mixed}


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sets", type=float, default=1.0, help="share of the sets")
    parser.add_argument("--kinds", nargs="+", choices=list(KINDS), default=list(KINDS))
    parser.add_argument("--counts", nargs="+", type=int, choices=list(SETS), default=list(SETS))
    parser.add_argument("--seed", type=int, default=1000)
    parser.add_argument("--lengths", nargs=2, type=float, default=Truth.lengths, help="least and largest length scale")
    parser.add_argument("--noise", type=float, default=Truth.noise)
    args = parser.parse_args()
    drawn = Truth(tuple(args.lengths), args.noise)
    print(
        f"{'seen':8s}{'n':>5s}{'sets':>6s}{'true set, %':>18s}{'best set, %':>18s}{'integrated, %':>18s}{'CPU s':>8s}"
    )
    with threadpool_limits(1, "blas"):
        for draw in (KINDS[kind] for kind in args.kinds):
            for count in args.counts:
                sets = max(2, round(args.sets * SETS[count]))
                shares, seconds = held(draw, count, sets, args.seed, drawn)
                cells = [f"{100 * np.mean(e):.1f} +- {100 * np.std(e) / np.sqrt(sets):.1f}" for e in shares.values()]
                row = "".join(f"{cell:>18s}" for cell in cells)
                print(f"{draw.__name__:8s}{count:5d}{sets:6d}{row}{seconds:8.2f}", flush=True)


if __name__ == "__main__":
    main()
