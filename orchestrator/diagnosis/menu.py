"""A menu of experiments: input trajectories within what the recorded inputs have shown to be allowed."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from fmus.symbolic.system import Variable
from orchestrator.models.smoothing import SmoothedTrial

LONGEST_S = 10.0
LINES = 7


@dataclass(frozen=True)
class Experiment:
    """An experiment: `inputs` (n, nu) at `time` (n,) s, and what to do in words.

    `start_scale` multiplies the distance of the start from the mean position, for models that nothing drives.
    """

    name: str
    do: str
    time: np.ndarray
    inputs: np.ndarray
    start_scale: float = 1.0


def menu(variables: Sequence[Variable], trials: Sequence[SmoothedTrial]) -> list[Experiment]:
    """Return the experiments that suit a model's inputs; the first repeats the first trial.

    Inputs that moved in the data are driven between the smallest and the largest value seen; force-like inputs that
    never moved are not touched.
    """
    first = trials[0]
    step = float(np.median(np.diff(first.time)))
    time = np.arange(0.0, min(LONGEST_S, first.time[-1] - first.time[0]) + 0.5 * step, step)
    every = np.concatenate([t.inputs for t in trials])
    low, high = every.min(axis=0), every.max(axis=0)
    driven = [i for i in range(len(variables)) if high[i] > low[i]]
    found = [Experiment("repeat", "repeat the first trial", first.time, first.inputs)]
    if not driven:
        rest = np.tile(every.mean(axis=0), (len(time), 1))
        for scale in (0.25, 0.5, 1.0, 1.5):
            words = f"let go at rest, {scale:g} times as far from the middle as in the first trial"
            found.append(Experiment(f"release at {scale:g}", words, time, rest, scale))
        return found
    for share in (1.0, 0.5):
        for name, words, shape in _shapes(time, step):
            inputs = np.tile(_idle(low, high), (len(time), 1))
            for place, i in enumerate(driven):
                inputs[:, i] = low[i] + share * (high[i] - low[i]) * np.clip(shape(place, len(driven)), 0.0, 1.0)
            size = "full range" if share == 1.0 else "half the range"
            found.append(Experiment(f"{name}, {size}", f"{words}, {size} of the inputs seen so far", time, inputs))
    return found


def _idle(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Zero where the input has been there, else the nearest value seen."""
    return np.clip(0.0, low, high)


def _shapes(time: np.ndarray, step: float) -> Iterator[tuple[str, str, Callable[[int, int], np.ndarray]]]:
    """Name, words and shape (a function of the input's place and their number, with values in [0, 1])."""
    span = float(time[-1]) or 1.0

    def triangle(place: int, count: int) -> np.ndarray:
        phase = 2.0 * time / span + place / max(count, 1)
        return 1.0 - np.abs(2.0 * (phase % 1.0) - 1.0)

    def sweep(place: int, count: int) -> np.ndarray:
        top = min(6.0, 0.1 / step)
        cycles = 0.2 * time + 0.5 * (top - 0.2) / span * time**2
        return 0.5 - 0.5 * np.cos(2 * np.pi * (cycles + place / max(count, 1)))

    def poses(place: int, count: int) -> np.ndarray:
        levels = np.array([0.0, 0.4, 0.8, 0.2, 1.0, 0.6])
        return levels[(np.floor(6 * time / span).astype(int) + place) % 6]

    def steps(place: int, count: int) -> np.ndarray:
        return ((time > 0.2 * span) & (time < 0.6 * span)).astype(float)

    def alone(place: int, count: int) -> np.ndarray:
        turn = np.floor(count * time / span).astype(int)
        inside = (count * time / span) % 1.0
        return np.where((turn == place) & (inside < 0.6), 1.0, 0.0)

    def multisine(low_hz: float, high_hz: float) -> Callable[[int, int], np.ndarray]:
        def shape(place: int, count: int) -> np.ndarray:
            lines = np.linspace(low_hz, high_hz, LINES)
            phases = np.pi * np.arange(LINES) ** 2 / LINES + 1.7 * place  # Schroeder's phases keep peaks low
            series = np.cos(2 * np.pi * lines[:, None] * time + phases[:, None]).sum(axis=0)
            return 0.5 + 0.5 * series / np.abs(series).max()

        return shape

    yield "slow reversals", "drive every input slowly up and down, one after another", triangle
    yield "sweep", "drive every input with a sine that gets faster, from 0.2 Hz up", sweep
    yield "static poses", "hold six combinations of inputs, a sixth of the time each", poses
    yield "step", "step all inputs up from rest, and down again", steps
    yield "one input at a time", "switch on one input after another, each from rest", alone
    yield "slow multisine", "drive every input with sines between 0.1 and 1 Hz", multisine(0.1, 1.0)
    yield "fast multisine", "drive every input with sines between 1 and 5 Hz", multisine(1.0, min(5.0, 0.1 / step))
