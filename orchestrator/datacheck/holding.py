"""Whether inputs were held from sample to sample or ran in straight lines, chosen by the data where the case does not say."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from orchestrator.datacheck import limits
from orchestrator.datacheck.prediction import Predictor
from orchestrator.measurements import MeasurementSet, bind
from orchestrator.measurements.dirty.plan import proposed_interpolation
from orchestrator.measurements.matching import match_columns
from orchestrator.models.contract import Model, with_held_inputs


def with_interpolation(model: Model, measurements: MeasurementSet) -> MeasurementSet:
    """Return the set with `interpolation` for moving inputs of which case.toml says nothing, and a note for each that is held.

    An input is held if its record stays and jumps along most trials, unless the model predicts clearly worse so: a model that
    lacks something predicts a few percent worse or better by chance. Any other is held if the model predicts one output far better so,
    and none worse. Learning trials alone are looked at. What case.toml says of a column stays.

    Raises:
        MisfitError: if columns and variables do not fit each other.
    """
    data = bind(measurements, model.inputs, model.outputs)
    open_ones = open_inputs(model, measurements)
    if not open_ones:
        return measurements
    held = data.trials[0].held
    free = Predictor(with_held_inputs(model, held), data, data.learning)
    before, errors = free.left(), free.errors()
    chosen, notes = dict(measurements.interpolation), list(measurements.notes)
    for name, column in open_ones.items():
        records = [np.asarray(trial.columns[column]) for trial in measurements.learning]
        stays = 2 * sum(proposed_interpolation(record) == "hold" for record in records) > len(records)
        fixed = Predictor(with_held_inputs(model, [*held, name]), data, data.learning)
        after, errors_held = fixed.left(), fixed.errors()
        gain = (errors / np.maximum(errors_held, 1e-300)) ** 2
        better = after < limits.WELL_PREDICTED and gain.max() > limits.HELD_DROP and gain.min() > 1 / limits.HELD_WORSE
        holds = (stays and after <= limits.HELD_WORSE * before) or better
        chosen[column] = "hold" if holds else "linear"
        if holds:
            notes.append(
                f"{name} is held from sample to sample: {'its record stays and jumps, and ' if stays else ''}over short stretches"
                f" the model leaves {after:.2g} so, and {before:.2g} with straight lines; say so in [interpolation] of case.toml"
            )
            held, before, errors = (*held, name), after, errors_held
    return replace(measurements, interpolation=chosen, notes=tuple(notes))


def open_inputs(model: Model, measurements: MeasurementSet) -> dict[str, str]:
    """Inputs that move along learning trials and of whose course between samples nothing is said, by name with their columns.

    Raises:
        MisfitError: if columns and variables do not fit each other.
    """
    data = bind(measurements, model.inputs, model.outputs)
    if not data.learning or with_held_inputs(model, data.input_names) is model:
        return {}
    names = [*data.input_names, *data.output_names]
    column_of = match_columns(tuple(measurements.trials[0].columns), measurements.variables, names).column_of
    moving = np.ptp(np.concatenate([trial.inputs for trial in data.learning]), axis=0) > 0
    moved = [name for name, moves in zip(data.input_names, moving, strict=True) if moves]
    return {name: column_of[name] for name in moved if column_of[name] not in measurements.interpolation}


def turned(measurements: MeasurementSet, columns: Mapping[str, str], gains: Mapping[str, float]) -> MeasurementSet:
    """The set with the inputs of `gains` (by name, nats that the record gains) held if they were not, and not held if they were.

    Args:
        measurements: the set.
        columns: column of each input.
        gains: by how many nats the record is likelier so, by input.
    """
    chosen, notes = dict(measurements.interpolation), list(measurements.notes)
    for name, gain in gains.items():
        holds = chosen[columns[name]] != "hold"
        chosen[columns[name]] = "hold" if holds else "linear"
        course = "is held from sample to sample" if holds else "runs in straight lines between samples"
        odds = f"{np.exp(gain):.0f}" if gain < np.log(1000.0) else "over 1000"
        notes.append(
            f"{name} {course}: the record is {odds} times as likely so; say so in [interpolation] of case.toml"
        )
    return replace(measurements, interpolation=chosen, notes=tuple(notes))
