"""Flexible forces: smooth functions of position, speed, inputs and time, for what no card of the library describes."""

from collections.abc import Sequence

import numpy as np
import scipy

from orchestrator.diagnosis.linear.response import SimulatedTrial
from orchestrator.diagnosis.linear.thresholds import AT_REST, POSITION_KNOTS, SPEED_KNOTS, TIME_KNOTS


def flexible_forces(trials: Sequence[SimulatedTrial]) -> list[np.ndarray]:
    """Force histories of each trial, (n, ny, k) with the same k for all; each acts on one correction input.

    For output i they are cubic splines of its position and of its speed, products of positions and speeds of all
    outputs, splines of time, and inputs by themselves and times the position; and forces of the sign of its speed, steady,
    times position, its square, time, or the speed of another output: friction that depends on where, when, or on what else.
    """
    ny = trials[0].values.shape[1]
    ranges = [_range([t.values for t in trials]), _range([t.speeds for t in trials])]
    alive = np.flatnonzero(np.ptp(np.concatenate([t.inputs for t in trials]), axis=0) > 0)
    found = []
    for trial in trials:
        columns = [column for i in range(ny) for column in _of_output(trial, i, ranges, alive)]
        forces = np.zeros((len(trial.time), ny, len(columns)))
        for k, column in enumerate(columns):
            forces[:, k // (len(columns) // ny), k] = column
        found.append(forces)
    return found


def _of_output(trial: SimulatedTrial, i: int, ranges: Sequence[np.ndarray], alive: np.ndarray) -> list[np.ndarray]:
    q, v = (2 * (x - r[0]) / (r[1] - r[0]) - 1 for x, r in zip((trial.values, trial.speeds), ranges, strict=True))
    s = np.linspace(-1, 1, len(trial.time))
    u = trial.inputs[:, alive]
    splines = [*_splines(q[:, i], POSITION_KNOTS), *_splines(v[:, i], SPEED_KNOTS), *_splines(s, TIME_KNOTS)]
    pairs = [a * b for a, b in _pairs(q, v, i)]
    return [*splines, *pairs, *u.T, *(u * q[:, [i]]).T, *_dry(trial, i, q, s)]


def _dry(trial: SimulatedTrial, i: int, q: np.ndarray, s: np.ndarray) -> list[np.ndarray]:
    """Friction against the motion of output i, of a size that changes; its sign is blurred near rest."""
    speeds = trial.speeds
    rest = AT_REST * max(float(np.sqrt(np.mean(speeds[:, i] ** 2))), 1e-300)
    sign = np.tanh(speeds[:, i] / rest)
    others = [
        np.abs(speeds[:, j]) / max(float(np.abs(speeds[:, j]).max()), 1e-300) for j in range(q.shape[1]) if j != i
    ]
    return [sign * size for size in (np.ones_like(s), q[:, i], q[:, i] ** 2, s, *others)]


def _pairs(q: np.ndarray, v: np.ndarray, i: int) -> list[tuple[np.ndarray, np.ndarray]]:
    others = [j for j in range(q.shape[1]) if j != i]
    own = [(q[:, i], v[:, i])]
    return own + [pair for j in others for pair in ((q[:, j], q[:, i]), (v[:, j], v[:, i]), (q[:, j], v[:, i]))]


def _splines(x: np.ndarray, count: int) -> list[np.ndarray]:
    """Cubic B-splines over [-1, 1]."""
    knots = np.r_[[-1.0] * 3, np.linspace(-1, 1, count - 2), [1.0] * 3]
    return list(scipy.interpolate.BSpline.design_matrix(np.clip(x, -1, 1), knots, 3).toarray().T)


def _range(per_trial: Sequence[np.ndarray]) -> np.ndarray:
    joined = np.concatenate(per_trial)
    low, high = joined.min(axis=0), joined.max(axis=0)
    return np.array([low, np.where(high > low, high, low + 1.0)])
