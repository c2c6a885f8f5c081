"""Signals for measuring comparisons: long ones with jumps, and many small ones of all kinds."""

from dataclasses import dataclass

import numpy as np

from orchestrator.regress.comparison import Signal

POINTS = 100_001
SHIFT_S, HEIGHT = 2e-3, 1e-3


def long_signal(late_s: float = 0.0, offset: float = 0.0, stamps: np.ndarray | None = None) -> Signal:
    """Ten seconds of a slow wave with 13 jumps, which come `late_s` late; at 0.1 ms steps or at other stamps."""
    time = np.linspace(0.0, 10.0, POINTS)
    values = np.sin(0.5 * time)
    for k in range(13):
        values += 0.4 * (-1) ** k * (time - late_s >= 0.5 + 0.7 * k)
    values += offset
    if stamps is not None:
        time, values = stamps, np.interp(stamps, time, values)
    return Signal("y", time, values, "V")


def uneven_stamps() -> np.ndarray:
    """As many stamps, unevenly spread."""
    inner = np.random.default_rng(8).uniform(0.0, 10.0, POINTS - 2)
    return np.concatenate([[0.0], np.sort(inner), [10.0]])


@dataclass(frozen=True, eq=False)
class SmallCase:
    """A reference, a result, and the half-width (s) and half-height (V) of the tube."""

    kind: str
    reference: Signal
    result: Signal
    shift_s: float
    height: float


KINDS = ("smooth", "uneven", "steps", "coarse")


def small_case(seed: int) -> SmallCase:
    """Return one of the random cases: waves, on even or uneven stamps, with jumps, late or early, with noise."""
    random = np.random.default_rng(seed)
    kind = KINDS[seed % 4]
    count = int(random.integers(20, 400))
    sizes, rates, phases = random.normal(size=3), random.uniform(0.2, 4.0, 3), random.uniform(0.0, 6.0, 3)
    time = _stamps(random, count, even=kind != "uneven")
    values = (sizes[:, None] * np.sin(rates[:, None] * time + phases[:, None])).sum(axis=0)
    if kind == "steps":
        jumps = random.normal(size=4)[:, None] * (time >= random.uniform(1.0, 9.0, 4)[:, None])
        values = 0.1 * values + jumps.sum(axis=0)
    own = time if kind in ("smooth", "steps") else _stamps(random, int(random.integers(15, 400)), even=False)
    shift, height = 10.0 ** random.uniform(-3.0, -0.7), 10.0 ** random.uniform(-3.0, -1.0)
    late = shift * random.uniform(-2.0, 2.0) * (seed % 3 != 0)
    noise = height * random.uniform(-1.5, 1.5, len(own)) * (seed % 2)
    found = np.interp(own - late, time, values) + noise
    return SmallCase(kind, Signal("y", time, values, "V"), Signal("y", own, found, "V"), float(shift), float(height))


def _stamps(random: np.random.Generator, count: int, even: bool) -> np.ndarray:
    if even:
        return np.linspace(0.0, 10.0, count)
    return np.concatenate([[0.0], np.sort(random.uniform(0.0, 10.0, count - 2)), [10.0]])
