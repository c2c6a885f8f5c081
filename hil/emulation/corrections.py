"""What the model lacks, learned while the session runs: a Gaussian process over the arm's angles and speeds."""

import numpy as np

from hil.emulation.residual import Residual
from hil.emulation.settings import Learning
from orchestrator.gp.covariance import Latent
from orchestrator.gp.kernels import SquaredExponential
from orchestrator.gp.observations import observe
from orchestrator.gp.online import Learner
from orchestrator.gp.predictor import Predictor

LATENT = "residual"


class Corrections:
    """Learns the torque (2,) in N.m that the links feel beside what is known, from the residual at marked moments.

    A moment is learned when the window after it is over, with the standard deviation that is left then; memory is constant.
    """

    def __init__(self, learning: Learning | None = None) -> None:
        self.learning = learning or Learning()
        scale = (self.learning.angle,) * 2 + (self.learning.speed,) * 2
        kernel = SquaredExponential(self.learning.deviation**2, scale)
        self._learner = Learner({LATENT: Latent(kernel)}, inputs=4, components=2, budget=self.learning.budget)
        self._known: Predictor | None = None
        self.moments = 0
        self._marked: np.ndarray | None = None
        self._passed = 0.0

    @property
    def count(self) -> int:
        """Data that are kept."""
        return self._learner.count

    def predict(self, q: np.ndarray, w: np.ndarray) -> np.ndarray:
        """The missing torque (2,) in N.m at angles and speeds (2,) each, as far as it has been learned."""
        return np.zeros(2) if self._known is None else self._known(np.concatenate([q, w]))[0]

    def uncertainty(self, q: np.ndarray, w: np.ndarray) -> float:
        """Standard deviation in N.m of what `predict` says, the same for both joints; as before all learning at first."""
        if self._known is None:
            return self.learning.deviation
        return float(np.sqrt(self._known.combined({LATENT: 1.0}, np.concatenate([q, w]))[1]))

    def advance(self, residual: Residual, q: np.ndarray, seconds: float, learn: bool) -> None:
        """Take in a cycle, after the residual has; a moment whose window was interrupted is not learned."""
        if not learn or not residual.is_known:
            self._marked = None
            return
        self._passed += seconds
        if self._marked is not None:
            if self._passed < self.learning.window_s:
                return
            self._learn(self._marked, *residual.marked)
        residual.mark()
        self._marked, self._passed = np.concatenate([q, residual.speeds]), 0.0

    def _learn(self, where: np.ndarray, torque: np.ndarray, deviation: np.ndarray) -> None:
        self.moments += 1
        noise = float(np.hypot(deviation.max(), self.learning.noise))
        self._learner.add(observe(f"moment {self.moments}", where[None], LATENT, torque[None], noise))
        self._known = Predictor(self._learner.live(), [LATENT])
