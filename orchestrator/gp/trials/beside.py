"""A physics model with a learned block beside it: one model, for free runs from estimated start values."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property

import casadi as ca
import numpy as np
import scipy
from numpy.typing import NDArray

from fmus.errors import MisfitError
from fmus.symbolic.system import SymbolicSystem, Variable
from orchestrator.gp.block import Block
from orchestrator.gp.export import mean_expressions
from orchestrator.gp.trials.places import MISSING, places_of
from orchestrator.measurements import BoundTrial
from orchestrator.models.compiled import CompiledModel, level_for_long_sums
from orchestrator.models.contract import FittedTrial
from orchestrator.models.correction import PREFIX, ResidualSystem
from orchestrator.models.smoothing import SmoothedTrial
from orchestrator.models.symbolic import SymbolicModel

Array = NDArray[np.float64]
# First states are moved at most so often, until a move takes less than this share off the sum of squares.
_MOST_STEPS, _ENOUGH = 8, 1e-3
_ROOM = 1e-12


class ModelBeside(SymbolicModel):
    """A model whose correction inputs get what a block expects at every instant, times a share of each output.

    Shares are inputs behind those of the model: 0 is the model alone. First states are estimated as those of the model
    alone, so that both follow a trial on equal terms.
    """

    def __init__(self, model: SymbolicModel, block: Block) -> None:
        self._model = model
        super().__init__(f"{model.name} with its block", _joined(model, block), model.signals)
        held = model.compiled.held
        self.compiled = CompiledModel(self.system, self.signals, level=level_for_long_sums(), held=held)

    @cached_property
    def residual(self) -> ResidualSystem | None:
        """What the measurements show of the states of the model alone."""
        return self._model.residual

    def restricted(self, signals: object, free: object = ()) -> "SymbolicModel":
        """The same; its signals were chosen with the model."""
        return self

    def along(self, trial: BoundTrial, shares: Mapping[str, float], noise: Array) -> FittedTrial:
        """A free run along a trial with these shares of the block's outputs; 0 where none is named.

        Args:
            trial: the trial, in the model's units.
            shares: share of each output of the block that is added, 1 for all of it.
            noise: (ny,), standard deviation of each output.
        """
        names = [v.name for v in self.system.inputs[len(self._model.system.inputs) :]]
        columns = [np.full(len(trial.time), shares.get(name.removeprefix("share of "), 0.0)) for name in names]
        inputs = np.column_stack([trial.inputs, *columns])
        return self._followed(SmoothedTrial(trial.time, inputs, trial.outputs, noise))

    def _followed(self, trial: SmoothedTrial) -> FittedTrial:
        """The free run whose first states fit a trial best, by Gauss and Newton with the slopes of the first run.

        Slopes of a block take six times as long as its values, and change little over the few deviations that first
        states may move.
        """
        record = self.record(trial)
        steps, p = self.substeps(record, self.compiled.parameters, trial.noise), self.compiled.parameters
        start = record.start
        if not start.size:
            return FittedTrial(self.compiled.run(trial.time, trial.inputs, p, start, substeps=steps).outputs, {})
        run = self.compiled.run(trial.time, trial.inputs, p, start, substeps=steps, sensitivities=True)
        assert run.sensitivities is not None
        slopes = (run.sensitivities / trial.noise[:, None]).reshape(-1, len(start))
        best, left = run.outputs, (run.outputs - trial.measured) / trial.noise
        for _ in range(_MOST_STEPS):
            move = scipy.optimize.lsq_linear(
                slopes, -left.ravel(), (record.start_low - start - _ROOM, record.start_high - start + _ROOM)
            ).x
            outputs = self.compiled.run(trial.time, trial.inputs, p, start + move, substeps=steps).outputs
            now = (outputs - trial.measured) / trial.noise
            gain = 1.0 - float(np.sum(now**2)) / float(np.sum(left**2))
            if not gain > 0.0:
                break
            start, best, left = start + move, outputs, now
            if gain < _ENOUGH:
                break
        return FittedTrial(best, dict(zip((v.name for v in self.system.states), map(float, start), strict=True)))


def _joined(model: SymbolicModel, block: Block) -> SymbolicSystem:
    """The system's equations with shares of the block's means added to its correction inputs."""
    system, count = model.system, len(model.system.inputs)
    t, p = ca.MX.sym("t"), ca.MX.sym("p", len(system.parameters))
    x, d = ca.MX.sym("x", len(system.states)), ca.MX.sym("d", system.n_delays)
    u = ca.MX.sym("u", count + len(block.outputs))
    places = places_of(model, (*block.inputs, *block.factors))
    values = {name: (x if place.of == "state" else u)[place.index] for name, place in places.items()}
    given, names = u[:count], [v.name for v in system.inputs]
    for k, (output, mean) in enumerate(zip(block.outputs, mean_expressions(block, values), strict=True)):
        name = PREFIX + output.name.removesuffix(MISSING)
        if name not in names:
            raise MisfitError(f"{model.name} has no input {name} for the output {output.name} of the block")
        unit = ca.DM.zeros(count, 1)
        unit[names.index(name)] = 1.0
        given = given + unit * (u[count + k] * mean)
    dx, z = system.rhs(t, x, given, d, p)
    shares = tuple(Variable(f"share of {output.name}", "1", start=1.0) for output in block.outputs)
    source, delay = system.history(t, u[:count], p)
    return replace(
        system,
        inputs=(*system.inputs, *shares),
        rhs=ca.Function("rhs", [t, x, u, d, p], [dx, z]),
        history=ca.Function("history", [t, u, p], [source, delay]),
        relations=None,
        consistent=None,
    )
