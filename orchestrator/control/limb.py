"""A limb as it is known: joint torques without activation and of each muscle, by a physics model and what was learned."""

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from orchestrator.gp.covariance import Latents
from orchestrator.gp.observations import observe
from orchestrator.gp.online import Learner
from orchestrator.gp.predictor import Predictor

Array = NDArray[Any]


class Limb:
    """Joint torques (p,) in N.m at a state (d,): `statics`, and of `muscles` (m,) what each adds at full activation.

    Every balance of torques that is seen is learned, in constant memory: it shows the sum of all at once.
    """

    def __init__(
        self, latents: Latents, statics: str, muscles: Sequence[str], inputs: int, joints: int, budget: int
    ) -> None:
        self.statics, self.muscles = statics, tuple(muscles)
        self._learner = Learner(latents, inputs, joints, budget)
        self._last: tuple[Array, Array] | None = None

    def torques(self, state: ArrayLike) -> tuple[Array, Array]:
        """Expected torque without activation, (p,), and of each muscle at full activation, (p, m)."""
        x = np.asarray(state, dtype=float)
        if self._last is None or not np.array_equal(
            self._last[0], x
        ):  # while a posture is held, the same is asked again and again
            self._last = (x.copy(), self._predictor(x))
        found = self._last[1]
        return found[0], found[1:].T

    def deviations(self, state: ArrayLike, activations: ArrayLike) -> float:
        """Standard deviation of each component of the total torque at activations (m,), N.m."""
        of = {self.statics: 1.0} | dict(zip(self.muscles, np.asarray(activations), strict=True))
        return float(np.sqrt(self._learner.live().variance(of, state)[0]))

    def learn(self, state: ArrayLike, activations: ArrayLike, torque: ArrayLike, noise: float) -> None:
        """Learn that statics and activated muscles (m,) together made a torque (p,), to a standard deviation `noise` in N.m."""
        parts = dict(zip(self.muscles, np.asarray(activations, dtype=float), strict=True))
        seen, made = np.atleast_2d(np.asarray(state)), np.atleast_2d(np.asarray(torque))
        self._learner.add(observe("balance", seen, {self.statics: 1.0, **parts}, made, noise))
        self.__dict__.pop("_predictor", None)
        self._last = None

    @cached_property
    def _predictor(self) -> Predictor:
        return Predictor(self._learner.live(), (self.statics, *self.muscles))
