"""A model with free forces of the common kinds, so that a wrong column can be told from missing friction, springs and loads.

Where a machine's friction eats most of its motor's force, its model predicts nothing, whatever is done to the columns.
So every state that is driven by something gets a push: a constant and, where it is a speed, parts in proportion to the
speeds and to their signs. Their sizes are fitted by linear least squares along the model's run. A part in proportion to
positions is left out: where a machine swings, it would explain every motion, whatever its unit.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from fmus.errors import ComponentError
from fmus.symbolic.system import SymbolicSystem, Variable
from orchestrator.models.compiled import CompiledModel
from orchestrator.models.estimation import STEEPEST
from orchestrator.models.smoothing import SmoothedTrial
from orchestrator.models.symbolic import ROUGH, SymbolicModel, enough_substeps

# A model that errs by more than this many times what there is to predict says nothing more by erring more.
WORST = 1e4
TINY = 1e-300


@dataclass(frozen=True, eq=False)
class Stretch:
    """A short part of a trial: `time` (n,), `inputs` (n, nu), `outputs` (n, ny), in the units of the model."""

    time: np.ndarray
    inputs: np.ndarray
    outputs: np.ndarray


def bent(time: np.ndarray, series: np.ndarray) -> np.ndarray:
    """What a straight line leaves of series (n, k): the part that a model has to predict."""
    base = np.column_stack([np.ones(len(time)), time - time.mean()])
    base[:, 1] /= np.ptp(time)
    return np.asarray(series - base @ np.linalg.lstsq(base, series, rcond=None)[0])


# Rounds of a fit whose run depends on what was fitted before.
ROUNDS = 3
# Speeds below this share of the largest are where friction changes its side.
SLOW = 0.03
# A push is tried at a size that moves the outputs by this share of what there is to predict.
TRIAL = 1e-3


@dataclass(frozen=True, eq=False)
class PushedModel:
    """A model whose driven states can be pushed; `speeds` tells of each whether it is the speed of another state."""

    model: SymbolicModel
    names: tuple[str, ...]

    @cached_property
    def system(self) -> SymbolicSystem:
        """The model's system with the pushes as further inputs."""
        return with_pushes(self.model.system, [place for place, _ in self.driven])

    @cached_property
    def driven(self) -> list[tuple[int, bool]]:
        """States that can be pushed, and whether they are speeds."""
        return driven_states(self.model.system)

    @cached_property
    def compiled(self) -> CompiledModel:
        """The system with the outputs that are measured."""
        return CompiledModel(self.system, self.names)

    def left(self, parts: Sequence[Stretch], noise: np.ndarray) -> np.ndarray:
        """Share (ny,) of the outputs' bent part that the model does not predict even with the best pushes, common to all."""
        sizes = [np.sum(bent(part.time, part.outputs) ** 2, axis=0) for part in parts]
        whole = np.sum(sizes, axis=0) + TINY
        try:
            fits = [_Fit(self, part, noise, np.sqrt(whole)) for part in parts]
            push = np.zeros(fits[0].basis.shape[1] * len(self.driven))
            best = np.inf
            for _ in range(ROUNDS):
                lines = [fit.reduced(push) for fit in fits]
                system, wanted = (np.concatenate([line[k] for line in lines]) for k in (0, 1))
                push = push + np.linalg.lstsq(system, wanted, rcond=1e-9)[0]
                errors = np.sum([fit.moved(push) for fit in fits], axis=0)
                best = np.minimum(best, errors)
        except (ComponentError, np.linalg.LinAlgError, ValueError, FloatingPointError):
            return np.full(len(self.names), WORST)
        return np.asarray(np.clip(best / whole, 0.0, WORST))


class _Fit:
    """Start values and pushes along one stretch, by Gauss and Newton."""

    def __init__(self, pushed: PushedModel, part: Stretch, noise: np.ndarray, scale: np.ndarray) -> None:
        self.pushed, self.part, self.scale = pushed, part, scale
        trial = SmoothedTrial(part.time, part.inputs, part.outputs, noise)
        found = pushed.model.follow(part.time, part.inputs, part.outputs, pushed.names, noise)
        self.start = np.array([found.start[v.name] for v in pushed.model.system.states])
        # Signs of speeds, not of their size: friction is told from a viscous force by its corner.
        speeds = trial.speeds / (np.abs(trial.speeds).max(axis=0) + TINY)
        self.basis = np.column_stack([np.ones(len(part.time)), trial.speeds, np.tanh(speeds / SLOW)])

    def inputs(self, push: np.ndarray) -> np.ndarray:
        """Inputs of the pushed system."""
        shape = self.basis.shape[1]
        pushes = [self._allowed(k) @ push[k * shape : (k + 1) * shape] for k in range(len(self.pushed.driven))]
        return np.column_stack([self.part.inputs, *pushes])

    def _allowed(self, k: int) -> np.ndarray:
        """The basis of a push; a state that is no speed is not pushed in proportion to rates, which would explain all."""
        if self.pushed.driven[k][1]:
            return self.basis
        kept = self.basis.copy()
        kept[:, 1:] = 0.0
        return kept

    def reduced(self, push: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Equations for changes of the pushes, with the start values of this stretch taken out."""
        model, inputs = self.pushed.compiled, self.inputs(push)
        self.steps = enough_substeps(model, self.part.time, inputs, model.parameters, self.start, ROUGH)
        run = self._run(inputs, sensitivities=True)
        assert run.sensitivities is not None
        self.here = run.outputs
        responses = [
            self._response(inputs, k, column) for k in range(len(self.pushed.driven)) for column in self._allowed(k).T
        ]
        ahead = np.stack([response / self.scale for response in responses], axis=-1).reshape(-1, len(responses))
        starts = run.sensitivities.reshape(len(ahead), -1) / np.tile(self.scale, len(run.outputs))[:, None]
        wanted = ((self.part.outputs - run.outputs) / self.scale).ravel()
        if not all(np.isfinite(part).all() and np.abs(part).max() < STEEPEST for part in (ahead, starts, wanted)):
            raise ComponentError(f"{self.pushed.system.name} depends on its start too steeply to be followed")
        base, _ = np.linalg.qr(starts)
        self.solve = (starts, ahead, wanted, push)
        return ahead - base @ (base.T @ ahead), wanted - base @ (base.T @ wanted)

    def moved(self, push: np.ndarray) -> np.ndarray:
        """Move the start values to go with the pushes; returns the squared error of each output."""
        starts, ahead, wanted, before = self.solve
        if not np.isfinite(push).all():
            raise ComponentError(f"{self.pushed.system.name} has no pushes that follow the record")
        change = np.linalg.lstsq(starts, wanted - ahead @ (push - before), rcond=1e-12)[0]
        self.start = self.start + change
        run = self._run(self.inputs(push), sensitivities=False)
        return np.asarray(np.sum(bent(self.part.time, self.part.outputs - run.outputs) ** 2, axis=0))

    def _response(self, inputs: np.ndarray, k: int, column: np.ndarray) -> np.ndarray:
        """Change of the outputs (n, ny) for a push by a column."""
        place = self.part.inputs.shape[1] + k
        size = 1e-6 * (np.abs(inputs).max() + 1.0)
        if not column.any():
            return np.zeros_like(self.part.outputs)
        for _ in range(2):
            pushed = inputs.copy()
            pushed[:, place] += size * column
            answer = (self._run(pushed, sensitivities=False).outputs - self.here) / size
            reach = float(np.max(np.linalg.norm(answer, axis=0) / self.scale))
            size = TRIAL / (reach + TINY)
        return answer

    def _run(self, inputs: np.ndarray, sensitivities: bool) -> Any:
        model = self.pushed.compiled
        return model.run(
            self.part.time, inputs, model.parameters, self.start, substeps=self.steps, sensitivities=sensitivities
        )


def driven_states(system: SymbolicSystem) -> list[tuple[int, bool]]:
    """Places of the states whose rate is not merely another state, and whether they are the rate of one."""
    count = len(system.states)
    t, p = ca.SX.sym("t"), ca.SX.sym("p", len(system.parameters))
    x, u, d = ca.SX.sym("x", count), ca.SX.sym("u", len(system.inputs)), ca.SX.sym("d", system.n_delays)
    rates = system.rhs(t, x, u, d, p)[0]
    speed_of = {i: j for i in range(count) for j in range(count) if ca.is_equal(rates[i], x[j])}
    return [(i, i in speed_of.values()) for i in range(count) if i not in speed_of]


def with_pushes(system: SymbolicSystem, places: Sequence[int]) -> SymbolicSystem:
    """A system with an input that adds to the rate of each of some states."""
    symbol: Any = ca.SX.sym if system.rhs.is_a("SXFunction") else ca.MX.sym
    sizes = (1, len(system.states), len(system.inputs) + len(places), system.n_delays, len(system.parameters))
    t, x, u, d, p = (symbol(name, size) for name, size in zip("txudp", sizes, strict=True))
    nu = len(system.inputs)
    dx, z = system.rhs(t, x, u[:nu], d, p)
    spread = ca.DM.zeros(len(system.states), len(places))
    for k, place in enumerate(places):
        spread[place, k] = 1.0
    rhs = ca.Function("rhs", [t, x, u, d, p], [dx + ca.mtimes(spread, u[nu:]), z])
    history = ca.Function("history", [t, u, p], list(system.history(t, u[:nu], p)))
    added = tuple(Variable(f"push({system.states[place].name})", "", "", 0.0) for place in places)
    return replace(system, inputs=(*system.inputs, *added), rhs=rhs, history=history, consistent=None, relations=None)
