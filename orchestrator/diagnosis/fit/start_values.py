"""Where another fit begins each trial, for a fit that may begin there, too."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from orchestrator.models.estimation import Fit
from orchestrator.models.smoothing import SmoothedTrial
from orchestrator.models.symbolic import SymbolicModel


@dataclass(frozen=True)
class StartValues:
    """Where a fit begins each trial: start values (nx,) of the states of its model, and the shift of the clocks in s."""

    states: tuple[str, ...]
    starts: tuple[np.ndarray, ...]
    shift: float

    @staticmethod
    def of(model: SymbolicModel, fit: Fit) -> "StartValues":
        """Where a fit of a model begins."""
        return StartValues(tuple(state.name for state in model.system.states), fit.starts, fit.shift)

    def in_model(self, model: SymbolicModel, guess: np.ndarray, trials: Sequence[SmoothedTrial]) -> Fit:
        """A fit of a model at a guess (k,), of which nothing counts but where it begins; other states begin as trials show.

        Args:
            model: a model that may have further states, or lack some.
            guess: its free parameters.
            trials: the trials that the start values belong to, in the same order.
        """
        parameters, starts = model.compiled.with_values(guess), []
        for trial, known in zip(trials, self.starts, strict=True):
            record, by_name = model.record(trial, parameters), dict(zip(self.states, known, strict=True))
            states = zip(model.system.states, record.start, strict=True)
            starts.append(record.off_bounds(np.array([by_name.get(state.name, value) for state, value in states])))
        return beginning_at(guess, starts, self.shift)


def beginning_at(guess: np.ndarray, starts: Sequence[np.ndarray], shift: float = 0.0) -> Fit:
    """A fit at a guess (k,) of which nothing counts but the start values (nx,) of each trial and the shift in s.

    Args:
        guess: values of the free parameters.
        starts: start values of each trial.
        shift: shift of the clocks in s.
    """
    unknown, inside = np.full(len(guess), np.inf), np.zeros(len(guess), bool)
    return Fit(guess, unknown, tuple(starts), np.inf, inside, 0, shift=shift)
