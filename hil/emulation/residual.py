"""Where the model of the arm disagrees with the robot right now: torque that nobody has asked for and nobody exerts."""

import math

import numpy as np

from hil.emulation.anatomy import Anatomy
from hil.emulation.settings import Learning

# Of a first sample, whose speed nobody knows: rad/s.
UNKNOWN_SPEED = 1.0
# A gap of s after which the arm may be anywhere.
LONGEST_S = 0.25

# Two joints each: angles, momentum M w, the missing torque, its rate, and the torque at the moment that was marked.
_ANGLE, _MOMENTUM, _TORQUE, _RATE, _MARKED = (slice(k, k + 2) for k in range(0, 10, 2))
_BOTH = np.eye(2)
# Of torque and rate of both joints (4, 4): what stays what it is, and what becomes the other.
_TORQUES, _RATES_TO_TORQUES, _TORQUES_TO_RATES, _RATES = (np.kron(each, _BOTH) for each in np.eye(4).reshape(4, 2, 2))


class Residual:
    """The torque (2,) in N.m that links feel beside what is known, by a Kalman filter on the arm's own equations.

    As in `orchestrator.models.missing_force` the torque is a Gaussian process in time of the Matern 3/2 kind. The
    states are q, p = M w, the torque and its rate: q' = M^-1 p, p' = what the model expects + torque; M is that of the
    measured angles, so the filter is linear. A mark keeps a moment's torque as a state of its own, which what comes
    later makes better (fixed-point smoothing); memory is constant.
    """

    def __init__(self, anatomy: Anatomy, learning: Learning | None = None) -> None:
        self.anatomy, self.learning = anatomy, learning or Learning()
        self._mean, self._covariance = np.zeros(10), np.zeros((10, 10))
        self._inverse = np.zeros((2, 2))
        self.is_known = False
        self.forget()

    @property
    def torque(self) -> np.ndarray:
        """The missing torque (2,) in N.m now, from what has been seen so far."""
        return self._mean[_TORQUE].copy()

    @property
    def deviation(self) -> np.ndarray:
        """Its standard deviation (2,) in N.m."""
        return np.asarray(np.sqrt(np.diag(self._covariance)[_TORQUE]))

    @property
    def speeds(self) -> np.ndarray:
        """Speeds (2,) in rad/s."""
        return np.asarray(self._inverse @ self._mean[_MOMENTUM])

    @property
    def marked(self) -> tuple[np.ndarray, np.ndarray]:
        """The missing torque (2,) in N.m at the marked moment, and its standard deviation (2,), from all that has been seen."""
        return self._mean[_MARKED].copy(), np.sqrt(np.diag(self._covariance)[_MARKED])

    def mark(self) -> None:
        """Keep this moment's torque in mind, instead of that of a moment before."""
        self._mean[_MARKED] = self._mean[_TORQUE]
        self._covariance[_MARKED] = self._covariance[_TORQUE]
        self._covariance[:, _MARKED] = self._covariance[:, _TORQUE]

    def forget(self) -> None:
        """Begin anew with the next cycle: nothing is known of the torque but how large it may be."""
        size, rate = self.learning.deviation, np.sqrt(3.0) / self.learning.duration
        self._mean[:], self._covariance[:] = 0.0, 0.0
        self._covariance[_TORQUE, _TORQUE] = size**2 * _BOTH
        self._covariance[_RATE, _RATE] = (rate * size) ** 2 * _BOTH
        self.is_known = False

    def advance(
        self, q: np.ndarray, w: np.ndarray, torque: np.ndarray, force: np.ndarray, seconds: float, fresh: bool = True
    ) -> np.ndarray:
        """Take in a cycle; returns the missing torque (2,) in N.m.

        Args:
            q, w: angles in rad and speeds in rad/s (2,); speeds are used once, at the beginning.
            torque: of the joints (2,) in N.m during the last `seconds`; `force` on the wrist (2,) in N.
            fresh: whether all angles have been measured in this cycle.
        """
        if not 0.0 < seconds < LONGEST_S:
            self.forget()
        if self.is_known:
            self._predict(q, torque, force, seconds)
            if fresh:
                self._correct(q)
        elif fresh:
            self._begin(q, w)
        return self.torque

    def _begin(self, q: np.ndarray, w: np.ndarray) -> None:
        mass = self.anatomy.mass_matrix(q)
        self._inverse = np.linalg.inv(mass)
        self._mean[_ANGLE], self._mean[_MOMENTUM] = q, mass @ w
        self._covariance[_ANGLE, _ANGLE] = self.learning.encoder**2 * _BOTH
        self._covariance[_MOMENTUM, _MOMENTUM] = UNKNOWN_SPEED**2 * mass @ mass
        self.is_known = True

    def _predict(self, q: np.ndarray, torque: np.ndarray, force: np.ndarray, seconds: float) -> None:
        self._inverse = np.linalg.inv(self.anatomy.mass_matrix(q))
        pull = self.anatomy.jacobian(q).T
        expected = self.anatomy.expected_rate(q, self.speeds, torque + pull @ force)
        keeps, new = _process(self.learning.deviation, self.learning.duration, seconds)
        step = np.eye(10)
        step[_ANGLE, _MOMENTUM] = seconds * self._inverse
        step[_ANGLE, _TORQUE] = 0.5 * seconds**2 * self._inverse
        step[_MOMENTUM, _TORQUE], step[_MOMENTUM, _RATE] = seconds * _BOTH, 0.5 * seconds**2 * _BOTH
        step[4:8, 4:8] = keeps
        self._mean = step @ self._mean
        self._mean[_ANGLE] += 0.5 * seconds**2 * (self._inverse @ expected)
        self._mean[_MOMENTUM] += seconds * expected
        self._covariance = step @ self._covariance @ step.T
        self._covariance[4:8, 4:8] += new
        self._covariance[_MOMENTUM, _MOMENTUM] += (self.learning.sensor * seconds) ** 2 * (pull @ pull.T)

    def _correct(self, q: np.ndarray) -> None:
        shared = self._covariance[:, _ANGLE]
        total = shared[_ANGLE] + self.learning.encoder**2 * _BOTH
        gain = shared @ np.linalg.inv(total)
        self._mean += gain @ (q - self._mean[_ANGLE])
        covariance = self._covariance - gain @ shared.T
        self._covariance = 0.5 * (covariance + covariance.T)


def _process(size: float, duration: float, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """What Matern 3/2 processes of both joints and their rates keep of themselves in a time (4, 4), and the covariance
    of what is new (4, 4).

    Closed form of Hartikainen and Saerkkae (MLSP 2010).
    """
    rate = math.sqrt(3.0) / duration
    far = rate * seconds
    left = math.exp(-far)
    keeps = left * (
        (1.0 + far) * _TORQUES + seconds * _RATES_TO_TORQUES - rate * far * _TORQUES_TO_RATES + (1.0 - far) * _RATES
    )
    lasting = size**2 * (_TORQUES + rate**2 * _RATES)
    return keeps, lasting - keeps @ lasting @ keeps.T
