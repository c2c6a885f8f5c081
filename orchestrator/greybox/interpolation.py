"""What inputs did between samples: linear, held, or smooth; told by which makes the record most probable.

A filter needs no measurement at every instant, so a trial gets further instants at which nothing was measured.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from scipy.interpolate import CubicSpline

from orchestrator.greybox.filtering import Trial

Kind = Literal["linear", "hold", "smooth"]
KINDS: tuple[Kind, ...] = ("linear", "hold", "smooth")
BETWEEN = 3
JUMP = 1e-6


def with_interpolation(trial: Trial, kinds: Sequence[Kind]) -> Trial:
    """The trial with instants between its samples where its inputs (one kind each) need them."""
    if all(kind == "linear" for kind in kinds) or len(trial.time) < 4:
        return trial
    time = _instants(trial.time, "smooth" in kinds, "hold" in kinds)
    inputs = np.empty((len(time), trial.inputs.shape[1]))
    before = np.clip(np.searchsorted(trial.time, time, side="right") - 1, 0, len(trial.time) - 1)
    for i, kind in enumerate(kinds):
        series = trial.inputs[:, i]
        if kind == "hold":
            inputs[:, i] = series[before]
        elif kind == "smooth":
            inputs[:, i] = CubicSpline(trial.time, series)(time)
        else:
            inputs[:, i] = np.interp(time, trial.time, series)
    measured = np.full((len(time), trial.measured.shape[1]), np.nan)
    measured[np.searchsorted(time, trial.time)] = trial.measured
    return replace(trial, time=time, inputs=inputs, measured=measured)


def _instants(time: np.ndarray, smooth: bool, hold: bool) -> np.ndarray:
    step = np.diff(time)
    parts = [time]
    if smooth:
        parts += [time[:-1] + step * k / (BETWEEN + 1) for k in range(1, BETWEEN + 1)]
    if hold:
        parts.append(time[1:] - JUMP * step)
    return np.unique(np.concatenate(parts))
