"""First phases of oscillations: what each trial shows of sine and cosine, to first order.

A fit that begins with the wrong phase in several trials does best at first by making the amplitude small, and ends there.
"""

from collections.abc import Callable, Sequence

import numpy as np

from fmus.errors import ComponentError
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.canonical import Oscillation, oscillations
from orchestrator.diagnosis.fit.thresholds import MOST_GROWTH
from orchestrator.models.compiled import CompiledModel
from orchestrator.models.estimation import STEEPEST, Record, Reduce

# Error (m,) of a trial from given start values.
Error = Callable[[np.ndarray], np.ndarray]


def with_phases(
    places: Sequence[Oscillation],
    guess: np.ndarray,
    starts: Sequence[np.ndarray],
    errors: Sequence[Error],
    beside: Sequence[np.ndarray],
) -> tuple[np.ndarray, list[np.ndarray]]:
    """First values of a set and start values of each trial, with the amplitudes and phases that the trials show.

    Args:
        guess: first values (k,) of the parameters, whose amplitudes say how joints share the oscillation.
        starts: start values (nx,) of each trial.
        errors: the error of each trial as a function of its start values, at `guess`.
        beside: columns (m, j) of what else a fit will move in each trial.
    """
    first, begun = guess.copy(), [start.copy() for start in starts]
    for oscillation in places:
        found = [_shown(*trial, oscillation) for trial in zip(begun, errors, beside, strict=True)]
        sizes = np.array([np.hypot(*part) for part in found])
        size = float(np.sqrt(np.mean(sizes**2)))
        if not (np.isfinite(size) and size > 0):
            continue
        first[list(oscillation.amplitudes)] *= np.clip(size, 1 / MOST_GROWTH, MOST_GROWTH)
        for start, part, own in zip(begun, found, sizes, strict=True):
            if own > 0:
                start[list(oscillation.phase)] = part / own
    return first, begun


def _shown(start: np.ndarray, error: Error, beside: np.ndarray, oscillation: Oscillation) -> np.ndarray:
    """Sine and cosine of the phase (2,), times the share of the amplitude, that a trial shows; zeros if it cannot be run."""
    try:
        ahead, back, quarter = (error(_at(start, oscillation, phase)) for phase in ((0, 1), (0, -1), (1, 0)))
    except ComponentError:
        return np.zeros(2)
    middle = 0.5 * (ahead + back)
    columns = np.column_stack([quarter - middle, 0.5 * (ahead - back), beside])
    if not np.all(np.abs(columns) < STEEPEST):
        return np.zeros(2)
    return np.asarray(np.linalg.lstsq(columns, -middle, rcond=1e-10)[0][:2])


def _at(start: np.ndarray, oscillation: Oscillation, phase: tuple[int, int]) -> np.ndarray:
    turned = start.copy()
    turned[list(oscillation.phase)] = phase
    return turned


def phases_of_runs(
    effects: EffectSet,
    model: CompiledModel,
    records: Sequence[Record],
    reduce: Sequence[Reduce],
    parameters: np.ndarray,
    values: np.ndarray,
    substeps: int,
) -> tuple[np.ndarray, list[np.ndarray]]:
    """First values of a set and start values of each trial, with the amplitudes and phases that free runs show.

    Args:
        parameters: all parameters of the model.
        values: first values (k,) of the set's own, as they are among them.

    Raises:
        ComponentError: if a run from the records' own starts fails.
    """
    places = list(oscillations(effects, model.system))
    hidden = [i for oscillation in places for i in oscillation.phase]
    errors, beside = list[Error](), list[np.ndarray]()
    for record, metric in zip(records, reduce, strict=True):
        reach = 0.5 * (record.start_high - record.start_low)
        moved = np.setdiff1d(np.flatnonzero(np.isfinite(reach)), hidden)
        run = model.run(record.time, record.inputs, parameters, record.start, substeps=substeps, sensitivities=True)
        assert run.sensitivities is not None
        beside.append(np.vstack([metric(run.sensitivities[:, :, moved] * reach[moved]), np.eye(len(moved))]))
        errors.append(_error_of(model, record, metric, parameters, substeps, len(moved)))
    return with_phases(places, values, [r.start for r in records], errors, beside)


def _error_of(
    model: CompiledModel, record: Record, reduce: Reduce, parameters: np.ndarray, substeps: int, further: int
) -> Error:
    """The error of a trial by its start values, and `further` rows of zeros for what is known of them."""

    def error(start: np.ndarray) -> np.ndarray:
        run = model.run(record.time, record.inputs, parameters, start, substeps=substeps)
        return np.r_[reduce(run.outputs - record.measured).ravel(), np.zeros(further)]

    return error
