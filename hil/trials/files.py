"""A session of trials as a measurement set: a Parquet file for each stimulation, and the case.toml that names them."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hil.emulation.planar import PLANE
from hil.emulation.settings import MUSCLES
from hil.trials.phases import Phase
from hil.trials.protocol import Protocol
from orchestrator.cosim.results import Column, recorder_for

# The names that the arm's model has, and those of the session's signals.
_NAMES = {
    **{f"alpha_{k}": f"alpha_{k}" for k in range(1, MUSCLES + 1)},
    **{"fx": "pull1", "fy": "pull2", "q1": "arm_q1", "q2": "arm_q2"},
    **{f"{name}{k}": f"{name}{k}" for name in ("arm_w", "muscle_tau", "residual") for k in (1, 2)},
}
# Standard deviations of what the sensors say; an encoder's is its step by the root of 12.
_SENSORS = "[sensors]\nforce_noise_std_N = 0.3\n"


TRIAL = "trial_{:02d}.parquet"
# N.m: beyond it the core has cut what the muscles asked for, and the robot is the emulated arm no longer.
CUT = 0.05
# A trial of which less than this share is left says too little.
LEAST_SHARE = 0.5


class TrialFiles:
    """Takes the rows of a session and writes each trial to a file of its own, with time from its beginning.

    A file ends where the safety core first cut the torques of the muscles.
    """

    def __init__(self, folder: Path, columns: Sequence[Column], protocol: Protocol) -> None:
        self.folder, self.protocol = folder, protocol
        by_name = {column.name: k for k, column in enumerate(columns)}
        self._phase, self._trial = by_name["phase"], by_name["trial"]
        self._sent, self._asked = ([by_name[f"{name}{k + 1}"] for k in PLANE] for name in ("tau", "asked"))
        self._places = [by_name[source] for source in _NAMES.values()]
        self._columns = [
            Column(name, columns[k].unit, description=columns[k].description)
            for name, k in zip(_NAMES, self._places, strict=True)
        ]
        self._times: dict[int, list[np.ndarray]] = {}
        self._rows: dict[int, list[np.ndarray]] = {}
        self._whole: dict[int, list[np.ndarray]] = {}

    def rows(self, times: np.ndarray, values: np.ndarray) -> None:
        """Take times (n,) in s and rows (n, columns)."""
        stimulated = values[:, self._phase] == Phase.STIMULATE
        for trial in np.unique(values[stimulated, self._trial]):
            chosen = stimulated & (values[:, self._trial] == trial)
            self._times.setdefault(int(trial), []).append(times[chosen])
            self._rows.setdefault(int(trial), []).append(values[chosen][:, self._places])
            difference = values[chosen][:, self._sent] - values[chosen][:, self._asked]
            self._whole.setdefault(int(trial), []).append(np.all(np.abs(difference) <= CUT, axis=1))

    def finish(self) -> str:
        """Write the files; returns the text of the case.toml, "" if no trial was finished."""
        names = []
        for trial, parts in sorted(self._rows.items()):
            times, rows = np.concatenate(self._times[trial]), np.concatenate(parts)
            whole = np.concatenate(self._whole[trial])
            count = len(whole) if whole.all() else int(np.argmin(whole))
            if count < 2 or times[count - 1] - times[0] < LEAST_SHARE * self.protocol.stimulate_s:
                continue
            names.append(TRIAL.format(trial))
            recorder = recorder_for(self.folder / names[-1])
            recorder.begin(self._columns, {"trial": trial})
            recorder.rows(times[:count] - times[0], rows[:count])
            recorder.finish()
        return self._case(names) if names else ""

    def _case(self, names: list[str]) -> str:
        kept = len(names) - int(round(self.protocol.held_out * len(names))) if len(names) > 1 else 1
        split = f"learning = {list(range(1, kept + 1))}\n"
        if kept < len(names):
            split += f"held_out = {list(range(kept + 1, len(names) + 1))}\n"
        units = "\n".join(f"{json.dumps(column.name)} = {json.dumps(column.unit)}" for column in self._columns)
        return f'files = {json.dumps(names)}\n{split}\n[columns]\ntime = "s"\n{units}\n\n{_SENSORS}'
