"""How the outputs of a fitted model answer to small changes of its inputs: free runs, linearised along their motion."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
import scipy

from orchestrator.blackbox.model import CoupledModel
from orchestrator.diagnosis.fit.evidence import Refit
from orchestrator.diagnosis.noise.gaps import without_gaps
from orchestrator.models.compiled import CompiledModel, linear_answer
from orchestrator.models.correction import PREFIX
from orchestrator.models.exponential import exponentials
from orchestrator.models.smoothing import Smoother, second_difference


@dataclass(frozen=True, eq=False)
class SimulatedTrial:
    """A trial as a model runs it, in the form that residual systems take; see SmoothedTrial."""

    time: np.ndarray
    inputs: np.ndarray
    values: np.ndarray
    smoother: Smoother

    @property
    def measured(self) -> np.ndarray:
        """The outputs themselves."""
        return self.values

    @cached_property
    def speeds(self) -> np.ndarray:
        """First derivatives."""
        return np.gradient(self.values, self.time, axis=0)

    @cached_property
    def accelerations(self) -> np.ndarray:
        """Second derivatives."""
        return second_difference(self.values, self.time)


@dataclass(frozen=True)
class _Linear:
    """x(k+1) = step x(k) + (push(k) u(k) step + push(k+1) u(k+1)) h/2, y = show x + direct u, along a trial.

    Here u are the inputs, then what is delayed; h are the steps of `time`: the samples, and steps as short within gaps.
    """

    time: np.ndarray
    step: np.ndarray
    push: np.ndarray
    show: np.ndarray
    direct: np.ndarray


class Response:
    """The free runs of one fitted model along its trials, and their answers to small inputs."""

    def __init__(self, base: Refit, smoothers: Sequence[Smoother]) -> None:
        self.base, self.model = base, base.model
        names = [v.name for v in self.model.inputs]
        wanted = [PREFIX + signal for signal in self.model.signals]
        # An FMU, and equations that are solved by iteration, have no formula to differentiate.
        self.is_formula = self.model.system.rhs.is_a("SXFunction") and self.model.system.rhs.n_in() == 5
        # An FMU may be asked for its Jacobians instead.
        self.answers_inputs = self.is_formula or (isinstance(self.model, CoupledModel) and self.model.shows_jacobians)
        self.has_forces = self.is_formula and all(name in names for name in wanted)
        self._forces = [names.index(name) for name in wanted] if self.has_forces else []
        self.parameters = self.model.compiled.with_values(base.fit.values)
        runs = [self._run(k) for k in range(len(base.records))]
        self.outputs = [run[:, : len(self.model.signals)] for run in runs]
        self._states = [run[:, len(self.model.signals) :] for run in runs]
        self.trials = [
            SimulatedTrial(r.time, r.inputs, self._positions(y), smoother)
            for r, y, smoother in zip(base.records, self.outputs, smoothers, strict=True)
        ]
        self._kept: dict[int, _Linear] = {}

    def to_forces(self, trial: int, forces: np.ndarray) -> np.ndarray:
        """Change of the outputs (n, ny, k) by k small force histories (n, ny, k) on the correction inputs."""
        return self._answer(trial, forces, self._forces)

    def to_input(self, trial: int, column: int, changes: np.ndarray) -> np.ndarray:
        """Change of the outputs (n, ny, k) by k small histories (n, k) of one input; each takes a run where nothing is
        known of the model's slopes.

        Args:
            trial: number of the trial, from 0.
            column: number of the input, from 0.
            changes: its histories, in its unit.
        """
        if self.answers_inputs:
            return self._answer(trial, changes[:, None, :], [column])
        record = self.base.records[trial]
        moved = np.repeat(record.inputs[None], changes.shape[1], axis=0)
        moved[:, :, column] += changes.T
        runs = [self._run(trial, inputs) - self.outputs[trial] for inputs in moved]
        return np.stack(runs, axis=2) if runs else np.zeros((*self.outputs[trial].shape, 0))

    def series(self, names: Sequence[str]) -> dict[str, list[np.ndarray]]:
        """States and other variables (n,) along each trial; for a model that is a formula only."""
        system, parameters = self.model.system, ca.DM(self.parameters)
        found: dict[str, list[np.ndarray]] = {name: [] for name in names}
        for trial, (record, states) in enumerate(zip(self.base.records, self._states, strict=True)):
            arguments = (record.time[None, :], states.T, record.inputs.T, self._delayed(trial), parameters)
            others = system.rhs(*arguments)[1].full()
            known = {v.name: states[:, i] for i, v in enumerate(system.states)}
            known |= {v.name: others[i] for i, v in enumerate(system.algebraics)}
            for name in names:
                found[name].append(known[name])
        return found

    def _answer(self, trial: int, changes: np.ndarray, columns: Sequence[int]) -> np.ndarray:
        linear, time = self._linear(trial), self.base.records[trial].time
        late, columns = self._late(trial, changes, columns), list(columns)
        if late.shape[1]:
            inputs = linear.push.shape[2] - late.shape[1]
            changes, columns = np.hstack([changes, late]), [*columns, *range(inputs, linear.push.shape[2])]
        half, push, direct = 0.5 * np.diff(linear.time), linear.push[:, :, columns], linear.direct[:, :, columns]
        if len(linear.time) == len(time):
            return linear_answer(half, linear.step, push, linear.show, direct, changes)
        between = scipy.interpolate.interp1d(time, changes, axis=0)(linear.time)
        answer = linear_answer(half, linear.step, push, linear.show, direct, between)
        return answer[np.searchsorted(linear.time, time)]

    def _late(self, trial: int, changes: np.ndarray, columns: Sequence[int]) -> np.ndarray:
        """Changes (n, nd, k) of what is delayed by changes (n, c, k) of inputs; before a record the first is held."""
        record, system = self.base.records[trial], self.model.system
        if not system.n_delays:
            return changes[:, :0]
        n = len(record.time)
        _, delays = self.model.compiled.delayed(record.time, record.inputs, self.parameters)
        slopes = self._history_slopes(record.time[None, :], record.inputs.T, self.parameters).full()
        sources = np.einsum("dnc,nck->dnk", slopes.reshape(system.n_delays, n, -1)[:, :, columns], changes)
        found = np.zeros((n, *sources.shape[::2]))
        for j, late in enumerate(delays):
            past = np.maximum(record.time - late, record.time[0])
            found[:, j] = scipy.interpolate.interp1d(record.time, sources[j], axis=0)(past)
        return found

    def _linear(self, trial: int) -> _Linear:
        if trial not in self._kept:
            time = self.base.records[trial].time
            fine = without_gaps(time)
            parts = self._jacobians(trial)
            a, b, c, d = (
                parts
                if len(fine) == len(time)
                else [scipy.interpolate.interp1d(time, part, axis=0)(fine) for part in parts]
            )
            middle = 0.5 * (a[1:] + a[:-1]) * np.diff(fine)[:, None, None]
            self._kept[trial] = _Linear(fine, exponentials(middle), b, c, d)
        return self._kept[trial]

    def _jacobians(self, trial: int) -> Sequence[np.ndarray]:
        """Along a trial, the Jacobians (n, ., .) of rates and then of outputs, each in states and in inputs."""
        record = self.base.records[trial]
        if isinstance(self.model, CoupledModel):
            return self.model.jacobians(record, self.base.fit.starts[trial], self.base.substeps)
        states = self._states[trial]
        n, nx, ny = len(record.time), states.shape[1], len(self.model.signals)
        nu = record.inputs.shape[1] + self.model.system.n_delays
        arguments = [record.time[None, :], states.T, record.inputs.T, self._delayed(trial), self.parameters]
        values = [part.full().reshape(-1, n, order="F").T for part in self._derivatives(*arguments)]
        shapes = [(nx, nx), (nx, nu), (ny, nx), (ny, nu)]
        # casadi stacks matrices column by column
        return [v.reshape(n, *shape[::-1]).transpose(0, 2, 1) for v, shape in zip(values, shapes, strict=True)]

    @cached_property
    def _derivatives(self) -> ca.Function:
        """Jacobians of the states' rates and of the outputs, each stacked into a column."""
        system = self.model.system
        t, p = ca.SX.sym("t"), ca.SX.sym("p", len(system.parameters))
        x, u = ca.SX.sym("x", len(system.states)), ca.SX.sym("u", len(system.inputs))
        delayed = ca.SX.sym("d", system.n_delays)
        dx, z = system.rhs(t, x, u, delayed, p)
        named = {v.name: x[i] for i, v in enumerate(system.states)}
        named |= {v.name: z[i] for i, v in enumerate(system.algebraics)}
        y = ca.vertcat(*[named[name] for name in self.model.signals])
        parts = [ca.jacobian(value, by) for value in (dx, y) for by in (x, ca.vertcat(u, delayed))]
        return ca.Function("derivatives", [t, x, u, delayed, p], [ca.densify(ca.vec(part)) for part in parts])

    @cached_property
    def _history_slopes(self) -> ca.Function:
        """Slopes of what is delayed in the inputs, side by side for each instant."""
        system = self.model.system
        t, u, p = ca.SX.sym("t"), ca.SX.sym("u", len(system.inputs)), ca.SX.sym("p", len(system.parameters))
        source, _ = system.history(t, u, p)
        return ca.Function("slopes", [t, u, p], [ca.densify(ca.jacobian(source, u))])

    def _delayed(self, trial: int) -> np.ndarray:
        """Delayed quantities at the samples, by interpolation of their histories."""
        record = self.base.records[trial]
        sources, delays = self.model.compiled.delayed(record.time, record.inputs, self.parameters)
        found = [
            np.interp(record.time - late, record.time, source) for source, late in zip(sources.T, delays, strict=True)
        ]
        return np.array(found).reshape(len(delays), len(record.time))

    def _run(self, trial: int, inputs: np.ndarray | None = None) -> np.ndarray:
        """Outputs of a free run, then states if the model is a formula: (n, ny + nx); by the recorded inputs if none
        are given."""
        record, start = self.base.records[trial], self.base.fit.starts[trial]
        run = (self._observed if self.is_formula else self.model.compiled).run(
            record.time,
            record.inputs if inputs is None else inputs,
            self.parameters,
            start,
            substeps=self.base.substeps,
            before=self.base.fit.before(trial),
        )
        return run.outputs

    @cached_property
    def _observed(self) -> CompiledModel:
        return CompiledModel(self.model.system, [*self.model.signals, *(v.name for v in self.model.system.states)])

    def _positions(self, outputs: np.ndarray) -> np.ndarray:
        """The outputs as a perfect sensor would show them."""
        if self.model.residual is None:
            return outputs
        result = outputs.copy()
        for name, position in self.model.residual.positions.items():
            k = self.model.signals.index(name)
            scale, offset = (float(part(self.parameters)) for part in (position.scale, position.offset))
            result[:, k] = (outputs[:, k] - offset) / scale
        return result
