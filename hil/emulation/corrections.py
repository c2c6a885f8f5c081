"""What the model lacks, learned while the session runs: a Gaussian process over the arm's angles and speeds."""

import numpy as np

from hil.emulation.anatomy import Anatomy
from hil.emulation.settings import Learning
from orchestrator.gp.covariance import Latent
from orchestrator.gp.kernels import SquaredExponential
from orchestrator.gp.observations import observe
from orchestrator.gp.online import Learner
from orchestrator.gp.posterior import Posterior

LATENT = "residual"


class Corrections:
    """Learns the torque (2,) in N.m that the links feel beside what is known, by windows of momentum.

    The mean of it over a window is (p1 - p0 - integral of the known rate)/T, p = M w: no acceleration is needed.
    """

    def __init__(self, anatomy: Anatomy, learning: Learning | None = None) -> None:
        self.anatomy, self.learning = anatomy, learning or Learning()
        scale = (self.learning.angle,) * 2 + (self.learning.speed,) * 2
        kernel = SquaredExponential(self.learning.deviation**2, scale)
        self._learner = Learner({LATENT: Latent(kernel)}, inputs=4, components=2, budget=self.learning.budget)
        self.windows = 0
        self._known: Posterior | None = None
        self._began: np.ndarray | None = None
        self._passed, self._expected = 0.0, np.zeros(2)
        self._where: list[np.ndarray] = []

    @property
    def count(self) -> int:
        """Data that are kept."""
        return self._learner.count

    def predict(self, q: np.ndarray, w: np.ndarray) -> np.ndarray:
        """The missing torque (2,) in N.m at angles and speeds (2,) each, as far as it has been learned."""
        return np.zeros(2) if self._known is None else np.asarray(self._known.mean(LATENT, [[*q, *w]])[0])

    def uncertainty(self, q: np.ndarray, w: np.ndarray) -> float:
        """Standard deviation in N.m of what `predict` says, the same for both joints; as before all learning at first."""
        if self._known is None:
            return self.learning.deviation
        return float(np.sqrt(self._known.variance(LATENT, [[*q, *w]])[0]))

    def advance(self, q: np.ndarray, w: np.ndarray, known: np.ndarray, seconds: float, learn: bool) -> None:
        """Take in a cycle; a window that was interrupted is forgotten."""
        if not learn or seconds <= 0:
            self._forget_window()
            return
        if self._began is None:
            self._began = self.anatomy.mass_matrix(q) @ w
            return
        self._passed += seconds
        self._expected += known * seconds
        self._where.append(np.concatenate([q, w]))
        if self._passed >= self.learning.window_s:
            self._learn(self.anatomy.mass_matrix(q) @ w)

    def _learn(self, momentum: np.ndarray) -> None:
        missing = (momentum - self._began - self._expected) / self._passed
        where = np.mean(self._where, axis=0)
        self.windows += 1
        self._learner.add(observe(f"window {self.windows}", where[None], LATENT, missing[None], self.learning.noise))
        self._known = self._learner.posterior()
        self._forget_window()
        self._began = momentum

    def _forget_window(self) -> None:
        self._began, self._passed = None, 0.0
        self._expected, self._where = np.zeros(2), []
