"""Which muscles make a torque: the least activations that do, between 0 and 1."""

from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
# Torque that is lacking counts so much more than activation (per (N.m)^2) that it is lacking only where no activations
# make it.
_LACKING = 1e4


class Allocation:
    """min |a|^2 + weight |lacking|^2 such that C a + lacking = torque and 0 <= a <= 1: a quadratic program by CasADi (DAQP)."""

    def __init__(self, joints: int, muscles: int) -> None:
        self._joints, self._muscles = joints, muscles
        self._weights = np.concatenate([np.ones(muscles), np.full(joints, _LACKING)])
        shapes = {"h": ca.Sparsity.diag(muscles + joints), "a": ca.Sparsity.dense(joints, muscles + joints)}
        options: dict[str, Any] = {"error_on_fail": False}
        # Not qrqp, which now and then gives activations below 0 and calls that a success (CasADi 3.8.2).
        self._solve = ca.conic("allocation", "daqp", shapes, options)
        self._low = np.concatenate([np.zeros(muscles), np.full(joints, -np.inf)])
        self._high = np.concatenate([np.ones(muscles), np.full(joints, np.inf)])

    def __call__(self, torque: Array, capability: Array) -> Array:
        """Activations (m,) for a torque (p,) with C = `capability` (p, m), N.m at full activation; the closest torque
        if none is enough."""
        balance = np.hstack([capability, np.eye(self._joints)])
        found = self._solve(
            h=ca.diag(ca.DM(self._weights)), a=balance, lba=torque, uba=torque, lbx=self._low, ubx=self._high
        )
        return np.clip(np.array(found["x"]).ravel()[: self._muscles], 0.0, 1.0)

    def slope(self, activations: Array, capability: Array) -> Array:
        """d activations / d torque, (m, p), while the same muscles stay at rest or at full activation."""
        free = (activations > 1e-6) & (activations < 1.0 - 1e-6)
        slope = np.zeros((self._muscles, self._joints))
        part = capability[:, free]
        slope[free] = part.T @ np.linalg.pinv(part @ part.T + np.eye(self._joints) / _LACKING)
        return slope
