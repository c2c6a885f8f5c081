"""The emulated arm in numbers, read from the FMUs that the model library builds; nothing is written down twice."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from hil.emulation.settings import JOINTS, MUSCLES
from orchestrator.cosim.built import built_fmu
from orchestrator.cosim.fmu import read_description

_MUSCLE_PARAMETERS = ("Fmax", "Lslack", "Lopt", "Vmax")


@dataclass(frozen=True)
class Anatomy:
    """Two links in a level plane and six muscles.

    `length`, `mass`, `centre`, `inertia`, `damping` are (2,): m, kg, m from the proximal joint, kg.m2 about the centre,
    N.m.s/rad; `at_zero` (6,) m and `arms` (2, 6) m give muscle lengths L = at_zero - arms' q; `muscles` are the parameters
    of each muscle's FMU.
    """

    length: np.ndarray
    mass: np.ndarray
    centre: np.ndarray
    inertia: np.ndarray
    damping: np.ndarray
    at_zero: np.ndarray
    arms: np.ndarray
    muscles: tuple[Mapping[str, float], ...]

    def lengths(self, q: np.ndarray) -> np.ndarray:
        """Lengths (6,) in m of muscles with tendons, at angles (2,) in rad; d lengths / dt is `-arms' w`."""
        return np.asarray(self.at_zero - q @ self.arms)

    def mass_matrix(self, q: np.ndarray) -> np.ndarray:
        """Mass matrix (2, 2) in kg.m2 at angles (2,)."""
        (i1, i2), (m1, m2), (c1, c2), l1 = self.inertia, self.mass, self.centre, self.length[0]
        coupled = i2 + m2 * (c2**2 + l1 * c2 * np.cos(q[1]))
        own = i1 + i2 + m1 * c1**2 + m2 * (l1**2 + c2**2 + 2 * l1 * c2 * np.cos(q[1]))
        return np.array([[own, coupled], [coupled, i2 + m2 * c2**2]])

    def jacobian(self, q: np.ndarray) -> np.ndarray:
        """d wrist position / d q, (2, 2) in m, world axes."""
        (l1, l2), s1, c1 = self.length, np.sin(q[0]), np.cos(q[0])
        s12, c12 = np.sin(q[0] + q[1]), np.cos(q[0] + q[1])
        return np.array([[-l1 * s1 - l2 * s12, -l2 * s12], [l1 * c1 + l2 * c12, l2 * c12]])

    def momentum_rate(self, q: np.ndarray, w: np.ndarray) -> np.ndarray:
        """C(q, w)' w, (2,) in N.m: how the momentum M w changes by the motion alone, d(M w)/dt = tau + C' w.

        The mass matrix depends on the elbow only, so it is (0, w' dM/dq2 w / 2).
        """
        slope = -self.mass[1] * self.length[0] * self.centre[1] * np.sin(q[1])
        return np.array([0.0, slope * w[0] * (w[0] + w[1])])

    def expected_rate(self, q: np.ndarray, w: np.ndarray, torque: np.ndarray) -> np.ndarray:
        """Rate of momentum M w (2,) in N.m that the model expects under torques (2,) in N.m at the joints, whatever
        makes them."""
        return np.asarray(torque + self.momentum_rate(q, w) - self.damping * w)


@cache
def anatomy() -> Anatomy:
    """That of the built-in model `arm`.

    Raises:
        MisfitError: if it cannot be built.
    """
    arm = {port.name: port.start for port in read_description(built_fmu("arm")).ports}
    length, mass, centre, inertia, damping = (_array(arm, f"linkage.{name}", JOINTS) for name in "lmcIb")
    by_muscle = {name: _array(arm, name, MUSCLES) for name in _MUSCLE_PARAMETERS}
    muscles = tuple(
        {"Kp": float(arm["Kp"]), **{name: float(values[k]) for name, values in by_muscle.items()}}
        for k in range(MUSCLES)
    )
    arms = np.array([_array(arm, "d1", MUSCLES), _array(arm, "d2", MUSCLES)])
    return Anatomy(length, mass, centre, inertia, damping, _array(arm, "a0", MUSCLES), arms, muscles)


def _array(starts: Mapping[str, Any], name: str, count: int) -> np.ndarray:
    return np.array([float(starts[f"{name}[{k}]"]) for k in range(1, count + 1)])
