"""Joints with what a session should find out: friction, a payload, torques that act late, an encoder that is noisy."""

from collections import deque

import numpy as np

from hil.virtual.body import Burden
from hil.virtual.plant import FreeJoints

# m from the axes of a Proficio's joints to its end with a straight elbow: a payload there is seen by each joint as
# inertia m r^2.
REACH = np.array([1.085, 1.085, 0.435])
# Below this speed (rad/s) dry friction grows with speed instead of jumping.
STICKING = 1e-3


class LoadedJoints(FreeJoints):
    """Joints that do not feel each other, with a burden; the weight of the payload is held by whoever lifts the arm, joint 1.

    Args:
        angles: (n,) rad at the beginning.
        inertia: kg.m2 of each joint without payload.
        seed: of the noise.
    """

    def __init__(self, angles: np.ndarray, burden: Burden, inertia: float = 0.05, seed: int = 3) -> None:
        super().__init__(angles, inertia, burden.friction)
        reach = np.resize(REACH, len(self.angles))
        self.inertia = inertia + burden.payload * reach**2
        self.burden = burden
        self._time = 0.0
        # Torques with the times from which they act, the first of them now.
        self._coming: deque[tuple[float, np.ndarray]] = deque([(0.0, np.zeros(len(self.angles)))])
        self._random = np.random.default_rng(seed)

    def step(self, torques: np.ndarray, seconds: float) -> None:
        """Move on by a time; the torques act after the delay, and those from before until then."""
        if not np.array_equal(torques, self._coming[-1][1]):
            self._coming.append((self._time + self.burden.delay, np.array(torques, dtype=float)))
        end = self._time + seconds
        while self._time < end:
            until = min(self._coming[1][0], end) if len(self._coming) > 1 else end
            if until > self._time:
                self._under(self._coming[0][1], until - self._time)
            self._time = until
            if len(self._coming) > 1 and self._coming[1][0] <= self._time:
                self._coming.popleft()

    def shown(self) -> np.ndarray:
        """Angles (n,) in rad as the encoders show them."""
        return self.angles + self.burden.noise * self._random.standard_normal(len(self.angles))

    def _under(self, torques: np.ndarray, seconds: float) -> None:
        """Move on by a time under those torques and dry friction, which opposes the motion, or the torque where a joint
        stands."""
        dry = self.burden.dry
        if dry:
            driven = torques + self.outside
            stands = np.abs(self.speeds) < STICKING
            held = np.where(stands, np.clip(driven, -dry, dry), dry * np.sign(self.speeds))
            torques = torques - held
        before = self.speeds
        super().step(torques, seconds)
        if dry:  # friction brings a joint to rest and not beyond
            self.speeds = np.where(before * self.speeds < 0, 0.0, self.speeds)
