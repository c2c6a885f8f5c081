"""What compare, diagnosis and reports need from a model, whatever kind it is."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol, cast

import numpy as np

from fmus.symbolic.system import Variable


@dataclass(frozen=True)
class FittedTrial:
    """A free run from the start values that fit the trial best.

    `outputs` has shape (n, ny) in the model's units; `start` holds the estimated states, by name, and `reach` how far each
    may have been moved from what the record shows of it, without limit where that is not known.
    """

    outputs: np.ndarray
    start: dict[str, float]
    reach: Mapping[str, float] = field(default_factory=dict)


class Model(Protocol):
    """A model with named inputs and outputs that can follow a trial from estimated start values."""

    name: str

    @property
    def content_hash(self) -> str:
        """SHA-256 of what the model is, hexadecimal."""
        ...

    @property
    def inputs(self) -> Sequence[Variable]:
        """Variables that drive the model."""
        ...

    @property
    def outputs(self) -> Sequence[Variable]:
        """Variables that can be compared with measurements."""
        ...

    def follow(
        self, time: np.ndarray, inputs: np.ndarray, measured: np.ndarray, names: Sequence[str], noise: np.ndarray
    ) -> FittedTrial:
        """Run freely along a trial, from start values estimated on it.

        Args:
            time: (n,) s.
            inputs: (n, nu) in the order of `inputs`, linear between samples but for those that the model holds.
            measured: (n, ny) of the outputs `names`.
            noise: (ny,) standard deviation of the measurement noise of each output.

        Raises:
            ComponentError: if the model fails on the way.
        """
        ...

    def simulate(
        self, time: np.ndarray, inputs: np.ndarray, names: Sequence[str], start: dict[str, float]
    ) -> np.ndarray:
        """Run freely from given start values; returns the outputs `names`, shape (n, ny)."""
        ...


def with_held_inputs(model: Model, held: Sequence[str]) -> Model:
    """The model with some inputs that stay at a sample's value until the next sample, as a converter or a log of events gives.

    A model that cannot do so, such as an FMU that integrates by itself, is returned as it is.
    """
    change = getattr(model, "with_held", None)
    return model if change is None or not held else cast(Model, change(held))
