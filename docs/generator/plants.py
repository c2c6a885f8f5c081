"""The plants of the effect catalogue and the manoeuvre that each of them does."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

Series = np.ndarray


@dataclass(frozen=True)
class Plant:
    """A built-in model, how it is driven, and what is missing where an effect acts.

    `drive` gives inputs by name for times (n,) s; inputs that it leaves out are zero. `force` names the correction of its
    signals. `manoeuvre` says the same to people.
    """

    model: str
    signal: str
    seconds: float
    samples: int
    drive: Callable[[Series], Mapping[str, Series]]
    force: str
    manoeuvre: str

    @property
    def time(self) -> Series:
        """Sample times (n,), s."""
        return np.linspace(0.0, self.seconds, self.samples)


def _two_tones(name: str, slow: float, fast: float) -> Callable[[Series], Mapping[str, Series]]:
    """Cosines of 0.5 and 1.7 Hz: the speed that they give begins at zero and has no drift."""
    return lambda t: {name: slow * np.cos(2 * np.pi * 0.5 * t) + fast * np.cos(2 * np.pi * 1.7 * t)}


def _ramps(t: Series) -> Mapping[str, Series]:
    """A slow ramp up and down, then three pulses with soft edges."""
    slow = np.clip(np.minimum(t, 2.0 - t), 0.0, None)
    pulses = sum(0.9 / (1 + np.exp(-(0.15 - np.abs(t - centre)) / 0.01)) for centre in (2.5, 3.1, 3.7))
    return {"stimulation": slow + pulses, "length": np.full_like(t, 0.0425)}


def _bursts(t: Series) -> Mapping[str, Series]:
    """Smooth bursts of all six muscles one after another, and a push at the wrist."""
    found = {f"alpha_{k}": 0.06 + 0.2 * np.exp(-(((t - 0.5 - 0.55 * k) / 0.18) ** 2)) for k in (1, 3, 5)}
    found |= {f"alpha_{k}": 0.06 + 0.2 * np.exp(-(((t - 0.5 - 0.55 * k) / 0.18) ** 2)) for k in (2, 4, 6)}
    return found | {"fx": 3 * np.sin(2 * np.pi * 0.8 * t), "fy": 3 * np.sin(2 * np.pi * 0.5 * t)}


def _pump(t: Series) -> Mapping[str, Series]:
    """A pump that goes up and down once in two minutes."""
    return {"inflow": 1.0e-4 - 4e-5 * np.cos(2 * np.pi * t / 120.0)}


PLANTS = {
    plant.model: plant
    for plant in (
        Plant(
            "drive", "phi", 4.0, 1601, _two_tones("torque", 0.2, 0.1), "torque", "a torque of two tones, 0.5 and 1.7 Hz"
        ),
        Plant(
            "linear-drive",
            "x",
            4.0,
            1601,
            _two_tones("force", 3.0, 2.0),
            "force",
            "a force of two tones, 0.5 and 1.7 Hz",
        ),
        Plant(
            "two-mass",
            "phiLoad",
            4.0,
            1601,
            _two_tones("torque", 0.1, 0.05),
            "torque",
            "a torque of two tones, 0.5 and 1.7 Hz",
        ),
        Plant("tanks", "h1", 480.0, 961, _pump, "flow", "an inflow that rises and falls once in two minutes"),
        Plant("muscle", "force", 4.2, 1681, _ramps, "force", "a slow ramp of the stimulation, then three pulses"),
        Plant(
            "arm",
            "q2",
            4.5,
            1801,
            _bursts,
            "torque",
            "bursts of all muscles one after another, and a push at the wrist",
        ),
    )
}
