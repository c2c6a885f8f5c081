"""One variable over time, as a simulation recorded it or as a reference file holds it."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

Interpolation = Literal["linear", "hold"]


@dataclass(frozen=True, eq=False)
class Signal:
    """One variable over time.

    Args:
        name: the variable's name.
        time: shape (n,), s, never falling; the same stamp two or three times is an event (values before and after it).
        values: shape (n,), in `unit`; whole numbers and Booleans are taken as numbers.
        unit: unit text, "" when it is not known, "1" for none.
        interpolation: "linear" between samples, or "hold": the last value stays until the next sample.
        nominal: the size that the variable's declaration gives, in `unit`; None when it gives none.

    Nothing is checked here: a damaged signal must come through, so that it fails with a reason.
    """

    name: str
    time: np.ndarray
    values: np.ndarray
    unit: str = ""
    interpolation: Interpolation = "linear"
    nominal: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "time", np.asarray(self.time, dtype=float))
        object.__setattr__(self, "values", np.asarray(self.values, dtype=float))
