"""What the Gaussian-process block takes off the error of a recorded session of trials, on the trials it has not seen."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

from hil.emulation.anatomy import anatomy
from hil.emulation.corrections import Corrections
from hil.emulation.muscles import Muscles
from hil.emulation.residual import Residual
from hil.emulation.settings import Learning

WINDOW_S = 0.1
# The model starts anew from what was measured so often.
AHEAD_S = 0.25


@dataclass(frozen=True)
class Recorded:
    """One trial by its samples: times (n,), the rest (n, 2) but for activations (n, 6)."""

    times: np.ndarray
    activations: np.ndarray
    q: np.ndarray
    w: np.ndarray
    pull: np.ndarray
    muscles: np.ndarray


def read_trials(folder: Path) -> list[Recorded]:
    """All trials of a session."""
    found = []
    for path in sorted(folder.glob("trial_*.parquet")):
        table = pq.read_table(path)

        def columns(*names: str, table=table) -> np.ndarray:  # type: ignore[no-untyped-def]
            return np.column_stack([table[name].to_numpy() for name in names])

        found.append(
            Recorded(
                table["time"].to_numpy(),
                columns(*(f"alpha_{k}" for k in range(1, 7))),
                columns("q1", "q2"),
                columns("arm_w1", "arm_w2"),
                columns("fx", "fy"),
                columns("muscle_tau1", "muscle_tau2"),
            )
        )
    return found


def learned_from(trials: list[Recorded]) -> Corrections:
    """A block that has learned from trials, moment by moment, as it does during a session."""
    learning = Learning(budget=200)
    corrections, residual = Corrections(learning), Residual(anatomy(), learning)
    for trial in trials:
        residual.forget()
        for k in range(1, len(trial.times)):
            step = trial.times[k] - trial.times[k - 1]
            residual.advance(trial.q[k], trial.w[k], trial.muscles[k - 1], trial.pull[k], step)
            corrections.advance(residual, trial.q[k], step, learn=True)
        corrections.advance(residual, trial.q[-1], 0.0, learn=False)
    return corrections


def missing_torque(trials: list[Recorded], corrections: Corrections) -> tuple[np.ndarray, np.ndarray]:
    """RMS (2,) in N.m of the torque that windows of trials show to be missing, and of it less what is predicted.

    The mean over a window is (p1 - p0 - integral of the expected rate)/T, with the momentum p = M w.
    """
    body, before, after = anatomy(), [], []
    for trial in trials:
        size = round(WINDOW_S / float(np.median(np.diff(trial.times))))
        for begin in range(0, len(trial.times) - size - 1, size):
            inside = range(begin + 1, begin + size + 1)
            steps = np.diff(trial.times[begin : begin + size + 1])
            expected = [
                body.expected_rate(trial.q[k], trial.w[k], _torque(trial, k, trial.muscles[k - 1])) for k in inside
            ]
            ends = [body.mass_matrix(trial.q[k]) @ trial.w[k] for k in (begin, begin + size)]
            shown = (ends[1] - ends[0] - steps @ np.array(expected)) / steps.sum()
            here = slice(begin + 1, begin + size + 1)
            before.append(shown)
            after.append(shown - corrections.predict(trial.q[here].mean(axis=0), trial.w[here].mean(axis=0)))
    return np.sqrt(np.mean(np.square(before), axis=0)), np.sqrt(np.mean(np.square(after), axis=0))


def _torque(trial: Recorded, k: int, muscles: np.ndarray) -> np.ndarray:
    """Torques (2,) in N.m of muscles and of the push at the wrist at a sample."""
    return np.asarray(muscles + anatomy().jacobian(trial.q[k]).T @ trial.pull[k])


def error_ahead(trials: list[Recorded], corrections: Corrections | None) -> np.ndarray:
    """RMS (2,) in rad of angles a quarter of a second after the model began at what was measured, with the block or without.

    Semi-implicit Euler with the recorded steps; forces and activations are those of the record.
    """
    body, muscles = anatomy(), Muscles(anatomy())
    errors = []
    for trial in trials:
        size = round(AHEAD_S / float(np.median(np.diff(trial.times))))
        for k in range(1, len(trial.times)):
            if k % size == 1:
                q, w = trial.q[k - 1].copy(), trial.w[k - 1].copy()
            torque = muscles.torques(trial.activations[k - 1], q, w)
            if corrections is not None:
                torque = torque + corrections.predict(q, w)
            mass = body.mass_matrix(q)
            # d(M w)/dt is known; M a = d(M w)/dt - (dM/dt) w.
            turning = -2 * body.mass[1] * body.length[0] * body.centre[1] * np.sin(q[1]) * w[1]
            slope = turning * np.array([[1.0, 0.5], [0.5, 0.0]])
            rate = body.expected_rate(q, w, torque + body.jacobian(q).T @ trial.pull[k - 1]) - slope @ w
            step = trial.times[k] - trial.times[k - 1]
            w = w + step * np.linalg.solve(mass, rate)
            q = q + step * w
            if k % size == 0:
                errors.append(q - trial.q[k])
    return np.sqrt(np.mean(np.square(errors), axis=0))
