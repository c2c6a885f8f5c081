"""One column of all trials as one model variable: unit, range, pulses and noise."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fmus.errors import MisfitError
from fmus.units import conversion, scaling, si_exponents
from orchestrator.measurements.cleaning import bridged, cleaned, pieces
from orchestrator.measurements.colour import Noise
from orchestrator.measurements.noise import NoiseLevel, measurement_noise
from orchestrator.measurements.pulses import excitation_from_pulses, pulse_shape
from orchestrator.measurements.trial import Array, MeasurementSet, Trial
from orchestrator.measurements.wording import listed, shown

if TYPE_CHECKING:
    from fmus.symbolic.system import Variable

# A command of 1.0000001 is rounding, not a command beyond the limit.
_RANGE_TOLERANCE = 1e-6
# Samples between two gaps that tell of the noise.
SHORTEST = 20
# Samples, and trials, that a note names.
MENTIONED = 3


@dataclass(frozen=True, eq=False)
class Channel:
    """A column in the unit of the model: `values` holds one (n,) array per trial, in their order."""

    values: tuple[Array, ...]
    noise: NoiseLevel
    notes: tuple[str, ...]


def read_channel(measurements: MeasurementSet, column: str, variable: "Variable", *, drives: bool = False) -> Channel:
    """Read a column as a model variable.

    An input with the range [0, 1] whose column exceeds it as a pulse train becomes the excitation
    that the pulses stand for. Any other value outside the range is kept and noted.

    Args:
        measurements: the trials.
        column: name of the column.
        variable: what the model calls it, with unit and range.
        drives: whether it is an input of the model.

    Raises:
        MisfitError: a trial lacks the column, or its unit has another dimension.
    """
    recorded = [_column(trial, column) for trial in measurements.trials]
    unit = measurements.trials[0].units.get(column, "")
    excitation = _excitation(measurements.trials, recorded, column, unit, variable)
    if excitation is not None:
        return excitation
    factor, offset, notes = _scaling(measurements.trials[0], column, unit, variable)
    values = tuple(factor * each + offset for each in recorded)
    if not drives:
        values, cleaning = _cleaned(measurements.trials, values, column)
        notes = (*notes, *cleaning)
    parts = [
        part
        for trial, each in zip(measurements.trials, values, strict=True)
        if trial.subset == "learning" or not measurements.learning
        for part in pieces(trial.time, each)
    ]
    # What is left between two gaps may be too short to tell anything.
    longest = max(map(len, parts))
    records = [part for part in parts if len(part) >= min(SHORTEST, longest)]
    noise = measurement_noise(column, variable.unit or unit, records, measurements.sensors, drives=drives)
    if drives and measurements.interpolation.get(column) != "hold":
        values = tuple(bridged(trial.time, each) for trial, each in zip(measurements.trials, values, strict=True))
    notes = (*notes, *_range_notes(values, column, variable), noise.note, *filter(None, [noise.warning]))
    return Channel(values, noise, notes)


def _cleaned(
    trials: tuple[Trial, ...], values: tuple[Array, ...], column: str
) -> tuple[tuple[Array, ...], tuple[str, ...]]:
    """Replace samples that a recorder got wrong; an input is left alone, because a model may have felt what it shows."""
    found = [cleaned(trial.time, each) for trial, each in zip(trials, values, strict=True)]
    notes = []
    for kind, masks in (("outlying", [c.outliers for c in found]), ("held", [c.held for c in found])):
        places = [
            f"{trial.name} at {', '.join(f'{t:.4g}' for t in trial.time[mask][:MENTIONED])} s"
            for trial, mask in zip(trials, masks, strict=True)
            if mask.any()
        ]
        if places:
            count = sum(int(mask.sum()) for mask in masks)
            what, its = ("sample of {} is", "its") if count == 1 else ("samples of {} are", "their")
            where = f"{'first ones: ' if count > MENTIONED else ''}{'; '.join(places[:MENTIONED])}"
            notes.append(
                f"warning: {count} {kind} {what.format(shown(column))} replaced by the cubic through {its} neighbours ({where})"
            )
    return tuple(each.values for each in found), tuple(notes)


def _column(trial: Trial, column: str) -> Array:
    try:
        return trial.columns[column]
    except KeyError as error:
        raise MisfitError(
            f"{trial.name}: no column {shown(column)}, which the other trials have; columns found: {listed(trial.columns)}; add it or take the trial out of the set"
        ) from error


def _excitation(
    trials: tuple[Trial, ...], recorded: list[Array], column: str, unit: str, variable: "Variable"
) -> Channel | None:
    """Read the column as stimulation pulses; None if it is none or already within [0, 1]."""
    if (variable.minimum, variable.maximum) != (0.0, 1.0):
        return None
    if max(float(np.max(values)) for values in recorded) * _scale(unit) <= 1.0:
        return None
    records = [(t.time, values) for t, values in zip(trials, recorded, strict=True)]
    shape = pulse_shape(records)
    if shape is None:
        return None
    note = f"column {shown(column)} is a train of pulses at {1 / shape.period:.4g} Hz: {variable.name} is 1 from the first pulse of a burst until {shape.period:.4g} s after the last began, else 0"
    values = tuple(excitation_from_pulses(time, v, shape) for time, v in records)
    return Channel(values, NoiseLevel(Noise(0.0), note), (note,))


def _scale(unit: str) -> float:
    """Factor to a share of 1; pulses may as well be recorded in V, which are compared as numbers."""
    try:
        return conversion(unit, "1")
    except MisfitError:
        return 1.0


def _scaling(trial: Trial, column: str, unit: str, variable: "Variable") -> tuple[float, float, tuple[str, ...]]:
    """Factor and offset into the model's unit (an offset for degC only), and what is noted of them."""
    if not unit:
        note = f"unit of column {shown(column)} is not given; taken as {variable.unit or 'unknown'}, the unit of {variable.name}"
        return 1.0, 0.0, (note,)
    if not variable.unit:
        note = f"the model gives no unit for {variable.name}; column {shown(column)} is used in {unit}"
        return 1.0, 0.0, (note,)
    try:
        factor, offset = scaling(unit, si_exponents(unit), variable.unit, si_exponents(variable.unit))
    except MisfitError as error:
        raise MisfitError(
            f"{trial.name}: column {shown(column)} in {shown(unit)} cannot be model variable {shown(variable.name)} in {shown(variable.unit)}: {str(error).rpartition(': ')[2]}; correct the unit in [columns] of case.toml, or map the column to another variable in [variables]"
        ) from error
    if (factor, offset) == (1.0, 0.0):
        return factor, offset, ()
    added = f" and {offset:.9g} {variable.unit} is added" if offset else ""
    note = (
        f"column {shown(column)} is multiplied by {factor:.9g}{added} ({unit} to {variable.unit}) for {variable.name}"
    )
    return factor, offset, (note,)


def _range_notes(values: tuple[Array, ...], column: str, variable: "Variable") -> tuple[str, ...]:
    low = -np.inf if variable.minimum is None else variable.minimum
    high = np.inf if variable.maximum is None else variable.maximum
    seen_low = min(float(np.min(each)) for each in values)
    seen_high = max(float(np.max(each)) for each in values)
    slack = _RANGE_TOLERANCE * max(abs(seen_low), abs(seen_high))
    if seen_low >= low - slack and seen_high <= high + slack:
        return ()
    return (
        f"warning: column {shown(column)} spans [{seen_low:.4g}, {seen_high:.4g}] {variable.unit}, outside [{low:g}, {high:g}] {variable.unit} of {variable.name}; nothing is clipped",
    )
