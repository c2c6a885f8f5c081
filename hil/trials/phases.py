"""Where a session of trials stands: move, settle, announce, stimulate, go back; told by time and the operator alone."""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from hil.emulation.planar import Placement
from hil.trials.protocol import Protocol


class Phase(IntEnum):
    """What happens now."""

    MOVE = 0
    SETTLE = 1
    ANNOUNCE = 2
    STIMULATE = 3
    RETURN = 4
    DONE = 5


# A minimum-jerk movement is so many times as fast at its middle as on average.
PEAK = 1.875


@dataclass(frozen=True)
class Movement:
    """From one posture (3,) rad to another along a minimum-jerk course, faster than `speed` rad/s at no time."""

    start: np.ndarray
    end: np.ndarray
    speed: float

    @property
    def seconds(self) -> float:
        """How long it takes."""
        # One that goes nowhere still takes a moment.
        return max(float(PEAK * np.max(np.abs(self.end - self.start)) / self.speed), 0.1)

    def at(self, passed: float) -> tuple[np.ndarray, np.ndarray]:
        """Angles (3,) rad and speeds (3,) rad/s after so many seconds: q0 + d (10 s^3 - 15 s^4 + 6 s^5), s = t/T."""
        way, total = self.end - self.start, self.seconds
        if passed >= total:
            return self.end, np.zeros_like(way)
        s = passed / total
        return self.start + way * (s**3 * (10 + s * (6 * s - 15))), way * (30 * (s * (1 - s)) ** 2 / total)


class Course:
    """The phases of a protocol, one cycle after the other.

    `trial` counts from 1, `began` is when the phase began (s since arming). Movements are those of the robot's joints.
    """

    def __init__(self, protocol: Protocol, placement: Placement) -> None:
        self.protocol, self.placement = protocol, placement
        self.trial, self.phase, self.began = 1, Phase.MOVE, 0.0
        self._confirmed = False
        self._movement: Movement | None = None

    def advance(self, seconds: float, q: np.ndarray, confirm: bool) -> None:
        """Go on to the phase of this time; `q` (3,) rad is where the robot is."""
        protocol, passed = self.protocol, seconds - self.began
        if self._movement is None:
            self._move(q, self._posture())
        assert self._movement is not None
        if self.phase is Phase.MOVE and passed >= self._movement.seconds:
            self._enter(Phase.SETTLE, seconds)
        elif self.phase is Phase.SETTLE and passed >= protocol.settle_s:
            self._confirmed = not protocol.confirm
            self._enter(Phase.ANNOUNCE, seconds)
        elif self.phase is Phase.ANNOUNCE:
            self._confirmed |= confirm
            if self._confirmed and passed >= protocol.announce_s:
                self._enter(Phase.STIMULATE, seconds)
        elif self.phase is Phase.STIMULATE and passed >= protocol.stimulate_s:
            self._move(q, self.rest)
            self._enter(Phase.RETURN, seconds)
        elif self.phase is Phase.RETURN and passed >= self._movement.seconds:
            self._next(seconds)

    def activations(self, seconds: float) -> np.ndarray:
        """Activations (6,) now: they rise, stay and fall within the stimulation."""
        trial = self.protocol.trials[self.trial - 1]
        if self.phase is not Phase.STIMULATE:
            return np.zeros(len(trial.activations))
        passed, rise = seconds - self.began, self.protocol.rise_s
        share = min(passed / rise, (self.protocol.stimulate_s - passed) / rise, 1.0)
        return max(share, 0.0) * np.array(trial.activations)

    def desired(self, seconds: float) -> tuple[np.ndarray, np.ndarray]:
        """Where the robot should be (3,) rad and how fast (3,) rad/s, while the arm is not stimulated."""
        assert self._movement is not None
        if self.phase in (Phase.MOVE, Phase.RETURN):
            return self._movement.at(seconds - self.began)
        return self._movement.end, np.zeros_like(self._movement.end)

    @property
    def rest(self) -> np.ndarray:
        """Where the robot rests, (3,) rad."""
        return self.placement.robot_angles(np.array(self.protocol.rest))

    def _posture(self) -> np.ndarray:
        return self.placement.robot_angles(np.array(self.protocol.trials[self.trial - 1].posture))

    def _move(self, start: np.ndarray, end: np.ndarray) -> None:
        self._movement = Movement(start.copy(), end, self.protocol.move_speed)

    def _enter(self, phase: Phase, seconds: float) -> None:
        self.phase, self.began = phase, seconds

    def _next(self, seconds: float) -> None:
        if self.trial == len(self.protocol.trials):
            self._enter(Phase.DONE, seconds)
            return
        self.trial += 1
        self._move(self.rest, self._posture())
        self._enter(Phase.MOVE, seconds)
