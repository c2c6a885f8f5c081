"""Trials cut into stretches, where contacts let a free run follow no whole trial.

Play that rattles takes apart what differs by next to nothing: of two masses that chatter, free runs from starts that
differ by 1e-16 part within a few seconds, those of the true parameters, too. What they do until then tells as much of
the play, and any part of a record is as good as its first.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from orchestrator.diagnosis.search.thresholds import FEWEST_SAMPLES, MOST_STRETCHES
from orchestrator.measurements import MeasurementSet, Trial


class TooLong(Exception):
    """Free runs with an effect that makes contacts follow the trials for so many `seconds`, and then are lost."""

    def __init__(self, seconds: float) -> None:
        super().__init__(f"free runs with contacts follow the trials for {seconds:.3g} s only")
        self.seconds = seconds


def is_worth_a_cut(samples: int, without: int) -> bool:
    """Whether an effect that is followed for so many samples, twice as long as the model without it, is worth to be judged so.

    >>> is_worth_a_cut(210, 40), is_worth_a_cut(210, 140), is_worth_a_cut(27, 8)
    (True, False, False)
    """
    return samples >= max(2 * without, FEWEST_SAMPLES)


def cut(measurements: MeasurementSet, seconds: float) -> MeasurementSet:
    """Measurements whose trials are stretches of that length, at most `MOST_STRETCHES` of each, evenly spread over it."""
    trials = tuple(part for trial in measurements.trials for part in _stretches(trial, seconds))
    return replace(measurements, trials=trials, initial_conditions_given=False)


def _stretches(trial: Trial, seconds: float) -> Iterator[Trial]:
    count = int((trial.time[-1] - trial.time[0]) / seconds)
    if count < 2:
        yield trial
        return
    places = np.linspace(0, count - 1, min(count, MOST_STRETCHES)).round()
    for begin in trial.time[0] + seconds * places:
        rows = (trial.time >= begin) & (trial.time <= begin + seconds)
        columns = {name: values[rows] for name, values in trial.columns.items()}
        name = f"{trial.name} [{begin:.4g}, {begin + seconds:.4g}] s"
        yield Trial(name, trial.subset, trial.time[rows], columns, trial.units)
