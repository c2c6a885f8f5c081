"""Reference results: the model's equations solved by a method that shares no code with the FMU (CVODES)."""

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


# Relative tolerances of the solution and of the one that shows how far it can be trusted.
FINE, COARSE = 1e-11, 1e-7
# Share of a signal's size by which an FMU may differ.
SHARE = 1e-4
FLOOR = 1e-9


@dataclass(frozen=True)
class Reference:
    """Results at the times of an experiment, and how far an FMU may be from each signal, in its unit."""

    times: Array  # (n_rows,)
    names: tuple[str, ...]
    values: Array  # (n_rows, n_signals)
    tolerances: Array  # (n_signals,)


def solve_reference(system: SymbolicSystem, experiment: Experiment) -> Reference | None:
    """Results of the outputs, or of the states of a model without any; None if there are none of use.

    The tolerance of a signal is 1e-4 of its nominal value, or of its largest distance from its start where none is
    declared. Where two accuracies of the solver differ by more than a tenth of that, as in chaotic motion, the results
    end: beyond that time no tolerance would mean anything. Delays that change with time or inputs are not solved, nor models that
    remember.
    """
    if system.remembers:
        return None  # an integrator without events does not know what is kept from event to event
    names = system.outputs or tuple(v.name for v in system.states)
    solver = _Solver(system, names)
    if not names or not solver.constant_delays:
        return None
    fine = solver.solve(experiment, FINE)
    coarse = solver.solve(experiment, COARSE)
    tolerances = _tolerances(system, names, fine)
    with np.errstate(invalid="ignore"):
        bad = np.flatnonzero((~(np.abs(fine - coarse) <= 0.1 * tolerances)).any(axis=1))
    rows = int(bad[0]) if bad.size else len(fine)
    return Reference(experiment.times[:rows], names, fine[:rows], tolerances) if rows > 1 else None


def _tolerances(system: SymbolicSystem, names: tuple[str, ...], values: Array) -> Array:
    nominals = {v.name: v.nominal for v in (*system.states, *system.algebraics)}
    finite = values[np.isfinite(values).all(axis=1)]
    travel = np.abs(finite - finite[:1]).max(axis=0, initial=0.0)
    sizes = [abs(nominals[name] or 0.0) or moved or 1.0 for name, moved in zip(names, travel, strict=True)]
    return np.maximum(SHARE * np.array(sizes), FLOOR)


class _Solver:
    """Solves piece by piece: between two breaks inputs and delayed inputs are constant."""

    def __init__(self, system: SymbolicSystem, names: tuple[str, ...]) -> None:
        self.system = system
        self.p = ca.DM([v.start or 0.0 for v in system.parameters])
        inputs = ca.DM([v.start or 0.0 for v in system.inputs])
        self.delays = [float(d) for d in system.history(0.0, inputs, self.p)[1].full().ravel()]
        shown = [v.name for v in (*system.states, *system.algebraics)]
        self.columns = [shown.index(name) for name in names]
        self.rhs = self._held_rhs()

    @property
    def constant_delays(self) -> bool:
        """Whether no delay changes with time or with an input."""
        return not any(self.system.history.jac_sparsity(1, argument).nnz() for argument in (0, 1))

    def solve(self, experiment: Experiment, tolerance: float) -> Array:
        """Results at the times of the experiment, (n_rows, n_signals); NaN from where the solver fails."""
        times, last = experiment.times, experiment.times[-1]
        late = {jump + delay for jump in experiment.jumps for delay in (0.0, *self.delays) if jump + delay < last}
        breaks = sorted({*times, *late})
        results = np.full((len(times), len(self.columns)), np.nan)
        integrator = self._integrator(tolerance) if self.system.states else None
        first = self._held(experiment, times[0])[: len(self.system.inputs)]
        x, row = self.system.start_of_states(self.p, first, float(times[0])), 0
        for begin, end in zip(breaks, [*breaks[1:], None], strict=True):
            if begin == times[row]:
                values = ca.vertcat(x, self.rhs(begin, x, self._held(experiment, begin))[1]).full().ravel()
                results[row] = values[self.columns]
                row += 1
            if end is not None and integrator is not None:
                held = self._held(experiment, 0.5 * (begin + end))
                try:
                    x = integrator(x0=x, p=ca.vertcat(begin, end, held))["xf"]
                except RuntimeError:  # the solver gave up; its reason is of no use to anybody
                    break
        return results

    def _held(self, experiment: Experiment, time: float) -> ca.DM:
        """Inputs at a time, and as each delay operator sees them."""
        return ca.DM(np.concatenate([experiment.at(time - delay) for delay in (0.0, *self.delays)]))

    def _held_rhs(self) -> ca.Function:
        """`(t, x, held) -> (dx, z)`; before the start a delayed quantity has its initial value."""
        system, n = self.system, len(self.system.inputs)
        t, x = ca.MX.sym("t"), ca.MX.sym("x", len(system.states))
        held = ca.MX.sym("held", n * (1 + len(self.delays)))
        delayed = [
            system.history(ca.fmax(t - delay, 0.0), held[(1 + i) * n : (2 + i) * n], self.p)[0][i]
            for i, delay in enumerate(self.delays)
        ]
        dx, z = system.rhs(t, x, held[:n], ca.vertcat(*delayed), self.p)
        return ca.Function("held", [t, x, held], [dx, z])

    def _integrator(self, tolerance: float) -> ca.Function:
        """From `begin` to `end`, in the time (t - begin)/(end - begin)."""
        x, t, held = ca.MX.sym("x", len(self.system.states)), ca.MX.sym("t"), ca.MX.sym("held", self.rhs.numel_in(2))
        begin, end = ca.MX.sym("begin"), ca.MX.sym("end")
        dx, _ = self.rhs(begin + t * (end - begin), x, held)
        dae = {"x": x, "t": t, "p": ca.vertcat(begin, end, held), "ode": (end - begin) * dx}
        options = {"reltol": tolerance, "abstol": 0.01 * tolerance, "max_num_steps": 10_000}
        return ca.integrator(
            "reference",
            "cvodes",
            dae,
            0.0,
            1.0,
            {**options, "show_eval_warnings": False, "disable_internal_warnings": True},
        )
