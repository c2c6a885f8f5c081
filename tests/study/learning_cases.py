"""Corrections made of formulas, so that tests of learning need no simulation."""

from functools import cache

import numpy as np

from orchestrator.study.corrections import Corrections
from orchestrator.study.initial import Initial, initial_models
from orchestrator.study.muscles import perfect
from orchestrator.study.researcher import measure


def corrections(count: int = 60, seed: int = 0) -> Corrections:
    """Corrections over the range of motion; every third touches a stop and is off by about 50 N, the others by 0.5 N."""
    rng = np.random.default_rng(seed)
    low, high = [0.0, 0.5, -0.5, -0.5], [1.5, 2.2, 0.5, 0.5]
    state, activation = rng.uniform(low, high, (count, 4)), rng.uniform(0.0, 1.0, (count, 6))
    at_stop = np.arange(count) % 3 == 0
    off = np.where(at_stop, 50.0, 0.5)[:, None] * rng.standard_normal((count, 2))
    force = perfect(state, activation) + off
    goal = np.hstack([state[:, :2], np.zeros((count, 2))])
    moved, numbers = rng.uniform(0.0, 0.2, count), np.arange(count)
    return Corrections(state, force, activation, force, moved, at_stop, goal, numbers, numbers)


@cache
def models(velocity: bool = True) -> Initial:
    """Initial models of the small set."""
    bench = measure(7, 1)
    return initial_models(bench if velocity else {name: each.without_velocity() for name, each in bench.items()})
