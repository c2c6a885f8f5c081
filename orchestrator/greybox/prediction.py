"""Free runs over windows: how well a fitted set predicts several horizons ahead, without seeing what it predicts."""

from collections.abc import Sequence

import numpy as np

from fmus.errors import ComponentError
from orchestrator.greybox.filtering import Filtered, GreyBox, Trial
from orchestrator.greybox.fit import Fit

# Numbers of windows in a trial over which sets can be compared, the longest windows first.
HORIZONS = (8, 32, 128)
# One window is a whole trial.
WHOLE = 1
# A window has at least so many samples, as far as a trial is long enough for eight of them.
LEAST_SAMPLES = 8
# A run begins when the filter has found the states.
SETTLING = 0.03


def squared_errors(
    box: GreyBox, theta: np.ndarray, trials: Sequence[Trial], runs: Sequence[Filtered], count: int
) -> np.ndarray:
    """Mean squared errors of free runs over `count` windows of each trial, (windows, ny).

    Runs begin from the filtered states at the beginning of each window; one that fails counts as infinitely wrong.

    Args:
        box: the model with its effects.
        theta: values (k,) of its free parameters.
        trials: the trials.
        runs: the filter along each of them.
        count: windows of each trial at most; fewer where that would leave too few samples in each.
    """
    found = []
    values = box.compiled.with_values([*np.zeros(len(box.balances)), *theta])
    for trial, run in zip(trials, runs, strict=True):
        first = max(1, int(SETTLING * len(trial.time)))
        shown = min(count, max((len(trial.time) - first) // LEAST_SAMPLES, 8))
        edges = np.linspace(first, len(trial.time) - 1, shown + 1).astype(int)
        for begin, end in zip(edges[:-1], edges[1:], strict=True):
            if end - begin > 2:
                found.append(_square(box, values, trial, run, begin, end))
    return np.array(found)


def foretold(fit: Fit, scale: np.ndarray, signals: Sequence[str]) -> list[str]:
    """Signals that free runs along whole trials can foretell.

    What is not known of the states at the end of a trial, carried along the trial once more, stays within the signal's spread.
    That of a plant that falls over does not: how far its free runs go astray is chance.

    Args:
        fit: a fitted model.
        scale: spread (ny,) of each signal.
        signals: their names.
    """
    told = np.ones(len(signals), dtype=bool)
    for trial, noise in zip(fit.trials, fit.noise, strict=True):
        sizes = (trial, fit.theta, noise.intensity, noise.sensors)
        lines = fit.box.in_lines(*sizes)
        known = fit.box.run(*sizes, covariances=True).covariance
        assert known is not None
        carried = known[-1]
        for step in lines.transition[1:]:
            carried = step @ carried @ step.T
        told &= np.einsum("ij,jk,ik->i", lines.reading[-1], carried, lines.reading[-1]) < scale**2
    return [name for name, yes in zip(signals, told, strict=True) if yes]


def _square(box: GreyBox, values: np.ndarray, trial: Trial, run: Filtered, begin: int, end: int) -> np.ndarray:
    part = slice(begin, end + 1)
    substeps = int(trial.parts[part].max())
    try:
        free = box.compiled.run(trial.time[part], trial.inputs[part], values, run.mean[begin], substeps=substeps)
    except ComponentError:
        return np.full(trial.measured.shape[1], np.inf)
    squares = (free.outputs - trial.measured[part]) ** 2
    seen = np.isfinite(trial.measured[part])
    return np.sum(np.where(seen, squares, 0.0), axis=0) / np.maximum(np.count_nonzero(seen, axis=0), 1)
