"""Where in the space of two joint angles the model disagrees with the robot: an average that forgets."""

import math

import numpy as np

CELLS = 20
# What was seen so long ago weighs a third of what is seen now.
FORGETS_S = 60.0
# A cell that weighs less than this share of one sample says nothing any more.
LEAST = 0.02


class ResidualMap:
    """Averages of the residual torque (2,) in N.m over cells of shoulder and elbow angle.

    Each sample weighs exp(-age / FORGETS_S); cells are (CELLS, CELLS) with the first index along the shoulder.

    Args:
        low, high: (2,) rad, ends of the map; what lies outside is left out.
    """

    def __init__(self, low: np.ndarray, high: np.ndarray) -> None:
        self.low, self.high = low, high
        self._sums = np.zeros((CELLS, CELLS, 2))
        self._weights = np.zeros((CELLS, CELLS))
        self._time_s: float | None = None

    def add(self, time_s: float, angles: np.ndarray, residual: np.ndarray) -> None:
        """Take in one sample: time in s, angles (2,) in rad, residual (2,) in N.m."""
        if self._time_s is not None and time_s > self._time_s:
            fade = math.exp(-(time_s - self._time_s) / FORGETS_S)
            self._sums *= fade
            self._weights *= fade
        self._time_s = time_s
        cell = self.cell(angles)
        if cell is not None and np.isfinite(residual).all():
            self._sums[cell] += residual
            self._weights[cell] += 1.0

    def cell(self, angles: np.ndarray) -> tuple[int, int] | None:
        """The cell of angles (2,) in rad; None outside of the map."""
        share = (angles - self.low) / (self.high - self.low)
        if not np.all((share >= 0.0) & (share < 1.0)):
            return None
        shoulder, elbow = (share * CELLS).astype(int)
        return int(shoulder), int(elbow)

    @property
    def means(self) -> np.ndarray:
        """Averages (CELLS, CELLS, 2) in N.m, NaN where nothing was seen lately."""
        seen = self._weights >= LEAST
        return np.where(seen[..., None], self._sums / np.where(seen, self._weights, 1.0)[..., None], np.nan)
