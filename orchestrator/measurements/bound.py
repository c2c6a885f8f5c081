"""Trials in the terms of a model: inputs and outputs in its order and its units."""

from collections.abc import Mapping
from dataclasses import dataclass

from orchestrator.measurements.trial import Array, Subset


@dataclass(frozen=True, eq=False)
class BoundTrial:
    """One trial for one model.

    `time` has shape (n,), s. `inputs` has shape (n, n_inputs), all inputs of the model in its order;
    an input without a column holds its start value, or 0. `outputs` has shape (n, n_outputs), only
    the outputs that were measured. Both are in the units of the model.
    """

    name: str
    subset: Subset
    time: Array
    inputs: Array
    outputs: Array


@dataclass(frozen=True, eq=False)
class BoundSet:
    """The trials of a measurement set for one model.

    `input_names` and `output_names` are model variables, in the order of the arrays.
    `unconnected_inputs` are inputs without a column, `unused_columns` columns without a variable.
    `noise_std` maps each model variable that has a column to the standard deviation of its noise in
    the model's unit; it is 0 for an excitation made from pulses, which is exact. `notes` lists what
    was converted and assumed, on top of the notes of the measurement set.
    """

    trials: tuple[BoundTrial, ...]
    input_names: tuple[str, ...]
    output_names: tuple[str, ...]
    unconnected_inputs: tuple[str, ...]
    unused_columns: tuple[str, ...]
    noise_std: Mapping[str, float]
    notes: tuple[str, ...]

    @property
    def learning(self) -> tuple[BoundTrial, ...]:
        """The trials a fit may use."""
        return tuple(trial for trial in self.trials if trial.subset == "learning")

    @property
    def held_out(self) -> tuple[BoundTrial, ...]:
        """The trials that only the final score may use."""
        return tuple(trial for trial in self.trials if trial.subset == "held_out")
