"""Holds postures of the emulated arm by its muscles alone, through the robot's torques.

Before that the robot brings the arm to the first posture, as between trials.
"""

from dataclasses import dataclass

import numpy as np

from hil.control.abilities import Shown
from hil.control.controllers import Observed
from hil.emulation.anatomy import anatomy
from hil.emulation.muscles import Muscles
from hil.emulation.planar import PLANE, Placement
from hil.stimulation.plan import MUSCLES, Plan, Rest
from orchestrator.control.arm import UNBALANCED, feedback_at, nominal_limb
from orchestrator.control.hold import Controller

SIGNALS = (
    Shown("posture", "1", "number of the posture, from 1; one more at the end"),
    *(Shown(f"alpha_{k}", "1", f"activation of muscle {k}") for k in range(1, MUSCLES + 1)),
    *(Shown(f"arm_q{k}", "rad", f"angle of the emulated arm's joint {k}") for k in (1, 2)),
    *(Shown(f"wanted_q{k}", "rad", f"wanted angle of the emulated arm's joint {k}") for k in (1, 2)),
    *(Shown(f"integral{k}", "N.m", f"torque of the integrator at joint {k}") for k in (1, 2)),
)
# N.m that the integrator may come to: no model of an arm beside a person is further off.
MOST_INTEGRAL = 8.0
# rad/s at most while the robot brings the arm to the first posture, and s to come to rest there.
APPROACH, SETTLE_S = 0.4, 1.0
# The longest time (s) between two cycles that is integrated over.
LONGEST_S = 0.05


@dataclass(frozen=True)
class Held:
    """A posture as it was held: mean angles rad and activations of the judged time, and the distance from the target, rad."""

    target: tuple[float, float]
    angles: tuple[float, float]
    error: float
    activations: tuple[float, ...]

    @property
    def rest(self) -> Rest:
        """What it teaches: these activations balance the limb there."""
        return Rest(self.angles, self.activations)


class Stimulation:
    """Activations that the learned limb needs, feedback about them, and the integral of what is left; joint 1 is held.

    The integrator adds the torque that feedback keeps making: tau' = integral * (K e), so what neither the model nor a block
    knows ends as activation, not as an error of the angle. It waits while no activation makes the torque (anti-windup).

    Args:
        stiffness, damping: of the robot's joints (3,), N.m/rad and N.m.s/rad, on the way to the first posture; joint 1 is
            always held.
    """

    signals = SIGNALS

    def __init__(self, plan: Plan, placement: Placement, stiffness: np.ndarray, damping: np.ndarray) -> None:
        self.plan, self.placement, self.stiffness, self.damping = plan, placement, stiffness, damping
        self.limb = nominal_limb()
        middle = np.mean(plan.postures, axis=0)
        self.feedback = feedback_at(middle)
        self.controller = Controller(self.limb, self.feedback, MUSCLES)
        for rest in plan.learned:
            self.limb.learn(np.array([*rest.angles, 0.0, 0.0]), np.array(rest.activations), np.zeros(2), UNBALANCED)
        at = np.array([*middle, 0.0, 0.0])
        self.controller(at, at)  # what is built at the first call is built before anything moves
        self.muscles, self.strength = Muscles(anatomy()), np.array(plan.strength)
        self.held: list[Held] = []
        self.shown = (0.0,) * len(SIGNALS)
        self._integral = np.zeros(2)
        self._begun, self._last = 0.0, -1.0
        self._from = np.zeros(2)
        self._first = placement.robot_angles(np.array(plan.postures[0]))
        self._start: np.ndarray | None = None
        self._is_there = False
        self._judged: list[np.ndarray] = []

    @property
    def is_done(self) -> bool:
        """Whether all postures have been held."""
        return len(self.held) == len(self.plan.postures)

    def torque(self, observed: Observed) -> np.ndarray:
        """Joint torques (3,) in N.m; none before the arm is armed, nor after the last posture."""
        if observed.seconds < 0 or self.is_done:
            return np.zeros_like(observed.angles)
        now = observed.seconds
        q, w = self.placement.angles(observed.angles), self.placement.speeds(observed.speeds)
        if not self._is_there:
            return self._approach(now, observed, q)
        seconds = min(max(now - self._last, 0.0), LONGEST_S) if self._last >= 0 else 0.0
        self._last = now
        wanted = self._wanted(now)
        activations = self._activations(np.concatenate([q, w]), wanted, seconds)
        pulled = self.muscles.torques(activations, q, w, self.strength)
        shown = (len(self.held) + 1.0, *activations, *q, *wanted[:2], *self._integral)
        self.shown = tuple(float(value) for value in shown)
        self._judge(now, q, activations)
        asked = self.stiffness * (self._first - observed.angles) - self.damping * observed.speeds
        asked[list(PLANE)] = self.placement.robot_torques(pulled)[list(PLANE)]
        return np.asarray(asked)

    def _approach(self, now: float, observed: Observed, q: np.ndarray) -> np.ndarray:
        """Torques (3,) of the robot's own joints on the way of least jerk to the first posture; then muscles take over."""
        if self._start is None or now < self._last:
            self._start = observed.angles.copy()
        self._last = now
        way = self._first - self._start
        duration = 1.875 * float(np.abs(way).max()) / APPROACH  # its fastest is 1.875 times its mean speed
        share, rate = least_jerk(now, max(duration, LONGEST_S))
        if now >= duration + SETTLE_S:
            self._is_there, self._last = True, -1.0
            self._begin(now, q)
        place, speed = self._start + share * way, rate * way
        return np.asarray(self.stiffness * (place - observed.angles) + self.damping * (speed - observed.speeds))

    def _activations(self, state: np.ndarray, wanted: np.ndarray, seconds: float) -> np.ndarray:
        """Activations (6,), and the integrator a step further."""
        statics, capability = self.limb.torques(wanted)
        feedback = -self.feedback @ (state - wanted)
        torque = feedback - statics + self._integral
        activations = self.controller.allocate(torque, capability)
        lacking = torque - capability @ activations
        # Where the muscles cannot follow, the integrator only goes back.
        free = (np.abs(lacking) < UNBALANCED) | (feedback * lacking < 0)
        further = self._integral + self.plan.integral * seconds * feedback
        self._integral = np.where(free, np.clip(further, -MOST_INTEGRAL, MOST_INTEGRAL), self._integral)
        return activations

    def _begin(self, now: float, q: np.ndarray) -> None:
        self._begun, self._from = now, q.copy()
        self._judged = []

    def _wanted(self, now: float) -> np.ndarray:
        """Angles and speeds (4,) on the way of least jerk to the posture, then there."""
        way = np.array(self.plan.postures[len(self.held)]) - self._from
        share, rate = least_jerk(now - self._begun, self.plan.reach_s)
        return np.concatenate([self._from + share * way, rate * way])

    def _judge(self, now: float, q: np.ndarray, activations: np.ndarray) -> None:
        """Take in what counts, and go on to the next posture at the end of the hold."""
        until = self._begun + self.plan.reach_s + self.plan.hold_s
        if now >= until - self.plan.judged_s:
            self._judged.append(np.concatenate([q, activations]))
        if now < until:
            return
        mean, target = np.mean(self._judged, axis=0), self.plan.postures[len(self.held)]
        error = float(np.linalg.norm(mean[:2] - target))
        self.held.append(Held(target, (float(mean[0]), float(mean[1])), error, tuple(map(float, mean[2:]))))
        self._begin(now, np.array(target))


def least_jerk(passed: float, duration: float) -> tuple[float, float]:
    """Share of the way after a time in s, and its rate in 1/s (Flash and Hogan 1985); rests at the end."""
    s = min(max(passed / duration, 0.0), 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s**2), 30.0 * s**2 * (1.0 - s) ** 2 / duration
