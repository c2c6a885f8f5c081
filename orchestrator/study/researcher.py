"""What a careful researcher measures before any caregiver comes: holding forces without activation and muscle by muscle."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orchestrator.study.design import POSITIONS
from orchestrator.study.muscles import MUSCLES, PAPER, Limb, capabilities, statics

Array = NDArray[Any]
SUBSYSTEMS = ("statics", *MUSCLES)
POINTS = 4  # averages of a hold, as of a trial
ANGLE_RAD, SPEED_RAD_S = 0.02, 0.02  # how steadily the arm is held
SENSOR_N, SENSOR_SHARE = 0.3, 0.01
SETS = {"small": 1, "full": 3}  # holds at each position


@dataclass(frozen=True, eq=False)
class Bench:
    """Measurements of a subsystem: state (n, 4) and its force at the wrist (n, 2).

    `force` of a muscle is that of the arm at full activation; its capability is the difference to the statics there.
    """

    state: Array
    force: Array

    def without_velocity(self) -> "Bench":
        """The same as if nobody had looked at speeds."""
        return Bench(self.state[:, :2], self.force)


def measure(seed: int, holds: int, limb: Limb = PAPER) -> dict[str, Bench]:
    """Bench data by subsystem: 7 positions, `holds` at each, 4 points a hold, each with noise of posture and sensor.

    Args:
        seed: of the noise.
        holds: at each position.
        limb: the arm that is measured.
    """
    rng = np.random.default_rng([seed, 4])
    return {name: _subsystem(rng, place - 1, holds, limb) for place, name in enumerate(SUBSYSTEMS)}


def _subsystem(rng: np.random.Generator, muscle: int, holds: int, limb: Limb) -> Bench:
    postures = np.repeat(POSITIONS, holds, axis=0)
    held = postures + ANGLE_RAD * rng.standard_normal(postures.shape)
    angles = np.repeat(held, POINTS, axis=0)
    state = np.hstack([angles, SPEED_RAD_S * rng.standard_normal(angles.shape)])
    force = statics(state, limb)
    if muscle >= 0:
        force = force + capabilities(state, limb)[:, muscle]
    size = np.linalg.norm(force, axis=1, keepdims=True)
    return Bench(state, force + (SENSOR_N + SENSOR_SHARE * size) * rng.standard_normal(force.shape))
