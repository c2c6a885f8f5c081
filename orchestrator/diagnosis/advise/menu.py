"""A menu of experiments: input trajectories within what the recorded inputs have shown to be allowed."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fmus.symbolic.system import Variable
from orchestrator.diagnosis.advise.thresholds import (
    BESIDE,
    BEYOND_SLOW,
    LINES,
    ONE_SIDED,
    OUT_OF_REST_ELSE,
    PLAYED_SAMPLES,
    TWO_SIDED,
    USUAL_S,
)
from orchestrator.diagnosis.decide.excitation import driven
from orchestrator.models.correction import PREFIX
from orchestrator.models.smoothing import SmoothedTrial

IN_WORDS = {1.0: "full range", 0.5: "half the range", 0.2: "a fifth of the range", 0.05: "a twentieth of the range"}
IN_WORDS |= {share: f"{share:g} times the range" for share in BEYOND_SLOW}
# How far a machine that only rested is moved out of rest, by the unit of its output.
OUT_OF_REST = {"rad": 0.5}


@dataclass(frozen=True)
class Experiment:
    """An experiment: `inputs` (n, nu) at `time` (n,) s, and what to do in words.

    For models that nothing drives `start_scale` multiplies the distance of the start from the mean position, and
    `start_offset` is added to it.
    """

    name: str
    do: str
    time: np.ndarray
    inputs: np.ndarray
    start_scale: float = 1.0
    start_offset: float = 0.0


def menu(
    variables: Sequence[Variable],
    trials: Sequence[SmoothedTrial],
    amplitudes: Mapping[int, float] | None = None,
    rest: str | None = None,
) -> list[Experiment]:
    """Return the experiments that suit a model's inputs; the first repeats the first trial.

    Inputs that moved in the data are driven between the smallest and the largest value seen, and so are those of the same
    unit that never moved. Others that never moved are not touched: a bench may not have them.

    Args:
        amplitudes: how far a slow sine may drive inputs to either side of where they rest, by position, of a machine that
            was never driven.
        rest: unit of the output of a machine that only rested, else None.
    """
    first = trials[0]
    step = float(np.median(np.diff(first.time)))
    time = (first.time[0] + np.arange(min(len(first.time), PLAYED_SAMPLES)) * step) - first.time[0]
    every = np.concatenate([t.inputs for t in trials])
    rests = first.inputs.mean(axis=0)
    ranges = {i: (rests[i] - a, rests[i] + a) for i, a in (amplitudes or {}).items()} | _ranges(variables, trials)
    found = [Experiment("repeat", "repeat the first trial", first.time, first.inputs)]
    if not ranges:
        idle = np.tile(every.mean(axis=0), (len(time), 1))
        if rest is not None:
            far = OUT_OF_REST.get(rest, OUT_OF_REST_ELSE)
            for offset in (0.4 * far, far, 2 * far):
                words = f"let go at rest, {offset:g} {rest} away from where it rested"
                found.append(Experiment(f"release from {offset:g}", words, time, idle, 1.0, offset))
            return found
        for scale in (0.25, 0.5, 1.0, 1.5):
            words = f"let go at rest, {scale:g} times as far from the middle as in the first trial"
            found.append(Experiment(f"release at {scale:g}", words, time, idle, scale))
        return found
    low, high = every.min(axis=0), every.max(axis=0)
    for i, (smallest, largest) in ranges.items():
        low[i], high[i] = smallest, largest
    idle = rests if amplitudes else _idle(low, high)
    two_sided = all(smallest < idle[i] < largest for i, (smallest, largest) in ranges.items())
    shares = TWO_SIDED if two_sided else ONE_SIDED
    noise = np.zeros(len(idle)) if first.input_noise is None else first.input_noise
    one_way = (np.abs(idle) > noise) & bool(amplitudes)  # what only ran one way may not be able to turn
    limits = "over which a slow sine keeps the machine where it was" if amplitudes else "seen so far"
    before = list[tuple[float, float]]()
    for share in (*BEYOND_SLOW, *shares) if amplitudes else shares:
        parts = [_part(*extent, float(idle[i]), share, one_way=one_way[i]) for i, extent in ranges.items()]
        allowed = [_within(part, variables[i]) for part, i in zip(parts, ranges, strict=True)]
        if allowed == before:  # no less than a larger share, which the inputs' own limits have cut
            continue
        before, cut = allowed, ", as far as the model lets them" if allowed != parts else ""
        for name, words, shape in _shapes(time, step):
            inputs = np.tile(idle, (len(time), 1))
            for place, (i, (bottom, top)) in enumerate(zip(ranges, allowed, strict=True)):
                inputs[:, i] = bottom + (top - bottom) * np.clip(shape(place, len(ranges)), 0.0, 1.0)
            size = IN_WORDS[share]
            found.append(Experiment(f"{name}, {size}", f"{words}, {size} of the inputs {limits}{cut}", time, inputs))
    return found if amplitudes else [*found, *_beside_the_first(variables, trials, time, ranges)]


def _beside_the_first(
    variables: Sequence[Variable],
    trials: Sequence[SmoothedTrial],
    time: np.ndarray,
    ranges: Mapping[int, tuple[float, float]],
) -> Iterator[Experiment]:
    """The first trial again, with more on top of it: inputs that never moved one after another, else fast sines on all."""
    first, moved = trials[0], driven(trials)
    shapes = {name: shape for name, _, shape in _shapes(time, float(time[1] - time[0]))}
    again = np.column_stack([np.interp(time, first.time - first.time[0], column) for column in first.inputs.T])
    silent = [i for i in ranges if not moved[i]]
    shape = shapes["one input at a time"] if silent else shapes["fast multisine"]
    chosen = silent or list(ranges)
    names = ", ".join(variables[i].name for i in chosen)
    for share in BESIDE:
        inputs = again.copy()
        for place, i in enumerate(chosen):
            smallest, largest = ranges[i]
            more = share * (largest - smallest) * (shape(place, len(chosen)) - (0.0 if silent else 0.5))
            inputs[:, i] = np.clip((smallest if silent else again[:, i]) + more, smallest, largest)
        what = f"switch on {names}, one after another," if silent else f"add fast sines to {names},"
        words = f"repeat the first trial and {what} by {share:.0%} of the range"
        yield Experiment(f"first trial and {share:.0%} of {names}", words, time, inputs)


def _ranges(variables: Sequence[Variable], trials: Sequence[SmoothedTrial]) -> dict[int, tuple[float, float]]:
    """Range of each input that may be driven, by position."""
    every = np.concatenate([t.inputs for t in trials])
    moved = [i for i in map(int, np.flatnonzero(driven(trials))) if not variables[i].name.startswith(PREFIX)]
    found = {i: (float(every[:, i].min()), float(every[:, i].max())) for i in moved}
    for i, variable in enumerate(variables):
        alike = [found[j] for j in moved if variables[j].unit == variable.unit]
        if i not in found and alike and not variable.name.startswith(PREFIX):
            found[i] = (min(low for low, _ in alike), max(high for _, high in alike))
    return dict(sorted(found.items()))


def _idle(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Zero where the input has been there, else the nearest value seen."""
    return np.clip(0.0, low, high)


def _part(low: float, high: float, idle: float, share: float, *, one_way: bool = False) -> tuple[float, float]:
    """A share of a range: as far to one side of idle as to the other, so that a torque drives nothing away; from its
    lower end if idle is no point inside; on idle's side of zero if that is the `one_way` that the input goes.

    >>> _part(-0.3, 0.2, 0.0, 0.5), _part(0.1, 0.9, 0.1, 0.5), _part(0.0, 0.5, 0.25, 2.0, one_way=True)
    ((-0.1, 0.1), (0.1, 0.5), (0.0, 0.75))
    """
    if not low < idle < high:
        return low, low + share * (high - low)
    far = share * min(idle - low, high - idle)
    if one_way:
        return (max(idle - far, 0.0), idle + far) if idle > 0 else (idle - far, min(idle + far, 0.0))
    return idle - far, idle + far


def _within(part: tuple[float, float], variable: Variable) -> tuple[float, float]:
    """The part of a range over which a model lets its input go.

    >>> _within((-0.3, 12.0), Variable("alpha_1", "1", minimum=0.0, maximum=1.0))
    (0.0, 1.0)
    """
    low = -np.inf if variable.minimum is None else variable.minimum
    high = np.inf if variable.maximum is None else variable.maximum
    return min(max(part[0], low), high), max(min(part[1], high), low)


def _shapes(time: np.ndarray, step: float) -> Iterator[tuple[str, str, Callable[[int, int], np.ndarray]]]:
    """Name, words and shape (a function of the input's place and their number, with values in [0, 1])."""
    span = float(time[-1]) or 1.0
    pace = min(1.0, USUAL_S / span)

    def triangle(place: int, count: int) -> np.ndarray:
        phase = 2.0 * time / span + place / max(count, 1)
        return 1.0 - np.abs(2.0 * (phase % 1.0) - 1.0)

    def sweep(place: int, count: int) -> np.ndarray:
        bottom, top = 0.2 * pace, min(6.0 * pace, 0.1 / step)
        cycles = bottom * time + 0.5 * (top - bottom) / span * time**2
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

    def square(hz: float) -> Callable[[int, int], np.ndarray]:
        # From rest it goes one way for a quarter of a period first, so that it comes back.
        return lambda place, count: (np.cos(2 * np.pi * (hz * time + place / max(2 * count, 1))) < 0).astype(float)

    def multisine(low_hz: float, high_hz: float) -> Callable[[int, int], np.ndarray]:
        def shape(place: int, count: int) -> np.ndarray:
            lines = np.linspace(low_hz, high_hz, LINES)
            phases = np.pi * np.arange(LINES) ** 2 / LINES + 1.7 * place  # Schroeder's phases keep peaks low
            series = np.cos(2 * np.pi * lines[:, None] * time + phases[:, None]).sum(axis=0)
            return 0.5 + 0.5 * series / np.abs(series).max()

        return shape

    fastest = min(5.0 * pace, 0.1 / step)
    yield "slow reversals", "drive every input slowly up and down, one after another", triangle
    yield "sweep", f"drive every input with a sine that gets faster, from {0.2 * pace:.2g} Hz up", sweep
    yield "static poses", "hold six combinations of inputs, a sixth of the time each", poses
    yield "step", "step all inputs up from rest, and down again", steps
    yield "one input at a time", "switch on one input after another, each from rest", alone
    slow = f"drive every input with sines between {0.1 * pace:.2g} and {pace:.2g} Hz"
    yield "slow multisine", slow, multisine(0.1 * pace, pace)
    fast = f"drive every input with sines between {pace:.2g} and {fastest:.2g} Hz"
    yield "fast multisine", fast, multisine(pace, fastest)
    for name, hz in (("slow", 0.5 * pace), ("fast", min(2.0 * pace, 0.1 / step))):
        yield f"{name} square wave", f"switch every input between two values, {hz:.2g} times a second", square(hz)
