"""How much of what a record shows a model predicts over short stretches, from free start values in each of them.

Free runs over whole trials would not do: plants integrate, are unstable or chaotic, and models lack effects. Over the
time in which a signal swings once, a right model with a missing effect still predicts most of what there is; one that
is fed a wrong column predicts next to nothing.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fmus.errors import ComponentError
from orchestrator.datacheck import limits
from orchestrator.datacheck.findings import NO_CHANGE, Change
from orchestrator.datacheck.pushes import TINY, WORST, PushedModel, Stretch, bent, driven_states
from orchestrator.measurements import BoundSet, BoundTrial
from orchestrator.models.contract import Model
from orchestrator.models.symbolic import SymbolicModel

# Stretches that are looked at, and samples that each has at least and at most; the first look at a change is at the
# first ones of the first stretch.
MANY, SHORTEST, LONGEST, FIRST_LOOK = 4, 24, 400, 150
# Less than this is rounding.
LEAST = 1e-12
# Columns are differentiated over this share of a trial, so that their noise does not count as motion.
REACH = 1 / 200
# Polynomials up to this degree are drifts, as integrating plants show them.
DRIFT = 3


@dataclass(frozen=True, eq=False)
class Predictor:
    """A model beside trials: what it leaves of them, as they are and with a changed column, by `most` stretches."""

    model: Model
    data: BoundSet
    trials: tuple[BoundTrial, ...]
    most: int = MANY

    @property
    def names(self) -> tuple[str, ...]:
        """All inputs, then all measured outputs."""
        return (*self.data.input_names, *self.data.output_names)

    @cached_property
    def noise(self) -> np.ndarray:
        """Standard deviation of the noise of each of `names`."""
        return np.array([self.data.noise_std.get(name, 0.0) for name in self.names])

    @cached_property
    def moving(self) -> tuple[str, ...]:
        """Inputs and outputs that are measured and not constant."""
        every = np.concatenate([np.hstack([t.inputs, t.outputs]) for t in self.trials])
        return tuple(name for name, extent in zip(self.names, np.ptp(every, axis=0), strict=True) if extent > 0)

    @cached_property
    def rows(self) -> tuple[tuple[int, slice], ...]:
        """The most active stretches, as (trial, rows), spread over the trials, the best of each trial first."""
        count = max(1, self.most // len(self.trials))
        found = [[(k, rows) for rows in _active(trial)[:count]] for k, trial in enumerate(self.trials[: self.most])]
        return tuple(each for rank in range(count) for own in found for each in own[rank : rank + 1])

    def stretches(self, change: Change, *, few: bool = False) -> list[Stretch]:
        """The stretches with changed columns."""
        rows = self.rows
        if few:
            k, whole = rows[0]
            rows = ((k, slice(whole.start, min(whole.stop, whole.start + FIRST_LOOK))),)
        changed, nu = {}, len(self.data.input_names)
        for k in {k for k, _ in rows}:
            trial = self.trials[k]
            changed[k] = change.applied(trial.time, np.hstack([trial.inputs, trial.outputs]), self.names)
        return [Stretch(changed[k][0][r], changed[k][1][r, :nu], changed[k][1][r, nu:]) for k, r in rows]

    def left(self, change: Change = NO_CHANGE, *, few: bool = False) -> float:
        """Share of what the outputs show that the model does not predict, of the output that it predicts worst.

        1 means that a straight line through each stretch is as good.
        """
        return float(max(self._shares(change, few).max(), LEAST))

    def errors(self, change: Change = NO_CHANGE) -> np.ndarray:
        """Root mean square error (ny,) over the stretches, in the units of the outputs."""
        there = np.concatenate([bent(part.time, part.outputs) for part in self.stretches(change)])
        return np.asarray(np.sqrt(self._shares(change, few=False) * np.mean(there**2, axis=0)))

    def reaches_noise(self, change: Change) -> bool:
        """Whether the model errs by hardly more than the noise of each output, with changed columns."""
        noise = change.noise(self.noise, self.names)[len(self.data.input_names) :]
        return bool(np.all(self.errors(change) < limits.NEAR_NOISE * noise))

    @cached_property
    def _as_recorded(self) -> np.ndarray:
        return self._of_stretches(NO_CHANGE, few=False)

    def _shares(self, change: Change, few: bool) -> np.ndarray:
        return self._as_recorded if change is NO_CHANGE and not few else self._of_stretches(change, few)

    def _of_stretches(self, change: Change, few: bool) -> np.ndarray:
        noise = change.noise(self.noise, self.names)[len(self.data.input_names) :]
        return unexplained(self.model, self.stretches(change, few=few), self.data.output_names, noise)

    @property
    def is_stepped(self) -> bool:
        """Whether the model makes steps of its own, so that a run takes as long as the time that it goes through."""
        return isinstance(self.model, SymbolicModel) and self.model.is_stepped

    @cached_property
    def can_be_pushed(self) -> bool:
        """Whether the model's equations are open and hold speeds, which friction may brake."""
        return type(self.model) is SymbolicModel and any(speed for _, speed in driven_states(self.model.system))

    @cached_property
    def _pushed(self) -> PushedModel:
        assert isinstance(self.model, SymbolicModel)
        return PushedModel(self.model, self.data.output_names)

    def left_when_pushed(self, change: Change = NO_CHANGE, *, few: bool = False) -> float:
        """The same as `left` for the model with free pushes; see `pushes`."""
        noise = change.noise(self.noise, self.names)[len(self.data.input_names) :]
        return float(max(self._pushed.left(self.stretches(change, few=few), noise).max(), LEAST))


def unexplained(model: Model, parts: Sequence[Stretch], names: Sequence[str], noise: np.ndarray) -> np.ndarray:
    """Share (ny,) of the outputs' bent part that the model does not predict; more than 1 where it is worse than nothing.

    Args:
        model: the model.
        parts: stretches of the record.
        names: the outputs (ny of them).
        noise: (ny,), standard deviation of each.
    """
    left, there = np.zeros(len(names)), np.zeros(len(names))
    for part in parts:
        size = np.sum(bent(part.time, part.outputs) ** 2, axis=0)
        try:
            run = model.follow(part.time, part.inputs, part.outputs, names, noise).outputs
            with np.errstate(over="ignore"):
                error = np.sum(bent(part.time, part.outputs - run) ** 2, axis=0)
        except (ComponentError, np.linalg.LinAlgError, ValueError):
            error = np.full(len(names), np.inf)
        left += np.minimum(np.nan_to_num(error, nan=np.inf), WORST * size)
        there += size
    return np.asarray(np.clip(left / np.maximum(there, TINY), 0.0, WORST))


def _active(trial: BoundTrial) -> list[slice]:
    """Stretches of a trial, the most active first."""
    length = _length(trial)
    size = np.var(trial.outputs, axis=0) + TINY
    found = [slice(start, start + length) for start in range(0, max(1, len(trial.time) - length + 1), length)]

    def activity(rows: slice) -> float:
        return float(np.sum(np.var(bent(trial.time[rows], trial.outputs[rows]), axis=0) / size))

    return sorted(found, key=activity, reverse=True)


def _length(trial: BoundTrial) -> int:
    """Samples in the shortest period of the outputs, by Rice's formula for the rate of mean crossings, without slow drifts."""
    step = float(np.mean(np.diff(trial.time)))
    slow = np.polynomial.chebyshev.chebvander(np.linspace(-1, 1, len(trial.time)), DRIFT)
    around = trial.outputs - slow @ np.linalg.lstsq(slow, trial.outputs, rcond=None)[0]
    reach = max(1, int(len(around) * REACH))
    speed = (around[reach:] - around[:-reach]) / (reach * step)
    period = 2 * np.pi * np.sqrt(np.var(around, axis=0) / (np.var(speed, axis=0) + TINY))
    return int(np.clip(period.min() / step, SHORTEST, min(LONGEST, len(trial.time))))
