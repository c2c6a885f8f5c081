"""Electrical stimulation recorded as a pulse train, turned into the excitation it stands for."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fmus.errors import MisfitError
from orchestrator.measurements.trial import Array

# Samples this close to a level, as a share of the pulse height, belong to it.
_LEVEL_WIDTH = 0.1
# One late or missing sample is no pause; a missing pulse is.
_LONGEST_GAP = 1.5
# Keeps rounding of the time column from adding a sample at the end of a burst.
_TIME_ROUNDING = 1e-6


@dataclass(frozen=True)
class PulseShape:
    """What tells pulses from rest: the level half way up, and the time from onset to onset (s)."""

    threshold: float
    period: float


def is_pulse_train(values: Array) -> bool:
    """Say whether a signal jumps between rest and one higher level, at least twice, and mostly rests.

    Args:
        values: shape (n,). Noise up to 10 % of the pulse height and one sample on the way up and
            down are accepted. Pulses of alternating sign are not recognised.
    """
    rest, top = float(np.median(values)), float(np.max(values))
    height = top - rest
    if height <= 0.0:
        return False
    n_pulses = len(_onsets(values, rest + height / 2))
    distance = np.minimum(np.abs(values - rest), np.abs(values - top))
    n_between = int(np.sum(distance > _LEVEL_WIDTH * height))
    return n_pulses >= 2 and n_between <= 2 * n_pulses


def pulse_shape(records: Sequence[tuple[Array, Array]]) -> PulseShape | None:
    """Find the common threshold and period of the same channel in several records.

    Args:
        records: (time in s, values), each (n,). Records that are no pulse train, such as a single
            pulse or silence, take over what the others show.

    Returns:
        The period is the median time between onsets; None if no record is a pulse train.
    """
    heights = [float(np.max(values) - np.median(values)) for _, values in records]
    # The flicker of the last digit in a silent record looks like tiny pulses.
    trains = [
        (time, values)
        for (time, values), height in zip(records, heights, strict=True)
        if height > max(heights) / 2 and is_pulse_train(values)
    ]
    if not trains:
        return None
    rest = float(np.median([np.median(values) for _, values in trains]))
    top = float(np.median([np.max(values) for _, values in trains]))
    threshold = (rest + top) / 2
    intervals = [np.diff(time[_onsets(values, threshold)]) for time, values in trains]
    return PulseShape(threshold, float(np.median(np.concatenate(intervals))))


def excitation_from_pulses(time: Array, values: Array, shape: PulseShape | None = None) -> Array:
    """Turn a pulse train into an excitation: 1 during a burst, 0 outside.

    A burst lasts from the onset of its first pulse until one period after the onset of its last; a
    gap of more than 1.5 periods between onsets ends it.

    Args:
        time: shape (n,), s.
        values: shape (n,), about 0 between pulses and about one other level during pulses.
        shape: threshold and period where they are known, for example from other trials; by default
            they are taken from this record.

    Returns:
        Shape (n,), dimensionless, 0 or 1. Constant values hold no pulse and give 0.

    Raises:
        MisfitError: no shape was given and the record is no train of at least two pulses, so that
            the period is unknown.
    """
    excitation = np.zeros(len(values))
    if np.min(values) == np.max(values):
        return excitation
    shape = shape or pulse_shape([(time, values)])
    if shape is None:
        raise MisfitError(
            f"stimulation between {np.min(values):g} and {np.max(values):g} is no train of two or more pulses, so its period is unknown; record the excitation itself, from 0 to 1"
        )
    for first, last in bursts(time, values, shape):
        end = last + shape.period * (1.0 - _TIME_ROUNDING)
        excitation[(time >= first) & (time < end)] = 1.0
    return excitation


def bursts(time: Array, values: Array, shape: PulseShape) -> list[tuple[float, float]]:
    """List the onsets of the first and the last pulse of every burst.

    Args:
        time: (n,) s.
        values: (n,) the pulse train.
        shape: threshold and period of the pulses.

    Returns:
        First and last onset of each burst, s.
    """
    onsets = time[_onsets(values, shape.threshold)]
    pauses = np.flatnonzero(np.diff(onsets) > _LONGEST_GAP * shape.period) + 1
    groups = np.split(onsets, pauses)
    return [(float(group[0]), float(group[-1])) for group in groups if group.size]


def _onsets(values: Array, threshold: float) -> NDArray[np.intp]:
    """Indices of the first sample above the threshold of every pulse."""
    above = values > threshold
    return np.flatnonzero(above & ~np.concatenate([[False], above[:-1]]))
