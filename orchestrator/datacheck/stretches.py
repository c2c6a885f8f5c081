"""Short parts of trials, and what of them a model has to predict."""

from dataclasses import dataclass

import numpy as np

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
