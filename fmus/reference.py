"""Reference results: the model's equations solved by a method that shares no code with the FMU (CVODES)."""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from fmus.experiment import Array, Experiment
from fmus.symbolic.system import SymbolicSystem

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
