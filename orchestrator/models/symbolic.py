"""The model of a Modelica class: symbolic equations, compiled for free runs, fits and correction residuals."""

import hashlib
from collections.abc import Sequence
from functools import cached_property
from typing import Protocol

import casadi as ca
import numpy as np

from fmus.errors import ComponentError, ModelicaError
from fmus.symbolic.system import SymbolicSystem, Variable
from orchestrator.models.compiled import CompiledModel
from orchestrator.models.contract import FittedTrial
from orchestrator.models.correction import ResidualSystem, residual_system
from orchestrator.models.estimation import Fit, Record, fit
from orchestrator.models.first_stretch import LONGEST, start_of_first_stretch
from orchestrator.models.smoothing import SmoothedTrial

# Start values that no measurement shows, such as an activation, lie this far from equilibrium, as a share of their range.
HIDDEN_SPREAD = 0.2
SETTLING_S = 2.0
MOST_SUBSTEPS = 32
# An error of a run that is this share of the noise is not found in ten thousand samples.
UNSEEN = 0.03
# An error of a run that is this share of what the model misses, as a root mean square, cannot change which set of effects
# is the better one. A share of 0.01 did: steps too long for a stiff motor err alike in all samples, and a fit follows them.
NEGLIGIBLE = 0.001
# Steps are short enough if halving them changes the outputs by less than this share of their range.
CLOSE, ROUGH = 1e-5, 1e-2


class Motion(Protocol):
    """A trial, measured or simulated, with speeds and accelerations of its signals; see SmoothedTrial."""

    @property
    def time(self) -> np.ndarray: ...

    @property
    def inputs(self) -> np.ndarray: ...

    @property
    def measured(self) -> np.ndarray: ...

    @property
    def values(self) -> np.ndarray: ...

    @property
    def speeds(self) -> np.ndarray: ...

    @property
    def accelerations(self) -> np.ndarray: ...


class SymbolicModel:
    """A `SymbolicSystem` as a model: `free` parameters can be fitted, the others keep their values."""

    # Whether it makes steps of its own, as an FMU for co-simulation does.
    is_stepped = False

    def __init__(
        self,
        name: str,
        system: SymbolicSystem,
        signals: Sequence[str] | None = None,
        free: Sequence[str] = (),
        held: Sequence[str] = (),
    ):
        if system.relations is not None and system.relations.memory is not None:
            kept = ", ".join(system.relations.memory.names[:3])
            raise ModelicaError(
                f"{system.name} keeps values from event to event ({kept}), which fits cannot follow; write it as an FMU by "
                "'misfit build' and name that"
            )
        self.name, self.system = name, system
        self.signals = tuple(signals if signals is not None else system.outputs)
        self.compiled = CompiledModel(system, self.signals, free, held=held)

    @property
    def inputs(self) -> Sequence[Variable]:
        return self.system.inputs

    @property
    def outputs(self) -> Sequence[Variable]:
        variables = {v.name: v for v in (*self.system.states, *self.system.algebraics)}
        return [variables[name] for name in self.system.outputs]

    @cached_property
    def content_hash(self) -> str:
        """SHA-256 over equations, names and start values."""
        digest = hashlib.sha256(repr((self.system.states, self.system.inputs, self.system.parameters)).encode())
        digest.update(self.system.rhs.serialize().encode())
        return digest.hexdigest()

    @cached_property
    def residual(self) -> ResidualSystem | None:
        """The correction residual of the signals, None if the equations do not show one."""
        return residual_system(self.system, self.signals)

    @cached_property
    def reads_through_parameters(self) -> bool:
        """Whether what a measurement shows of a state depends on a free parameter, such as an encoder's offset."""
        if self.residual is None:
            return False
        names = [v.name for v in self.system.parameters]
        p = ca.SX.sym("p", len(names))
        free = [p[names.index(name)] for name in self.compiled.free]
        maps = [part(p) for m in self.residual.positions.values() for part in (m.scale, m.offset)]
        return bool(free and maps) and ca.depends_on(ca.vertcat(*maps), ca.vertcat(*free))

    @cached_property
    def compiled_residual(self) -> CompiledModel:
        """The correction residual, compiled with the same free parameters."""
        assert self.residual is not None
        return CompiledModel(
            self.residual.system, self.residual.system.outputs, self.compiled.free, held=self.compiled.held
        )

    def restricted(self, signals: Sequence[str], free: Sequence[str] = ()) -> "SymbolicModel":
        """The same model with other signals to compare and other free parameters."""
        if tuple(signals) == self.signals and tuple(free) == self.compiled.free:
            return self
        return SymbolicModel(self.name, self.system, signals, free, self.compiled.held)

    def with_held(self, held: Sequence[str]) -> "SymbolicModel":
        """The same model whose inputs `held` stay at a sample's value until the next sample; the others run in lines."""
        if tuple(held) == self.compiled.held:
            return self
        return SymbolicModel(self.name, self.system, self.signals, self.compiled.free, held)

    def simulate(
        self, time: np.ndarray, inputs: np.ndarray, names: Sequence[str], start: dict[str, float]
    ) -> np.ndarray:
        model = self.restricted(names).compiled
        first = np.array([start[v.name] for v in self.system.states])
        steps = enough_substeps(model, time, inputs, model.parameters, first, CLOSE)
        return model.run(time, inputs, model.parameters, first, substeps=steps).outputs

    def follow(
        self, time: np.ndarray, inputs: np.ndarray, measured: np.ndarray, names: Sequence[str], noise: np.ndarray
    ) -> FittedTrial:
        model = self.restricted(names)
        record = model.record(SmoothedTrial(time, inputs, measured, noise))
        steps = model.substeps(record, model.compiled.parameters, noise)
        found = fit(model.compiled, [record], noise, (), (), (), substeps=steps)
        return model.run_fit(record, found, 0, steps)

    def run_fit(self, record: Record, found: Fit, trial: int, substeps: int) -> FittedTrial:
        """Free run of a trial with fitted parameters and start values.

        Args:
            record: the trial.
            found: a fit of several trials.
            trial: number of this one among them, from 0.
            substeps: integration steps in a sample interval.

        Raises:
            ComponentError: if the run fails.
        """
        start = found.starts[trial]
        parameters = self.compiled.with_values(found.values)
        before = found.before(trial)
        run = self.compiled.run(record.time, record.inputs, parameters, start, substeps=substeps, before=before)
        names = [v.name for v in self.system.states]
        reach = 0.5 * (record.start_high - record.start_low)
        return FittedTrial(run.outputs, *(dict(zip(names, map(float, part), strict=True)) for part in (start, reach)))

    def substeps(self, record: Record, parameters: np.ndarray, noise: np.ndarray | float = np.inf) -> int:
        """Integration steps in a sample interval at which halving them hardly changes the outputs of a record's run.

        They change by less than 1e-5 of their range, and less than a share of their `noise` (ny,): that error is the same
        in thousands of samples, and would be found. Where the run is far from the measurement, it need not be closer to
        the exact one than `NEGLIGIBLE` of that distance.

        Args:
            record: the trial, with start values.
            parameters: values of all parameters.
            noise: (ny,), standard deviation of each output; infinite where it does not count.
        """
        return enough_substeps(
            self.compiled, record.time, record.inputs, parameters, record.start, CLOSE, noise, record.measured
        )

    def residual_substeps(self, trial: Motion, parameters: np.ndarray, start: np.ndarray) -> int:
        """The same for the correction residual along a trial, whose states are those that are not measured.

        A rough integration is enough for a first look; but a stiff effect, such as a tendon, must stay stable.

        Args:
            trial: what was measured, with speeds and accelerations.
            parameters: values of all parameters.
            start: first values of the states that are not measured.
        """
        inputs = self.residual_inputs(trial)
        return enough_substeps(self.compiled_residual, trial.time, inputs, parameters, start, ROUGH)

    def record(self, trial: SmoothedTrial, parameters: np.ndarray | None = None) -> Record:
        """A trial with first guesses of the start values and their bounds, at given values of all parameters.

        States that are measured start within five standard deviations of the smoothed measurement, so that a wrong
        model cannot hide behind impossible start values; hidden states start near their equilibrium. If no state can be
        read off the measurement, they start where the run follows its first stretch.
        """
        states = self.system.states
        parameters = self.compiled.parameters if parameters is None else parameters
        start = self.system.start_of_states(ca.DM(parameters)).full().ravel()
        low = np.array([-np.inf if v.minimum is None else v.minimum for v in states])
        high = np.array([np.inf if v.maximum is None else v.maximum for v in states])
        spread = np.full(len(states), np.inf)
        if self.residual is not None:
            shown = self._measured_start(trial, parameters)
            hidden = self._settled(self.residual_inputs(trial)[0], parameters)
            for i, variable in enumerate(states):
                if variable.name in shown:
                    start[i], reach = shown[variable.name]
                    low[i], high[i] = start[i] - 5 * reach, start[i] + 5 * reach
                else:
                    start[i] = hidden[variable.name]
                    spread[i] = HIDDEN_SPREAD * (high[i] - low[i])
        elif states:
            start = self._followed_start(trial, parameters, start, low, high)
        return Record(trial.time, trial.inputs, trial.measured, np.clip(start, low, high), spread, low, high)

    def _followed_start(
        self, trial: SmoothedTrial, parameters: np.ndarray, start: np.ndarray, low: np.ndarray, high: np.ndarray
    ) -> np.ndarray:
        """Start values from which the first stretch of a trial is followed."""
        time, inputs = trial.time[:LONGEST], trial.inputs[:LONGEST]
        steps = enough_substeps(self.compiled, time, inputs, parameters, start, ROUGH)
        measured = trial.measured[:LONGEST]
        return start_of_first_stretch(
            self.compiled, time, inputs, measured, trial.noise, parameters, start, low, high, steps
        )

    def _measured_start(self, trial: SmoothedTrial, parameters: np.ndarray) -> dict[str, tuple[float, float]]:
        """Value and standard deviation of each measured state at the first sample."""
        assert self.residual is not None
        found: dict[str, tuple[float, float]] = {}
        for signal, position in self.residual.positions.items():
            first = trial.beginnings[self.signals.index(signal)]
            scale, offset = (float(part(parameters)) for part in (position.scale, position.offset))
            found[position.state] = ((first.value - offset) / scale, first.value_std / abs(scale))
            if position.speed is not None:
                found[position.speed] = (first.speed / scale, first.speed_std / abs(scale))
        return found

    @cached_property
    def hidden(self) -> CompiledModel:
        """The states that are not measured, as outputs of the residual system."""
        assert self.residual is not None
        return CompiledModel(self.residual.system, [v.name for v in self.residual.system.states])

    def _settled(self, inputs: np.ndarray, parameters: np.ndarray) -> dict[str, float]:
        """Hidden states after the first inputs have been held for a while."""
        names = self.hidden.outputs
        if not names:
            return {}
        time = np.linspace(0.0, SETTLING_S, 401)
        first = self.hidden.system.start_of_states(ca.DM(parameters)).full().ravel()
        run = self.hidden.run(time, np.tile(inputs, (len(time), 1)), parameters, first, substeps=4)
        return dict(zip(names, map(float, run.outputs[-1]), strict=True))

    def residual_inputs(self, trial: Motion) -> np.ndarray:
        """Inputs of the residual system along a trial, shape (n, n_inputs)."""
        assert self.residual is not None
        series = {v.name: trial.inputs[:, i] for i, v in enumerate(self.system.inputs)}
        for k, name in enumerate(self.signals):
            position = self.residual.positions.get(name)
            if position is None:
                series[f"target:{name}"] = trial.measured[:, k]
                continue
            series[f"measured:{name}"] = trial.values[:, k]
            series[f"speed:{name}"] = trial.speeds[:, k]
            series[f"target:{name}"] = trial.speeds[:, k] if position.speed is None else trial.accelerations[:, k]
        return np.column_stack([series[v.name] for v in self.residual.system.inputs])


def enough_substeps(
    model: CompiledModel,
    time: np.ndarray,
    inputs: np.ndarray,
    parameters: np.ndarray,
    start: np.ndarray,
    share: float,
    noise: np.ndarray | float = np.inf,
    measured: np.ndarray | None = None,
) -> int:
    """Integration steps in a sample interval at which halving them hardly changes the outputs, `MOST_SUBSTEPS` at most.

    They change by less than `share` of their range and `UNSEEN` of their noise, or, as a root mean square, by less than
    `NEGLIGIBLE` of their distance from what was `measured`. Steps at which a run leaves the finite numbers are too
    long. One is enough with contacts, where steps are as short as they must be, and of what has steps of its own.

    Args:
        model: the compiled model.
        time: (n,) in s.
        inputs: (n, nu).
        parameters: values of all parameters.
        start: (nx,), first values of the states.
        share: share of an output's range by which it may change.
        noise: (ny,), standard deviation of each output; infinite where it does not count.
        measured: (n, ny), what the run is compared with, if it is.
    """
    if not model.system.states or model.system.contacts or model.has_own_steps:
        return 1

    def outputs(count: int) -> np.ndarray | None:
        try:
            return model.run(time, inputs, parameters, start, substeps=count).outputs
        except ComponentError:
            return None

    # What is delayed has its kinks between samples.
    count = 2 if model.system.n_delays else 1
    coarse = outputs(count)
    while count < MOST_SUBSTEPS:
        fine = outputs(2 * count)
        if coarse is not None and fine is not None:
            change = np.abs(fine - coarse)
            most = np.minimum(share * np.ptp(fine, axis=0), UNSEEN * noise) + 1e-12
            enough = change.max(axis=0) <= most
            if measured is not None:
                apart = _rms(change)
                enough |= np.isfinite(apart) & (apart <= NEGLIGIBLE * _rms(fine - measured))
            if enough.all():
                break
        count, coarse = 2 * count, fine
    return count


def _rms(series: np.ndarray) -> np.ndarray:
    with np.errstate(over="ignore"):  # a run with steps that are too long may grow beyond all bounds
        return np.sqrt(np.mean(series**2, axis=0))
