"""A session of trials as a measurement set: a Parquet file for each stimulation, and the case.toml that names them."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import scipy

from hil.emulation.anatomy import anatomy
from hil.emulation.planar import Placement
from hil.emulation.settings import MUSCLES
from hil.robots.proficio import JOINTS
from hil.trials.phases import Phase
from hil.trials.protocol import Protocol
from orchestrator.results import Column, recorder_for

# The names that the arm's model has, and those of the session's signals.
_NAMES = {
    **{f"alpha_{k}": f"alpha_{k}" for k in range(1, MUSCLES + 1)},
    **{"fx": "pull1", "fy": "pull2", "q1": "arm_q1", "q2": "arm_q2"},
    **{f"{name}{k}": f"{name}{k}" for name in ("arm_w", "muscle_tau", "residual") for k in (1, 2)},
}
_WORDS = {
    axis: f"force on the wrist along {axis[1]} of the emulated arm's world, with what stands for torques that were not the muscles'"
    for axis in ("fx", "fy")
}
_FORCES, _ANGLES, _MUSCLES = (("fx", "fy"), ("q1", "q2"), ("muscle_tau1", "muscle_tau2"))
# Standard deviations of what the sensors say; an encoder's is its step by the root of 12.
_SENSORS = "[sensors]\nforce_noise_std_N = 0.3\n"


TRIAL = "trial_{:02d}.parquet"
# N.m: less than that of the muscles' torque may be missing where no push at the wrist could stand for it.
CUT = 0.05
# Sine of the elbow below which the arm is too straight for a push to do so.
STRAIGHT = 0.05
# A trial of which less than this share is left says too little.
LEAST_SHARE = 0.5


class TrialFiles:
    """Takes the rows of a session and writes each trial to a file of its own, with time from its beginning.

    Where the robot made other torques than those of the muscles, because they act a cycle late, the safety core cut
    them, or something learned was added, the difference is written as the push at the wrist that does the same to the
    arm (`pushes`): `fx`, `fy` are all that the emulated arm felt there. Angles that were not measured in a cycle are
    those of a cubic spline through all others.
    """

    def __init__(self, folder: Path, columns: Sequence[Column], protocol: Protocol, placement: Placement) -> None:
        self.folder, self.protocol, self.placement = folder, protocol, placement
        by_name = {column.name: k for k, column in enumerate(columns)}
        self._phase, self._trial, self._fresh = (by_name[name] for name in ("phase", "trial", "fresh"))
        self._took = by_name["took"]
        self._passed = [by_name[f"passed{k + 1}"] for k in range(JOINTS)]
        self._places = [by_name[source] for source in _NAMES.values()]
        self._columns = [
            Column(name, columns[k].unit, description=_WORDS.get(name, columns[k].description))
            for name, k in zip(_NAMES, self._places, strict=True)
        ]
        self._times: dict[int, list[np.ndarray]] = {}
        self._rows: dict[int, list[np.ndarray]] = {}

    def rows(self, times: np.ndarray, values: np.ndarray) -> None:
        """Take times (n,) in s and rows (n, columns)."""
        stimulated = values[:, self._phase] == Phase.STIMULATE
        for trial in np.unique(values[stimulated, self._trial]):
            chosen = stimulated & (values[:, self._trial] == trial)
            self._times.setdefault(int(trial), []).append(times[chosen])
            self._rows.setdefault(int(trial), []).append(values[chosen])

    def finish(self) -> str:
        """Write the files; returns the text of the case.toml, "" if no trial was finished."""
        names = []
        for trial, parts in sorted(self._rows.items()):
            times, rows = self._trial_rows(np.concatenate(self._times[trial]), np.concatenate(parts))
            if len(times) < 2 or times[-1] < LEAST_SHARE * self.protocol.stimulate_s:
                continue
            names.append(TRIAL.format(trial))
            recorder = recorder_for(self.folder / names[-1])
            recorder.begin(self._columns, {"trial": trial})
            recorder.rows(times, rows)
            recorder.finish()
        return self._case(names) if names else ""

    def _trial_rows(self, times: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Times (m,) in s from 0 and rows of the trial's file, from those of the session (n >= m)."""
        rows, fresh = values[:, self._places], values[:, self._fresh] != 0
        angles, forces, muscles = (_places_of(names) for names in (_ANGLES, _FORCES, _MUSCLES))
        if np.count_nonzero(fresh) < 2:
            return times[:0], rows[:0]
        rows[:, angles] = _filled(times, rows[:, angles], fresh)
        made = np.array([self.placement.speeds(passed) for passed in values[:, self._passed]])
        beyond = acted(middles(times), times, made, values[:, self._took]) - rows[:, muscles]
        rows[:, forces] += pushes(rows[:, angles], beyond)
        known = np.all(np.isfinite(rows[:, forces]), axis=1)
        count = len(known) if known.all() else int(np.argmin(known))
        return times[:count] - times[0], rows[:count]

    def _case(self, names: list[str]) -> str:
        kept = len(names) - int(round(self.protocol.held_out * len(names))) if len(names) > 1 else 1
        split = f"learning = {list(range(1, kept + 1))}\n"
        if kept < len(names):
            split += f"held_out = {list(range(kept + 1, len(names) + 1))}\n"
        units = "\n".join(f"{json.dumps(column.name)} = {json.dumps(column.unit)}" for column in self._columns)
        return f'files = {json.dumps(names)}\nframe = "arm"\nunits_certain = true\n{split}\n[columns]\ntime = "s"\n{units}\n\n{_SENSORS}'


def pushes(angles: np.ndarray, torques: np.ndarray) -> np.ndarray:
    """The forces (n, 2) in N on the wrist, in the arm's world, that do what torques (n, 2) in N.m at its joints do.

    f = J(q)^-T tau, at angles (n, 2) in rad. Not a number where the arm is too straight for such a force and there is
    more than `CUT` of a torque; zero where there is less.
    """
    found = np.zeros_like(torques)
    for k in np.flatnonzero(np.any(torques != 0.0, axis=1)):
        if abs(np.sin(angles[k, 1])) > STRAIGHT:
            found[k] = np.linalg.solve(anatomy().jacobian(angles[k]).T, torques[k])
        elif np.max(np.abs(torques[k])) > CUT:
            found[k] = np.nan
    return found


def acted(edges: np.ndarray, times: np.ndarray, torques: np.ndarray, took: np.ndarray) -> np.ndarray:
    """Mean torques (m, joints) in N.m between edges (m + 1,) in s.

    Torques (n, joints) were sent `took` s (n,) after the cycles' `times` (n,) and act until the next ones; nobody knows
    those before the first, which count as it.
    """
    sent = times + took
    knots = np.concatenate([[min(edges[0], sent[0])], sent, [max(edges[-1], sent[-1])]])
    impulses = np.cumsum(np.vstack([torques[:1], torques]) * np.diff(knots)[:, None], axis=0)
    impulses = np.vstack([np.zeros(torques.shape[1]), impulses])
    until = np.column_stack([np.interp(edges, knots, column) for column in impulses.T])
    return np.asarray(np.diff(until, axis=0) / np.diff(edges)[:, None])


def middles(times: np.ndarray) -> np.ndarray:
    """The n + 1 times (s) half-way between n times, and as far before the first and after the last as those beside them."""
    between = 0.5 * (times[1:] + times[:-1])
    return np.concatenate([[2.0 * times[0] - between[0]], between, [2.0 * times[-1] - between[-1]]])


def _filled(times: np.ndarray, angles: np.ndarray, fresh: np.ndarray) -> np.ndarray:
    """The angles (n, 2) in rad, with others where they were not measured: before the first that was they are as that,
    as after the last."""
    within = np.clip(times[~fresh], times[fresh][0], times[fresh][-1])
    angles[~fresh] = scipy.interpolate.CubicSpline(times[fresh], angles[fresh])(within)
    return angles


def _places_of(names: tuple[str, str]) -> list[int]:
    return [list(_NAMES).index(name) for name in names]
