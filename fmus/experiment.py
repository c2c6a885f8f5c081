"""The experiment that an FMU brings along: every input is pulsed once, deterministically."""

import math
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from fmus.symbolic.system import SymbolicSystem

Array = NDArray[np.float64]
MOST_ROWS = 200


@dataclass(frozen=True)
class Experiment:
    """Inputs that jump now and then, and the times at which results are taken, all in s.

    Jumps and results fall on different communication points, so that no result depends on which side of a jump it
    is taken from. `levels[k]` (n_inputs) holds from `jumps[k]` on; the first jump is the start, 0 s.
    """

    step: float
    times: Array  # (n_rows,)
    jumps: Array  # (n_jumps,)
    levels: Array  # (n_jumps, n_inputs)

    def at(self, time: float) -> Array:
        """The inputs at a time, after a jump if there is one; before the start those at the start. (n_inputs,)"""
        rounding = 1e-9 * self.step
        return np.asarray(self.levels[max(0, int(np.searchsorted(self.jumps, time + rounding, side="right")) - 1)])


def pulses(system: SymbolicSystem, stop_time: float, step: float) -> Experiment:
    """Switch one input after the other on and off again, each overlapping with the next.

    Args:
        system: the model.
        stop_time: end of the experiment, s.
        step: communication step, s; results are taken at up to 201 multiples of it.

    A pulse moves the fastest state by about 1, or by its nominal value if that is declared, and stays in a quarter of
    the range of its input. Without effect on a state it is a tenth of the input's start value, or 1.
    """
    every = max(2, 2 * math.ceil(stop_time / step / MOST_ROWS / 2))  # even, for jumps half-way between results
    rows = max(1, int(stop_time / step / every + 1e-9))
    n = len(system.inputs)
    edges = [(int(k * rows / (n + 2)) * every + every // 2) * step for k in range(n + 2)]
    starts = np.array([v.start or 0.0 for v in system.inputs])
    heights = _heights(system, edges[1] * 2 if n else stop_time)
    levels: Array = np.tile(starts, (n + 3, 1)).astype(np.float64)
    for j, height in enumerate(heights):
        levels[j + 1 : j + 3, j] += height
    jumps = np.array([0.0, *edges], dtype=np.float64)
    times = np.asarray(np.arange(rows + 1) * every * step, dtype=np.float64)
    return Experiment(step, times, jumps, levels)


def _heights(system: SymbolicSystem, duration: float) -> list[float]:
    slopes = np.abs(_slopes(system))
    scales = np.array([abs(v.nominal or 1.0) for v in system.states])
    heights = []
    for j, variable in enumerate(system.inputs):
        start = variable.start or 0.0
        moved = slopes[:, j] > 0.0
        height = 0.1 * abs(start) or 1.0
        if moved.any():
            height = float(np.min(scales[moved] / slopes[moved, j])) / duration
        low, high = variable.minimum, variable.maximum
        if low is not None and high is not None:
            height = min(height, 0.25 * (high - low))
        if high is not None and start + height > high:
            height = -height
        heights.append(float(f"{height:.0e}"))
    return heights


def _slopes(system: SymbolicSystem) -> Any:
    """Change of the derivatives by the inputs at the start, (n_states, n_inputs); 0 where it is not finite."""
    p = ca.DM([v.start or 0.0 for v in system.parameters])
    x, u = system.start_of_states(p), ca.DM([v.start or 0.0 for v in system.inputs])
    source, _ = system.history(0.0, u, p)
    columns = []
    for j in range(len(system.inputs)):
        nudge = np.zeros(len(system.inputs))
        nudge[j] = 1e-6 * max(1e-3, abs(float(u[j])))
        after, before = (system.rhs(0.0, x, u + s * ca.DM(nudge), source, p)[0].full() for s in (1, -1))
        columns.append((after - before).ravel() / (2 * nudge[j]))
    slopes = np.array(columns).reshape(len(system.inputs), len(system.states)).T
    return np.where(np.isfinite(slopes), slopes, 0.0)
