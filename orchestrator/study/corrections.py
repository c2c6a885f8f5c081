"""Corrections: states and forces averaged over half a second, with what a bench can see of how they came about."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orchestrator.study.design import POSITIONS, WINDOW_S, Caregiver, Trial
from orchestrator.study.muscles import at_wrist, jacobian, moving_torques, perfect
from orchestrator.study.trials import STEP_S, STOPS, run_trial

Array = NDArray[Any]
SENSOR_N = 0.3


@dataclass(frozen=True, eq=False)
class Corrections:
    """Averages over windows: state (n, 4), force (n, 2), activation (n, 6), and the force less what motion took, (n, 2).

    Seen by encoders: `moved` (n,) largest way of a joint within the window in rad, `at_stop` (n,) whether one touched an
    end. `goal` (n, 4) is the posture to hold, at rest. `trial` (n,) and `caregiver` (n,) are numbers from 0.
    """

    state: Array
    force: Array
    activation: Array
    steady: Array
    moved: Array
    at_stop: Array
    goal: Array
    trial: Array
    caregiver: Array

    def __len__(self) -> int:
        return len(self.state)

    def rows(self, chosen: Array) -> "Corrections":
        """Some of them, by number or by a mask."""
        return Corrections(**{name: column[chosen] for name, column in vars(self).items()})

    def compensated(self) -> "Corrections":
        """The same with the force that motion took subtracted."""
        return replace(self, force=self.steady)

    @property
    def required(self) -> Array:
        """Perfect corrections at the states where the arm was, (n, 2)."""
        return perfect(self.state, self.activation)


def collect(seed: int, trials: Sequence[Trial], people: Sequence[Caregiver]) -> Corrections:
    """Run all trials and average them.

    Args:
        seed: of the sensor's noise.
        trials: the trials.
        people: the caregivers, by their number in the trials.
    """
    return joined([averaged(run_trial(trial, people[trial.caregiver]), trial, seed) for trial in trials])


def averaged(record: Array, trial: Trial, seed: int) -> Corrections:
    """The four corrections of a trial's record, (n, 6) as of `run_trial`; the force sensor adds its noise.

    Args:
        record: of the trial, every step.
        trial: the trial.
        seed: of the sensor's noise.
    """
    rng = np.random.default_rng([seed, 3, trial.number])
    length = round(WINDOW_S / STEP_S)
    count = (len(record) - 1) // length
    windows = record[1:].reshape(count, length, record.shape[1])
    before = record[:-1].reshape(windows.shape)
    noise = SENSOR_N * rng.standard_normal((count, 2))
    state, force = windows[:, :, :4].mean(axis=1), windows[:, :, 4:].mean(axis=1) + noise
    angles = windows[:, :, :2]
    beyond = (angles < STOPS[0]) | (angles > STOPS[1])
    goal = np.array([*POSITIONS[trial.position], 0.0, 0.0])
    return Corrections(
        state=state,
        force=force,
        activation=np.tile(trial.activation, (count, 1)),
        steady=_steady(windows, before, state) + noise,
        moved=np.ptp(angles, axis=1).max(axis=1),
        at_stop=beyond.any(axis=(1, 2)),
        goal=np.tile(goal, (count, 1)),
        trial=np.full(count, trial.number),
        caregiver=np.full(count, trial.caregiver),
    )


def _steady(windows: Array, before: Array, state: Array) -> Array:
    """The mean joint torque of the hand less that of motion, as a force at the mean posture, (windows, 2)."""
    middle = 0.5 * (windows + before)
    acceleration = (windows[:, :, 2:4] - before[:, :, 2:4]) / STEP_S
    torque = still_torques(middle.reshape(-1, middle.shape[2]), acceleration.reshape(-1, 2))
    return at_wrist(state[:, :2], torque.reshape(*middle.shape[:2], 2).mean(axis=1))


def still_torques(record: Array, acceleration: Array) -> Array:
    """Joint torques of the hand less those of motion, (n, 2), of rows q1, q2, w1, w2, fx, fy and accelerations (n, 2)."""
    hand = np.einsum("nij,ni->nj", jacobian(record[:, :2]), record[:, 4:])
    return hand - moving_torques(record[:, :4], acceleration)


def joined(parts: Sequence[Corrections]) -> Corrections:
    """Corrections below each other."""
    return Corrections(**{name: np.concatenate([vars(part)[name] for part in parts]) for name in vars(parts[0])})
