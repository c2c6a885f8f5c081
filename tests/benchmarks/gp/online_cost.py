"""Cost of learning a datum and forgetting another, and of predictions in the loop."""

import time
from collections.abc import Callable, Iterator
from itertools import cycle

import numpy as np

from orchestrator.gp.covariance import Latent
from orchestrator.gp.kernels import SquaredExponential
from orchestrator.gp.observations import Observation, observe
from orchestrator.gp.online import Learner
from orchestrator.gp.posterior import condition
from orchestrator.gp.predictor import Predictor

MUSCLES = 6
OWN = 12  # data of each function alone; the rest are corrections, which see all
LIMIT_EXCHANGE_MS = 1.0
# A datum of one function of four inputs, learned by a full learner that compresses what it was told on 60 rows.
BUDGET, LIMIT_COMPRESSING_US = 60, 150.0
# Its error after so many data of a function of standard deviation 1.
TOLD, LIMIT_ERROR = 1200, 0.2
LIMITS_PREDICTION_US = {84: 50.0, 756: 100.0}
LIMITS_ONE_US = {84: 50.0, 336: 120.0, 756: 350.0}
ROUNDS, REPEATS = 20, 20


def arm(count: int) -> tuple[dict[str, Latent], list[Observation], np.random.Generator]:
    """Statics and six muscles of four inputs and two components, seen alone and together in `count` data."""
    rng = np.random.default_rng(count)
    names = ["statics", *(f"muscle{k}" for k in range(1, MUSCLES + 1))]
    latents = {
        name: Latent(SquaredExponential(1.0, tuple(map(float, scales))))
        for name, scales in zip(names, rng.uniform(0.5, 2.0, (len(names), 4)), strict=True)
    }
    own = min(OWN, count // (2 * len(names)))
    data = [observe(name, rng.normal(size=(own, 4)), name, rng.normal(size=(own, 2)), 0.05) for name in names]
    left = count - own * len(names)
    return latents, [*data, correction(rng, left)], rng


def correction(rng: np.random.Generator, count: int) -> Observation:
    """Corrections at random states and activations."""
    of = {"statics": -np.ones(count)} | {f"muscle{k}": -rng.uniform(size=count) for k in range(1, MUSCLES + 1)}
    return observe("corrections", rng.normal(size=(count, 4)), of, rng.normal(size=(count, 2)), 0.2)


def exchange() -> bool:
    """An update of a full learner: one datum learnt, the least informative forgotten, the mean ready again."""
    print("\nsix muscles and statics together          CPU us       limit")
    kept = True
    for count in (84, 336, 756):
        latents, data, rng = arm(count)
        learner = Learner(latents, 4, 2, count, compresses=False)
        for each in data:
            learner.add(each)
        new = iter([correction(rng, 1) for _ in range(ROUNDS * REPEATS + 1)])

        def update(learner: Learner = learner, new: object = new) -> None:
            learner.add(next(new))
            learner.live()

        update()
        kept &= _row(f"learn one, forget one, n = {count}", 1e6 * _least(update), 1e3 * LIMIT_EXCHANGE_MS)
    return kept & _compressing() & _errors()


def _compressing() -> bool:
    """A datum for a full learner that keeps the information of all of them."""
    rng = np.random.default_rng(1)
    learner = Learner({"f": Latent(SquaredExponential(1.0, (2.0,) * 4))}, 4, 1, BUDGET)
    x = rng.uniform(-2.0, 2.0, (BUDGET + 1 + ROUNDS * REPEATS, 4))
    data = iter([observe("d", each[None], "f", np.sin(each[:1]), 0.05) for each in x])
    for _ in range(BUDGET + 1):
        learner.add(next(data))
    spent = 1e6 * _least(lambda: learner.add(next(data)))
    return _row(f"one function, learn one, {BUDGET} rows hold all", spent, LIMIT_COMPRESSING_US)


def _errors() -> bool:
    """What `BUDGET` rows know of functions drawn with length scales of 2 over a range of 4, beside all data."""
    kept = True
    for seed in (1, 2, 3):
        rng = np.random.default_rng(seed)
        latents = {"f": Latent(SquaredExponential(1.0, (2.0,) * 4))}
        x = rng.uniform(-2.0, 2.0, (TOLD + 300, 4))
        f = np.linalg.cholesky(latents["f"].kernel(x, x) + 1e-9 * np.eye(len(x))) @ rng.normal(size=len(x))
        data = observe("f", x[:TOLD], "f", f[:TOLD] + 0.1 * rng.normal(size=TOLD), 0.1)
        learner = Learner(latents, 4, 1, BUDGET)
        learner.add(data)
        errors = [
            float(np.sqrt(np.mean((each.mean("f", x[TOLD:])[:, 0] - f[TOLD:]) ** 2)))
            for each in (learner.posterior(), condition(latents, [data]))
        ]
        kept &= errors[0] <= LIMIT_ERROR
        print(
            f"error with {BUDGET} rows after {TOLD} data{errors[0]:16.3f}{LIMIT_ERROR:9.1f}   all data: {errors[1]:.3f}"
        )
    return kept


def predictions() -> bool:
    """Means of all functions at one state."""
    kept = True
    for count in (84, 336, 756):
        latents, data, rng = arm(count)
        posterior = condition(latents, data)
        predictor, x = Predictor(posterior, list(latents)), rng.normal(size=4)
        points = _endless(rng.normal(size=(100, 4)))
        if not np.allclose(predictor(x), [posterior.mean(name, x)[0] for name in latents], rtol=1e-10, atol=1e-12):
            return False
        limit = LIMITS_PREDICTION_US.get(count, np.inf)
        kept &= _row(
            f"predict all at one state, n = {count}", 1e6 * _least(lambda p=predictor, s=points: p(next(s))), limit
        )
        one, points = Predictor(posterior, ["muscle1"]), _endless(rng.normal(size=(100, 4)))
        figure = 1e6 * _least(lambda p=one, points=points: p.combined({"muscle1": 1.0}, next(points)))
        kept &= _row("  one function, mean and variance", figure, LIMITS_ONE_US[count])
    return kept


def _endless(points: np.ndarray) -> Iterator[np.ndarray]:
    """One point after another: a predictor would remember the last."""
    return cycle(points)


def _least(work: Callable[[], object]) -> float:
    """CPU seconds of one call, the least over rounds."""
    least = np.inf
    for _ in range(ROUNDS):
        began = time.process_time()
        for _ in range(REPEATS):
            work()
        least = min(least, (time.process_time() - began) / REPEATS)
    return least


def _row(name: str, figure: float, limit: float) -> bool:
    print(f"{name:38s}{figure:11.1f}{limit:12.0f}" + ("" if figure <= limit else "   ABOVE"))
    return figure <= limit
