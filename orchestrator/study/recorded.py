"""The study with corrections that a bench session measured: `misfit hil record` through the bus, on a virtual robot or a real one."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmus.errors import MisfitError
from orchestrator.measurements import Trial, load_measurements
from orchestrator.study.corrections import Corrections, joined, still_torques
from orchestrator.study.design import WINDOW_S
from orchestrator.study.initial import initial_models
from orchestrator.study.muscles import MUSCLES, PHYSIOLOGICAL, STRONG, at_wrist
from orchestrator.study.researcher import SETS, measure
from orchestrator.study.trials import STOPS
from orchestrator.study.variants import LEARNERS, Outcome, Setting, outcome

Array = NDArray[Any]
# What a session writes of the emulated arm: angles, speeds, all that pushes at the wrist; activations.
_STATE = ("q1", "q2", "arm_w1", "arm_w2", "fx", "fy")
_ACTIVATIONS = tuple(f"alpha_{k}" for k in range(1, len(MUSCLES) + 1))
_LEAST_ROWS = 20
Say = Callable[[str], None]


def recorded_corrections(folders: Sequence[str]) -> Corrections:
    """Averages over windows of all trials of some sessions, each session a caregiver.

    Raises:
        MisfitError: if a folder is no recording of trials.
    """
    parts: list[Corrections] = []
    for person, folder in enumerate(folders):
        for trial in load_measurements(Path(folder)).trials:
            parts.append(_of_trial(trial, len(parts), person, folder))
    return joined([part for part in parts if len(part)])


def _of_trial(trial: Trial, number: int, person: int, folder: str) -> Corrections:
    missing = [name for name in (*_STATE, *_ACTIVATIONS) if name not in trial.columns]
    if missing:
        raise MisfitError(
            f"{folder}: {trial.name} has no column {missing[0]}; expected a recording of misfit hil record"
        )
    record, activations = (np.column_stack([trial.columns[name] for name in names]) for names in (_STATE, _ACTIVATIONS))
    acceleration = np.gradient(record[:, 2:4], trial.time, axis=0)
    torque = still_torques(record, acceleration)
    window = np.floor((trial.time - trial.time[0]) / WINDOW_S)
    rows = [part for k in np.unique(window) if (part := window == k).sum() >= _LEAST_ROWS]
    state = _means(record, rows)
    beyond = (record[:, :2] < STOPS[0]) | (record[:, :2] > STOPS[1])
    count = len(rows)
    return Corrections(
        state=state[:, :4],
        force=state[:, 4:],
        activation=_means(activations, rows),
        steady=at_wrist(state[:, :2], _means(torque, rows)),
        moved=np.array([np.ptp(record[part, :2], axis=0).max() for part in rows]),
        at_stop=np.array([bool(beyond[part].any()) for part in rows], dtype=bool),
        goal=np.tile([*record[0, :2], 0.0, 0.0], (count, 1)),
        trial=np.full(count, number),
        caregiver=np.full(count, person),
    )


def _means(table: Array, rows: Sequence[Array]) -> Array:
    return np.array([table[part].mean(axis=0) for part in rows]).reshape(len(rows), table.shape[1])


def study_of(folders: Sequence[str], seed: int, say: Say) -> dict[str, Any]:
    """What models of the arm that the bench emulates learn from recorded corrections, in every way to learn.

    The initial models are those of a careful researcher's few holds (`measure`), drawn with `seed`.

    Args:
        folders: recorded sessions.
        seed: of the initial models.
        say: called with one line at each stage.

    Returns:
        The JSON document: improvements in % of the error over the grid, by way to learn and muscle.
    """
    say("reading recorded sessions")
    seen = recorded_corrections(folders)
    bench = measure(seed, SETS["small"], PHYSIOLOGICAL)
    say("fitting initial models")
    blind = {name: each.without_velocity() for name, each in bench.items()}
    setting = Setting(initial_models(bench, PHYSIOLOGICAL), initial_models(blind, PHYSIOLOGICAL), seen)
    ways = {}
    for name in LEARNERS:
        say(f"learning: {name}")
        ways[name] = _told(outcome(name, setting))
    return {
        "schema": "misfit.study/1",
        "recorded": [str(folder) for folder in folders],
        "arm": PHYSIOLOGICAL.name,
        "seed": seed,
        "corrections": len(seen),
        "before_N": dict(zip(MUSCLES, map(float, setting.given.before), strict=True)),
        "ways": ways,
    }


def _told(found: Outcome) -> dict[str, Any]:
    gains = 100.0 * found.improvement
    return {
        "improvement": dict(zip(MUSCLES, map(float, gains), strict=True)),
        "strong_four": float(gains[list(STRONG)].mean()),
        "used": found.used,
        "coverage_90": found.coverage,
    }


def rows_of(document: Mapping[str, Any]) -> list[tuple[str, ...]]:
    """A line for each way to learn: its name, how many corrections it used, the improvement of each muscle, intervals that hold."""
    return [
        (
            name,
            str(way["used"]),
            *(f"{way['improvement'][muscle]:.0f}" for muscle in MUSCLES),
            "" if way["coverage_90"] is None else f"{100.0 * way['coverage_90']:.0f}",
        )
        for name, way in document["ways"].items()
    ]
