"""Sensors that stick or saturate, seen from their records alone."""

from collections.abc import Iterator

import numpy as np

from orchestrator.datacheck import limits
from orchestrator.datacheck.findings import Finding
from orchestrator.measurements.trial import Array, Trial


def sensor_findings(trial: Trial, column: str, variable: str, others: list[Array]) -> Iterator[Finding]:
    """What is wrong with a measured output in a trial; `others` are the other columns of the trial that matter."""
    values = trial.columns[column]
    if len(values) < 2 * limits.STUCK_SAMPLES or np.ptp(values) == 0.0:
        return
    steps = np.abs(np.diff(values))
    runs = _runs(values)
    saturated = list(_saturated(trial, variable, values, steps, runs))
    yield from saturated or _stuck(trial, variable, values, steps, runs, others)


def _runs(values: Array) -> np.ndarray:
    """Runs of equal values as rows (first, one past the last)."""
    edges = np.flatnonzero(np.diff(values) != 0.0) + 1
    return np.column_stack([np.r_[0, edges], np.r_[edges, len(values)]])


def _stuck(
    trial: Trial, variable: str, values: Array, steps: Array, runs: np.ndarray, others: list[Array]
) -> Iterator[Finding]:
    """The longest run that a signal came to at speed, or left with a jump, while something else moved.

    A machine at rest comes to it slowly and leaves it slowly; and with a sensor that shows noise, no value is repeated.
    """
    lengths = runs[:, 1] - runs[:, 0]
    k = int(np.argmax(lengths))
    first, last = (int(edge) for edge in runs[k])
    if lengths[k] < max(limits.STUCK_SAMPLES, limits.STUCK_SHARE * len(values)):
        return
    moving = steps[steps > 0.0]
    usual, most = float(np.median(moving)), float(np.quantile(moving, 0.99))
    before = float(np.mean(steps[max(0, first - 4) : first - 1])) if first > 4 else 0.0
    jump = float(steps[last - 1]) if last < len(values) else 0.0
    if not (
        jump > limits.STUCK_JUMP * most
        or (before > limits.STUCK_STOP * usual and jump >= before)
        or (before > limits.STUCK_STOP * usual and last == len(values))
    ):
        return
    if others and not any(np.ptp(each[first:last]) > 0.05 * np.ptp(each) for each in others if np.ptp(each) > 0):
        return
    evidence = (
        f"{variable} stays at {values[first]:.6g} from {trial.time[first]:.4g} to {trial.time[last - 1]:.4g} s ({lengths[k]}"
        f" samples), to which it came with steps of {before:.3g} and which it left with one of {jump:.3g} (usual: {usual:.3g})"
    )
    strong = trial.subset == "learning"
    if values[first] in (values.max(), values.min()):
        yield Finding(
            "saturated", variable, trial.name, evidence, _wider(variable), strong=strong, trials=(trial.name,)
        )
        return
    early = first > len(values) - last
    keep = (trial.time[0], trial.time[first - 1]) if early else (trial.time[last], trial.time[-1])
    yield Finding(
        "stuck",
        variable,
        trial.name,
        evidence,
        f"use {keep[0]:.4g} to {keep[1]:.4g} s of this trial alone",
        strong=strong,
        trials=(trial.name,),
        keep=(float(keep[0]), float(keep[1])),
    )


def _wider(variable: str) -> str:
    return f"measure {variable} again with a wider range, or leave those trials out"


def _saturated(trial: Trial, variable: str, values: Array, steps: Array, runs: np.ndarray) -> Iterator[Finding]:
    """Flat tops or bottoms, which a signal runs into and leaves at speed; a machine at a stop leaves it slowly."""
    digit = float(steps[steps > 0.0].min())
    for name, limit in (("greatest", values.max()), ("least", values.min())):
        flat = [
            (int(a), int(b))
            for a, b in runs
            if values[a] == limit
            and b - a >= 3
            and a > 1
            and b < len(values) - 1
            and min(steps[a - 2], steps[b]) > limits.SATURATED_SPEED * digit
            and min(steps[a - 2], steps[b]) > limits.SATURATED_ALIKE * max(steps[a - 2], steps[b])
        ]
        count = sum(b - a for a, b in flat)
        if len(flat) < 2 or count < limits.SATURATED_SHARE * len(values):
            continue
        yield Finding(
            "saturated",
            variable,
            trial.name,
            f"{variable} is at its {name} value, {limit:.6g}, in {count} samples of {len(flat)} flat stretches, which it runs"
            " into and leaves at speed",
            _wider(variable),
            strong=trial.subset == "learning",
            trials=(trial.name,),
        )
