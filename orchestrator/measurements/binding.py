"""From columns in a file to the inputs and outputs of a model."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from fmus.errors import MisfitError
from orchestrator.measurements.bound import BoundSet, BoundTrial
from orchestrator.measurements.channel import Channel, read_channel
from orchestrator.measurements.matching import match_columns
from orchestrator.measurements.trial import MeasurementSet, Trial
from orchestrator.measurements.wording import listed

if TYPE_CHECKING:
    from fmus.symbolic.system import Variable


# Joints of a robot have names like those of the arm that is strapped to it and mean others: such columns are not
# matched by name.
ROBOT = "robot"


def bind(trial_set: MeasurementSet, inputs: Sequence["Variable"], outputs: Sequence["Variable"]) -> BoundSet:
    """Express a measurement set in the inputs and outputs of a model.

    Args:
        trial_set: the measurements, in the units of the files.
        inputs: all inputs of the model; those without a column are held at their start value, or 0.
        outputs: what the model offers for comparison; those without a column are left out.

    Returns:
        All values in the units of the model; `notes` lists every conversion and assumption.

    Raises:
        MisfitError: no output was measured, a unit has another dimension than its model variable,
            or a trial lacks a column that the others have.
    """
    columns = tuple(trial_set.trials[0].columns)
    names = [variable.name for variable in (*inputs, *outputs)]
    matching = match_columns(columns, trial_set.variables, names)
    _same_frame(trial_set, matching.column_of)
    measured = [v for v in outputs if v.name in matching.column_of]
    if not measured:
        raise MisfitError(
            f"{trial_set.path}: no column is an output of the model; outputs: {listed(v.name for v in outputs)}; columns: {listed(columns)}; map a column to an output in [variables] of case.toml, which 'misfit import' writes: --map COLUMN=VARIABLE"
        )
    channels = {
        variable.name: read_channel(
            trial_set, matching.column_of[variable.name], variable, drives=any(variable is each for each in inputs)
        )
        for variable in (*inputs, *measured)
        if variable.name in matching.column_of
    }
    held = tuple(v.name for v in inputs if trial_set.interpolation.get(matching.column_of.get(v.name, "")) == "hold")
    idle = [v for v in inputs if v.name not in channels]
    notes = [*matching.notes, *(_idle_note(variable) for variable in idle)]
    for channel in channels.values():
        notes.extend(channel.notes)
    return BoundSet(
        trials=tuple(
            _bound_trial(trial, i, inputs, measured, channels, held) for i, trial in enumerate(trial_set.trials)
        ),
        input_names=tuple(v.name for v in inputs),
        output_names=tuple(v.name for v in measured),
        unconnected_inputs=tuple(v.name for v in idle),
        unused_columns=tuple(c for c in columns if c not in matching.column_of.values()),
        noise_std={name: channel.noise.std for name, channel in channels.items()},
        notes=tuple(notes),
        levels={name: channel.noise for name, channel in channels.items()},
        units_certain=trial_set.units_certain,
    )


def _bound_trial(
    trial: Trial,
    index: int,
    inputs: Sequence["Variable"],
    measured: Sequence["Variable"],
    channels: Mapping[str, Channel],
    held: tuple[str, ...],
) -> BoundTrial:
    input_values = np.empty((len(trial.time), len(inputs)))
    for i, variable in enumerate(inputs):
        channel = channels.get(variable.name)
        input_values[:, i] = channel.values[index] if channel else _idle(variable)
    output_values = np.column_stack([channels[v.name].values[index] for v in measured])
    for values in (input_values, output_values):
        values.setflags(write=False)
    return BoundTrial(trial.name, trial.subset, trial.time, input_values, output_values, held)


def _idle(variable: "Variable") -> float:
    return 0.0 if variable.start is None else variable.start


def _idle_note(variable: "Variable") -> str:
    held = f"{_idle(variable):g} {variable.unit}".rstrip()
    return f"input {variable.name} has no column and is held at {held}"


def _same_frame(trial_set: MeasurementSet, column_of: Mapping[str, str]) -> None:
    """Refuse columns of a robot's joints that only their name makes a variable of the model."""
    if not trial_set.frame.startswith(ROBOT):
        return
    by_name = [column for column in column_of.values() if column not in trial_set.variables]
    if by_name:
        raise MisfitError(
            f"{trial_set.path}: columns {listed(by_name)} belong to another frame (frame = {trial_set.frame!r}), and have the"
            " names of variables of the model by chance; say in [variables] of case.toml which column is which variable, such as"
            f' {by_name[0]} = "{next(iter(column_of))}"'
        )
