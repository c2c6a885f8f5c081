"""Free runs over windows: how well a fitted set predicts several horizons ahead, without seeing what it predicts."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fmus.errors import ComponentError
from orchestrator.greybox.filtering import Filtered, GreyBox, Trial

# Windows in a trial: one is a free run over nearly all of it.
WINDOWS = (1, 8, 32, 128)
# Those over which sets are compared.
HORIZONS = WINDOWS[1:]
# A window has at least so many samples, as far as a trial is long enough for eight of them.
LEAST_SAMPLES = 8
# A run begins when the filter has found the states.
SETTLING = 0.03


@dataclass(frozen=True, eq=False)
class Prediction:
    """Mean squared errors of free runs over windows, (windows, ny), for each number of windows in a trial."""

    squares: dict[int, np.ndarray]

    def rms(self, windows: int) -> np.ndarray:
        """Root mean square error by signal, (ny,)."""
        return np.sqrt(np.mean(self.squares[windows], axis=0))


def predicted(
    box: GreyBox, theta: np.ndarray, trials: Sequence[Trial], runs: Sequence[Filtered], substeps: int
) -> Prediction:
    """Free runs from the filtered states at the beginning of each window; a run that fails counts as infinitely wrong."""
    found: dict[int, list[np.ndarray]] = {count: [] for count in WINDOWS}
    values = box.compiled.with_values([*np.zeros(len(box.balances)), *theta])
    for trial, run in zip(trials, runs, strict=True):
        first = max(1, int(SETTLING * len(trial.time)))
        for count in WINDOWS:
            shown = min(count, max((len(trial.time) - first) // LEAST_SAMPLES, 8))
            edges = np.linspace(first, len(trial.time) - 1, shown + 1).astype(int)
            for begin, end in zip(edges[:-1], edges[1:], strict=True):
                if end - begin > 2:
                    found[count].append(_square(box, values, trial, run, begin, end, substeps))
    return Prediction({count: np.array(squares) for count, squares in found.items()})


def _square(
    box: GreyBox, values: np.ndarray, trial: Trial, run: Filtered, begin: int, end: int, substeps: int
) -> np.ndarray:
    part = slice(begin, end + 1)
    try:
        free = box.compiled.run(trial.time[part], trial.inputs[part], values, run.mean[begin], substeps=substeps)
    except ComponentError:
        return np.full(trial.measured.shape[1], np.inf)
    return np.nanmean((free.outputs - trial.measured[part]) ** 2, axis=0)
