"""The study's equations in closed form: forces of the muscles at the wrist. They judge corrections and models, and never simulate.

States are (n, 4): q1, q2 in rad and their speeds in rad/s. Forces are (n, 2): world x and y in N.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
MUSCLES = ("anterior deltoid", "posterior deltoid", "biceps", "triceps long head", "triceps short head", "brachialis")
STRONG, WEAK = (0, 1, 3, 5), (2, 4)
LINKS = np.array([0.33, 0.32])
_MASS, _CENTRE, _INERTIA = (1.93, 1.52), (0.165, 0.19), (0.0141, 0.0188)
_DAMPING = np.array([0.30, 0.30])
_FMAX = np.array([800.0, 800.0, 1000.0, 1000.0, 700.0, 700.0])
_SLACK = np.array([0.0538, 0.0538, 0.2298, 0.1905, 0.1905, 0.0175])
_OPTIMUM = np.array([0.1280, 0.1280, 0.1422, 0.0877, 0.0877, 0.1028])
_VMAX = np.array([1.280, 1.280, 1.422, 0.877, 0.877, 1.028])
_A0 = np.array([0.1840, 0.1055, 0.4283, 0.1916, 0.2387, 0.1681])
_SIZES = np.array([[0.05, 0.05, 0.03, 0.03, 0.0, 0.0], [0.0, 0.0, 0.03, 0.03, 0.03, 0.03]])
_KP = 7500.0


@dataclass(frozen=True, eq=False)
class Limb:
    """What two parameter sets of the arm differ in: moment arms (2, 6) in m, tendons that take their slack length of a muscle's
    length, and the length (6,) in m from which on a muscle pulls without activation, in both directions or by stretch alone."""

    name: str
    arms: Array
    tendon: Array
    rest: Array
    by_stretch: bool

    def fibres(self, q: Array) -> Array:
        """Lengths of the muscles without their tendons at angles (n, 2), (n, 6), m."""
        return _A0 - q @ self.arms - self.tendon

    def passive(self, length: Array) -> Array:
        """Forces without activation, (n, 6), N."""
        stretch = length - self.rest
        return _KP * (np.maximum(stretch, 0.0) if self.by_stretch else stretch) ** 2


# As the paper prints it, for the study; and with extensors that extend, which the bench emulates.
PAPER = Limb("arm-paper", _SIZES, np.zeros(6), _SLACK, False)
PHYSIOLOGICAL = Limb("arm", _SIZES * np.array([1.0, -1.0, 1.0, -1.0, -1.0, 1.0]), _SLACK, _OPTIMUM, True)


def wrist(q: Array) -> Array:
    """Position of the wrist, (n, 2), m."""
    upper, fore = q[:, 0], q[:, 0] + q[:, 1]
    return np.column_stack(
        [
            LINKS[0] * np.cos(upper) + LINKS[1] * np.cos(fore),
            LINKS[0] * np.sin(upper) + LINKS[1] * np.sin(fore),
        ]
    )


def jacobian(q: Array) -> Array:
    """d wrist / d q, (n, 2, 2)."""
    fore = q[:, 0] + q[:, 1]
    last = np.stack([-LINKS[1] * np.sin(fore), LINKS[1] * np.cos(fore)], axis=1)
    first = last + np.stack([-LINKS[0] * np.sin(q[:, 0]), LINKS[0] * np.cos(q[:, 0])], axis=1)
    return np.stack([first, last], axis=2)


def at_wrist(q: Array, torque: Array) -> Array:
    """The force at the wrist that stands for joint torques (n, 2) in N m: J(q)' f = torque."""
    return np.linalg.solve(jacobian(q).transpose(0, 2, 1), torque[:, :, None])[:, :, 0]


def torques(state: Array, limb: Limb = PAPER) -> tuple[Array, Array]:
    """Joint torques without activation, (n, 2), and of each muscle beyond that at full activation, (n, 6, 2), N m."""
    length, speed = limb.fibres(state[:, :2]), -state[:, 2:] @ limb.arms
    active = _FMAX * np.exp(-(((length - _OPTIMUM) / (0.65 * _OPTIMUM)) ** 2)) * _speed_factor(speed)
    return limb.passive(length) @ limb.arms.T, active[:, :, None] * limb.arms.T


def statics(state: Array, limb: Limb = PAPER) -> Array:
    """Force of the passive muscles at the wrist, (n, 2); holding the arm without activation takes its opposite."""
    return at_wrist(state[:, :2], torques(state, limb)[0])


def capabilities(state: Array, limb: Limb = PAPER) -> Array:
    """Force that each muscle adds at the wrist at full activation, (n, 6, 2)."""
    active = torques(state, limb)[1]
    return np.stack([at_wrist(state[:, :2], active[:, k]) for k in range(len(MUSCLES))], axis=1)


def perfect(state: Array, activation: Array, limb: Limb = PAPER) -> Array:
    """The force that holds the arm at a state against activations (n, 6): minus the sum of all subsystems, (n, 2)."""
    return -statics(state, limb) - np.einsum("nm,nmk->nk", activation, capabilities(state, limb))


def moving_torques(state: Array, acceleration: Array) -> Array:
    """Joint torques that motion takes: M(q) a + h(q, w) + b w, (n, 2), with the nominal links; acceleration (n, 2), rad/s2."""
    (m1, m2), (c1, c2), (i1, i2) = _MASS, _CENTRE, _INERTIA
    q, w = state[:, :2], state[:, 2:]
    coupling = m2 * LINKS[0] * c2
    cosine, sine = np.cos(q[:, 1]), np.sin(q[:, 1])
    own = i2 + m2 * c2**2
    both = own + coupling * cosine
    whole = i1 + m1 * c1**2 + m2 * LINKS[0] ** 2 + own + 2.0 * coupling * cosine
    first = (
        whole * acceleration[:, 0] + both * acceleration[:, 1] - coupling * sine * (2.0 * w[:, 0] + w[:, 1]) * w[:, 1]
    )
    second = both * acceleration[:, 0] + own * acceleration[:, 1] + coupling * sine * w[:, 0] ** 2
    return np.column_stack([first, second]) + _DAMPING * w


def _speed_factor(speed: Array) -> Array:
    steepness, most = 0.25, 1.5
    shortening = np.maximum((_VMAX + speed) / (_VMAX - np.minimum(speed, 0.0) / steepness), 0.0)
    c = _VMAX * steepness * (most - 1.0) / (steepness + 1.0)
    lengthening = np.maximum(speed, 0.0)
    return np.where(speed <= 0.0, shortening, (most * lengthening + c) / (lengthening + c))
