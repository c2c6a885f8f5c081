"""Who takes part and what they meet: positions, stimulation patterns, and caregivers with their own behaviour."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
POSITIONS = np.array([[0.3, 1.0], [0.3, 1.7], [0.75, 0.8], [0.75, 1.35], [0.75, 1.9], [1.2, 1.0], [1.2, 1.7]])
REPEATS = 3
TRIAL_S, WINDOW_S = 2.0, 0.5
SPREAD = 0.25  # of the logarithm of each number of a caregiver
TARGET_OFF = 0.01  # m, how far off the remembered posture is
TREMOR_HZ = (0.5, 10.0)


@dataclass(frozen=True)
class Caregiver:
    """Behaviour of a person; the words are those of the model `Caregivers.Caregiver`.

    stiffness N/m, damping N s/m, reaction s, adapting N/(m s), limit N; unsteadiness is a share of the push plus `rest` N.
    """

    stiffness: float = 1200.0
    damping: float = 60.0
    reaction: float = 0.2
    adapting: float = 600.0
    braking: float = 60.0
    limit: float = 140.0
    share: float = 0.08
    rest: float = 1.5

    def values(self) -> Mapping[str, float]:
        """The parameters of the Modelica model."""
        return {
            "K": self.stiffness,
            "B": self.damping,
            "reaction": self.reaction,
            "Ki": self.adapting,
            "Kd": self.braking,
            "Fmax": self.limit,
            "share": self.share,
            "rest": self.rest,
        }


@dataclass(frozen=True, eq=False)
class Trial:
    """A caregiver at a position against a pattern of activations, (6,), with the chance of this trial."""

    number: int
    caregiver: int
    position: int
    activation: Array
    target_off: Array
    tremor_hz: Array
    phases: Array


def draw_caregivers(seed: int, mean: Caregiver, count: int) -> tuple[Caregiver, ...]:
    """People about a median person, each number log-normal with the spread.

    Args:
        seed: of the draw.
        mean: the median person.
        count: number of people.
    """
    rng = np.random.default_rng([seed, 1])
    names = tuple(vars(mean))
    factors = np.exp(SPREAD * rng.standard_normal((count, len(names))))
    # Nobody answers at once, and Caregivers.mo remembers 0.6 s.
    people = []
    for row in factors:
        numbers = {name: getattr(mean, name) * float(factor) for name, factor in zip(names, row, strict=True)}
        numbers["reaction"] = float(np.clip(numbers["reaction"], 0.08, 0.5))
        people.append(Caregiver(**numbers))
    return tuple(people)


def draw_trials(seed: int, caregivers: int) -> tuple[Trial, ...]:
    """21 trials each: all caregivers meet the same patterns, each pairs them with positions in an order of its own."""
    rng = np.random.default_rng([seed, 2])
    slots = np.repeat(np.arange(len(POSITIONS)), REPEATS)
    patterns = rng.uniform(0.0, 1.0, (len(slots), 6))
    trials: list[Trial] = []
    for caregiver in range(caregivers):
        for pattern, position in zip(patterns, rng.permutation(slots), strict=True):
            off = TARGET_OFF * rng.standard_normal(2)
            tremor = np.exp(rng.uniform(np.log(TREMOR_HZ[0]), np.log(TREMOR_HZ[1]), 4))
            phases = rng.uniform(0.0, 2.0 * np.pi, (2, 4))
            trials.append(Trial(len(trials), caregiver, int(position), pattern, off, tremor, phases))
    return tuple(trials)
