"""The motion of a fitted model along inputs without their noise, near the motion that was recorded.

A low pass takes the noise of an input away, and with it some of the impulse with which a record begins. A machine that
integrates its inputs drifts from then on, by several waves of a cogging torque, say. Such a drift is what other start
values do, so these are moved until the run is again where the inputs take it without the filter.
"""

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from fmus.errors import ComponentError
from orchestrator.diagnosis.fit.evidence import LearningData, Refit
from orchestrator.diagnosis.linear.thresholds import CORRECTIONS, DEPENDENT
from orchestrator.models.estimation import STEEPEST, Record


def noise_free_motion(base: Refit, learning: LearningData, residual: np.ndarray, movable: Collection[str]) -> Refit:
    """A fitted set along the trials' inputs without their noise, as far as it shows, begun so that it stays where it was.

    The error (m,) of the set comes from that noise, too: columns along the recorded inputs would go with it by chance, most
    of all those of effects that act where an input is highest.

    Args:
        residual: errors of the set in the metric, of all trials, then of priors.
        movable: names of the states whose start values may move.
    """
    places = [i for i, state in enumerate(base.model.system.states) if state.name in movable]
    records, starts, at = [], [], 0
    pairs = zip(base.records, learning.trials, learning.metrics, base.fit.starts, strict=True)
    for record, trial, metric, start in pairs:
        rows = len(record.time) // metric.stride * len(base.model.signals)
        likely = replace(
            trial, inputs=trial.inputs - metric.input_noise(residual[at : at + rows], trial.inputs.shape[1])
        )
        noise_free = replace(record, inputs=likely.quiet_inputs)
        filtered = places and not np.array_equal(noise_free.inputs, likely.inputs)
        starts.append(
            _kept(base, replace(record, inputs=likely.inputs), noise_free, start, places) if filtered else start
        )
        records.append(noise_free)
        at += rows
    return replace(base, records=tuple(records), fit=replace(base.fit, starts=tuple(starts)))


def started_like(found: Refit, other: Refit, noise_free: Refit) -> Refit:
    """A fitted set along the noise-free inputs of another one, its start values moved as that one's are.

    Args:
        found: the fitted set.
        other: the other one, along inputs as measured.
        noise_free: the other one along its noise-free inputs.
    """
    names = [state.name for state in other.model.system.states]
    starts = []
    for start, before, after in zip(found.fit.starts, other.fit.starts, noise_free.fit.starts, strict=True):
        moved = dict(zip(names, after - before, strict=True))
        starts.append(start + np.array([moved.get(state.name, 0.0) for state in found.model.system.states]))
    records = tuple(replace(own, inputs=q.inputs) for own, q in zip(found.records, noise_free.records, strict=True))
    return replace(found, records=records, fit=replace(found.fit, starts=tuple(starts)))


def _kept(base: Refit, wanted: Record, noise_free: Record, start: np.ndarray, places: list[int]) -> np.ndarray:
    """Start values (nx,) from which the run along noise-free inputs is nearest to the one along the wanted inputs from `start`.

    They stay if a run fails, or if others bring it no nearer.
    """
    model, parameters = base.model.compiled, base.model.compiled.with_values(base.fit.values)
    try:
        there = model.run(wanted.time, wanted.inputs, parameters, start, substeps=base.substeps).outputs
        size = np.maximum(np.std(there, axis=0), np.finfo(float).tiny)
        best, least = start, np.inf
        for _ in range(CORRECTIONS + 1):
            run = model.run(
                noise_free.time, noise_free.inputs, parameters, start, substeps=base.substeps, sensitivities=True
            )
            assert run.sensitivities is not None
            off = ((run.outputs - there) / size).ravel()
            if not off @ off < least:
                break
            best, least = start, float(off @ off)
            slopes = (run.sensitivities[:, :, places] / size[:, None]).reshape(len(off), -1)
            length = np.linalg.norm(slopes, axis=0)
            length[~(length < STEEPEST) | (length == 0)] = np.inf
            change = np.linalg.lstsq(slopes / length, -off, rcond=DEPENDENT)[0] / length
            start = start.copy()
            start[places] += change
    except ComponentError:
        return best if np.isfinite(least) else start
    return best
