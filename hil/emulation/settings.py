"""How what a model lacks is learned while a session runs."""

import math
from dataclasses import dataclass, fields

from fmus.errors import MisfitError

# Of the emulated arm.
MUSCLES, JOINTS = 6, 2


@dataclass(frozen=True)
class Learning:
    """How corrections are learned.

    A datum is the missing torque at one moment, each `window_s`, as the same time after it shows it. `budget` data are
    kept. `deviation` N.m is how large the missing torque may be, `duration` s how long it stays alike; `encoder` rad
    and `sensor` N are the noise of angles and forces. `noise` N.m is added to what these leave open: a part that does
    not follow from angles and speeds. It changes over `angle` rad and `speed` rad/s. `share` of it is taken off the
    torque that is asked for (0: it is only watched).
    """

    window_s: float = 0.1
    budget: int = 100
    deviation: float = 0.5
    duration: float = 0.3
    encoder: float = 1e-4
    sensor: float = 0.3
    noise: float = 0.05
    angle: float = 1.0
    speed: float = 1.0
    share: float = 0.0

    def __post_init__(self) -> None:
        """Refuse what cannot be learned with."""
        for field in fields(self)[:-1]:
            value = getattr(self, field.name)
            if not (math.isfinite(value) and value > 0):
                raise MisfitError(f"learning: {field.name} = {value!r}; a positive number was expected")
        if not 0.0 <= self.share <= 1.0:
            raise MisfitError(f"learning: share = {self.share!r}; a share from 0 to 1 was expected")
