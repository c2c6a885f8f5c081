"""Where the model of the arm disagrees with the robot right now: torque that nobody has asked for and nobody exerts."""

import numpy as np

from hil.emulation.anatomy import Anatomy

# How fast the residual follows, rad/s.
FOLLOWS = 20.0


class Residual:
    """The momentum observer of De Luca and Mattone (2005): r' = K (d(M w)/dt - tau - C' w - J' f + b w - r).

    In steady state `torque` (2,) N.m is what the links feel beside the torques that are known; it needs no acceleration.
    """

    def __init__(self, anatomy: Anatomy) -> None:
        self.anatomy = anatomy
        self.torque = np.zeros(2)
        self._momentum: np.ndarray | None = None

    def known(self, q: np.ndarray, w: np.ndarray, torque: np.ndarray, force: np.ndarray) -> np.ndarray:
        """Rate of momentum (2,) in N.m that the model expects under joint torques (2,) and a force (2,) at the wrist."""
        anatomy = self.anatomy
        pull = anatomy.jacobian(q).T @ force
        return np.asarray(torque + pull + anatomy.momentum_rate(q, w) - anatomy.damping * w)

    def advance(self, q: np.ndarray, w: np.ndarray, known: np.ndarray, seconds: float) -> np.ndarray:
        """Take in one cycle: angles, speeds, the rate of momentum that was expected during the last `seconds`."""
        momentum = self.anatomy.mass_matrix(q) @ w
        if self._momentum is not None and seconds > 0:
            felt = (momentum - self._momentum) - known * seconds
            # Backward Euler: r (1 + K dt) = r0 + K (felt), with felt the integral of the torque over dt.
            self.torque = (self.torque + FOLLOWS * felt) / (1.0 + FOLLOWS * seconds)
        self._momentum = momentum
        return self.torque
