"""Samples that a recorder got wrong, and that only a model shows: they stand out of the errors around them."""

from dataclasses import replace

import numpy as np
import scipy

from orchestrator.diagnosis.noise.metric import Metric
from orchestrator.diagnosis.noise.thresholds import ALONE, ENDS, MOST_SHARE, NEIGHBOURS, STANDS_OUT
from orchestrator.models.smoothing import SmoothedTrial

_MEDIAN_OF_UNIT_NORMAL = 0.6744897501960817


def without_outliers(trial: SmoothedTrial, error: np.ndarray, metric: Metric) -> SmoothedTrial:
    """The trial with outlying samples put where their neighbours let expect them.

    Slow noise hides an outlier from a look at the record, but in the metric, where noise is white, a sample that is off by
    itself has a shape of its own: the column of that sample. It is fitted and taken away, the worst first, if the recorded
    sample bears it out.

    Args:
        error: outputs of a free run less the measured ones, (n, ny).
    """
    size, signals = metric.stride, error.shape[1]
    white = metric(error)
    shapes = metric.whitener if metric.whitener.ndim == 2 else None
    length = np.ones(len(white)) if shapes is None else np.linalg.norm(shapes, axis=0)
    unit = np.tile(metric.whitener, len(white) // signals) if shapes is None else np.ones(len(white))
    found, left, smooth = set[int](), error.copy(), list[int]()
    while True:
        heights = (white if shapes is None else shapes.T @ white) / length
        around = scipy.ndimage.median_filter(np.abs(heights.reshape(-1, signals)), size=(2 * NEIGHBOURS + 1, 1)).ravel()
        score = np.abs(heights) / np.maximum(around / _MEDIAN_OF_UNIT_NORMAL, 1.0)
        # At either end of a record only one side tells what to expect.
        score[: ENDS * signals] = score[len(score) - ENDS * signals :] = 0.0
        score[smooth] = 0.0
        worst = int(np.argmax(score))
        if score[worst] < STANDS_OUT:
            break
        amount = heights[worst] / length[worst]
        off = float(amount / unit[worst]) * size
        place = _place(left, worst, size)
        if _alone(left[:, worst % signals], place) * np.sign(off) < ALONE * abs(off):
            smooth.append(worst)
            continue
        left[place, worst % signals] -= off
        white = white - amount * (np.eye(1, len(white), worst)[0] if shapes is None else shapes[:, worst])
        found.add(worst)
        if len(found) > MOST_SHARE * len(white):
            return trial
    return replace(trial, measured=trial.measured + (error - left)) if found else trial


def _place(error: np.ndarray, row: int, size: int) -> int:
    """The sample that stands out the most among the `size` ones of a row of the metric, of errors (n, ny)."""
    block, signal = divmod(row, error.shape[1])
    off = [abs(_alone(error[:, signal], k)) for k in range(block * size, (block + 1) * size)]
    return block * size + int(np.argmax(off))


def _alone(series: np.ndarray, place: int) -> float:
    """By how much a sample of a series (n,) is off by itself.

    A sample that is off by `a` is off from the middle of its neighbours by `a`, and puts each of them off by half of
    that to the other side; where a series bends, the neighbours are not.
    """
    around = series[np.clip(np.arange(place - 2, place + 3), 0, len(series) - 1)]
    before, here, after = around[1:-1] - 0.5 * (around[:-2] + around[2:])
    return float(min(here, -(before + after), key=abs)) if here * (before + after) < 0 else 0.0
