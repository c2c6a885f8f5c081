"""Trials in the terms of a model: inputs and outputs in its order and its units."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from orchestrator.measurements.colour import Noise
from orchestrator.measurements.noise import NoiseLevel
from orchestrator.measurements.trial import Array, Subset


@dataclass(frozen=True, eq=False)
class BoundTrial:
    """One trial for one model.

    `time` has shape (n,), s. `inputs` has shape (n, n_inputs), all inputs of the model in its order; an input without a
    column holds its start value, or 0. `outputs` has shape (n, n_outputs), only the outputs that were measured. Both
    are in the units of the model. `held` names the inputs that stay at a sample's value until the next sample; the
    others run in straight lines.
    """

    name: str
    subset: Subset
    time: Array
    inputs: Array
    outputs: Array
    held: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class BoundSet:
    """The trials of a measurement set for one model.

    `input_names` and `output_names` are model variables, in the order of the arrays.
    `unconnected_inputs` are inputs without a column, `unused_columns` columns without a variable.
    `noise_std` maps each model variable that has a column to the standard deviation of its noise in
    the model's unit; it is 0 for exact commands. `levels` tells where it comes from and its colour. `notes`
    lists what was converted and assumed, on top of the notes of the measurement set. `units_certain` says that the units
    are beyond doubt.
    """

    trials: tuple[BoundTrial, ...]
    input_names: tuple[str, ...]
    output_names: tuple[str, ...]
    unconnected_inputs: tuple[str, ...]
    unused_columns: tuple[str, ...]
    noise_std: Mapping[str, float]
    notes: tuple[str, ...]
    levels: Mapping[str, NoiseLevel] = field(default_factory=dict)
    units_certain: bool = False

    def noise_of(self, name: str) -> Noise:
        """Noise of a variable with its colour; none for an input without a column."""
        return self.levels[name].noise if name in self.levels else Noise(self.noise_std.get(name, 0.0))

    def with_noise_of(self, other: "BoundSet") -> "BoundSet":
        """The same trials with the noise that another set of the same sensors shows, and what is noted of that."""
        return replace(self, noise_std=other.noise_std, levels=other.levels, notes=other.notes)

    @property
    def learning(self) -> tuple[BoundTrial, ...]:
        """The trials a fit may use."""
        return tuple(trial for trial in self.trials if trial.subset == "learning")

    @property
    def held_out(self) -> tuple[BoundTrial, ...]:
        """The trials that only the final score may use."""
        return tuple(trial for trial in self.trials if trial.subset == "held_out")
