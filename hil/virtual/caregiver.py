"""A virtual caregiver at the wrist of a virtual robot: a grip that springs, damps, and pushes back after a moment."""

from collections import deque
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Person:
    """How somebody holds: values are general knowledge about people, not measurements of this project.

    `stiffness` N/m and `damping` N.s/m act at once; what is done on purpose follows after `reaction_s`, with `effort`
    N/(m.s) of the displacement's integral and `brake` N.s/m, smoothed over `lag_s`. `strength` N is the most he pushes,
    and `grip_s` the time to take hold or let go.
    """

    stiffness: float = 900.0
    damping: float = 40.0
    reaction_s: float = 0.2
    effort: float = 300.0
    brake: float = 20.0
    lag_s: float = 0.08
    strength: float = 130.0
    grip_s: float = 0.3


# How often the person's nerves look; shorter steps of the plant share a look.
_LOOK_S = 0.005


class Caregiver:
    """Pulls the wrist back to where it was when told to hold it.

    f = g (K (x0 - x) - B v + u), cut to the strength; g is the grip from 0 to 1, and u follows
    lag du/dt = effort e_sum + brake de/dt - u of the displacement e = x0 - x a reaction time ago.
    """

    def __init__(self, person: Person | None = None) -> None:
        self.person = person or Person()
        self.target: np.ndarray | None = None
        self.wants, self._grip = False, 0.0
        self._on_purpose, self._sum = np.zeros(2), np.zeros(2)
        self._seen: deque[tuple[np.ndarray, np.ndarray]] = deque()
        self._since_look = 0.0

    def hold(self) -> None:
        """Take hold where the wrist is next."""
        self.wants, self.target = True, None

    def relax(self) -> None:
        """Let go."""
        self.wants = False

    def advance(self, position: np.ndarray, velocity: np.ndarray, seconds: float) -> None:
        """Feel a position (2,) m and a velocity (2,) m/s, and go on by a time."""
        change = seconds / self.person.grip_s
        self._grip = min(self._grip + change, 1.0) if self.wants else max(self._grip - change, 0.0)
        if self.wants and self.target is None:
            self.target = position.copy()
            self._on_purpose, self._sum = np.zeros(2), np.zeros(2)
            self._seen.clear()
        if self.target is not None and self._grip > 0.0:
            self._look(position, velocity, seconds)

    def force(self, position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """Force (2,) in N on the wrist at a position (2,) m and velocity (2,) m/s."""
        if self.target is None or self._grip == 0.0:
            return np.zeros(2)
        at_once = self.person.stiffness * (self.target - position) - self.person.damping * velocity
        force = self._grip * (at_once + self._on_purpose)
        size = float(np.hypot(*force))
        return np.asarray(force * min(1.0, self.person.strength / size)) if size > 0 else force

    def _look(self, position: np.ndarray, velocity: np.ndarray, seconds: float) -> None:
        """What is done on purpose changes with what was felt a reaction time ago."""
        assert self.target is not None
        self._since_look += seconds
        if self._since_look < _LOOK_S:
            return
        passed, self._since_look = self._since_look, 0.0
        self._seen.append((self.target - position, velocity.copy()))
        if len(self._seen) * _LOOK_S <= self.person.reaction_s:
            return
        error, speed = self._seen.popleft()
        self._sum = self._sum + error * passed
        wanted = self.person.effort * self._sum - self.person.brake * speed
        share = passed / (self.person.lag_s + passed)
        self._on_purpose = self._on_purpose + share * (wanted - self._on_purpose)
