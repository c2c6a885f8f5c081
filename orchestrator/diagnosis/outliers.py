"""Samples that a recorder got wrong, and that only a model shows: they stand out of the errors around them."""

from dataclasses import replace

import numpy as np
from scipy import ndimage

from orchestrator.diagnosis.metric import Metric
from orchestrator.models.smoothing import SmoothedTrial

# An outlier is this many standard deviations from what the errors before and after it let expect, or this many times as far
# as its neighbours, where a model is wrong.
STANDS_OUT = 6.0
NEIGHBOURS = 10
ENDS = 3
# More than this share is no accident.
MOST_SHARE = 0.02
_MEDIAN_OF_UNIT_NORMAL = 0.6744897501960817


def without_outliers(trial: SmoothedTrial, error: np.ndarray, metric: Metric) -> SmoothedTrial:
    """The trial with outlying samples put where their neighbours let expect them.

    Slow noise hides an outlier from a look at the record, but in the metric, where noise is white, a sample that is off by
    itself has a shape of its own: the column of that sample. It is fitted and taken away, the worst first.

    Args:
        error: outputs of a free run less the measured ones, (n, ny).
    """
    size, signals = metric.stride, error.shape[1]
    white = metric(error)
    shapes = metric.whitener if metric.whitener.ndim == 2 else None
    length = np.ones(len(white)) if shapes is None else np.linalg.norm(shapes, axis=0)
    unit = np.tile(metric.whitener, len(white) // signals) if shapes is None else np.ones(len(white))
    found: dict[int, float] = {}
    while True:
        heights = (white if shapes is None else shapes.T @ white) / length
        around = ndimage.median_filter(np.abs(heights.reshape(-1, signals)), size=(2 * NEIGHBOURS + 1, 1)).ravel()
        score = np.abs(heights) / np.maximum(around / _MEDIAN_OF_UNIT_NORMAL, 1.0)
        # At either end of a record only one side tells what to expect.
        score[: ENDS * signals] = score[len(score) - ENDS * signals :] = 0.0
        worst = int(np.argmax(score))
        if score[worst] < STANDS_OUT:
            break
        amount = heights[worst] / length[worst]
        white = white - amount * (np.eye(1, len(white), worst)[0] if shapes is None else shapes[:, worst])
        found[worst] = found.get(worst, 0.0) + float(amount / unit[worst])
        if len(found) > MOST_SHARE * len(white):
            return trial
    measured = trial.measured.copy()
    for place, amount in found.items():
        block, signal = divmod(place, signals)
        inside = error[block * size : (block + 1) * size, signal]
        measured[block * size + int(np.argmax(np.abs(inside - np.median(inside)))), signal] += amount * size
    return replace(trial, measured=measured) if found else trial
