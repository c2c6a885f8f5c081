"""What a session of trials asks for: postures that are held between trials, and the emulated arm's muscles within them."""

import numpy as np

from hil.control.abilities import Shown
from hil.control.controllers import Observed
from hil.emulation.anatomy import anatomy
from hil.emulation.corrections import Corrections
from hil.emulation.muscles import Muscles
from hil.emulation.planar import PLANE, Placement
from hil.emulation.residual import Residual
from hil.emulation.settings import MUSCLES, Learning
from hil.trials.phases import Course, Phase
from hil.trials.protocol import Protocol

_PAIRS = (
    ("arm_q", "rad", "angle of the emulated arm's joint {}"),
    ("arm_w", "rad/s", "speed of the emulated arm's joint {}"),
    ("pull", "N", "force on the wrist along {} of the emulated arm's world"),
    ("muscle_tau", "N.m", "torque of the muscles at joint {}"),
    ("residual", "N.m", "torque at joint {} that the model does not know, live"),
    ("residual_sd", "N.m", "standard deviation of that of joint {}"),
    ("learned", "N.m", "torque at joint {} that has been learned to be missing"),
)
SIGNALS = (
    Shown("trial", "1", "number of the trial, from 1"),
    Shown("phase", "1", "0 move, 1 settle, 2 announce, 3 stimulate, 4 return, 5 done"),
    *(Shown(f"alpha_{k}", "1", f"activation of muscle {k}") for k in range(1, MUSCLES + 1)),
    *(Shown(f"{name}{k}", unit, words.format(k)) for name, unit, words in _PAIRS for k in (1, 2)),
    Shown("unsure", "N.m", "standard deviation of what has been learned, as it was lately"),
)
# The uncertainty costs as much as all else that is learned, and changes slowly: it is asked for once in so many cycles.
UNSURE_EVERY = 25
# A residual is believed as far as it exceeds so many of its standard deviations.
SURE = 2.0


class Trials:
    """Runs a protocol on the emulated arm; the caregiver's push and the muscles meet at the robot's joints.

    Args:
        stiffness, damping: of the robot's joints (3,), N.m/rad and N.m.s/rad, between trials; joint 1 is always held.
        learning: how what the model lacks is learned while the session runs.
    """

    signals = SIGNALS

    def __init__(
        self,
        protocol: Protocol,
        placement: Placement,
        stiffness: np.ndarray,
        damping: np.ndarray,
        learning: Learning | None = None,
    ) -> None:
        self.placement, self.stiffness, self.damping = placement, stiffness, damping
        self.anatomy = anatomy()
        self.muscles, self.strength = Muscles(self.anatomy), np.array(protocol.strength)
        self.learning = learning or Learning()
        self.residual = Residual(self.anatomy, self.learning)
        self.corrections = Corrections(self.learning)
        self.course = Course(protocol, placement)
        self.shown = (0.0,) * len(SIGNALS)
        self.unmodelled: tuple[float, ...] | None = None
        self._last = -1.0
        self._cycle, self._unsure = 0, 0.0

    @property
    def is_done(self) -> bool:
        """Whether the last trial is over."""
        return self.course.phase is Phase.DONE

    def torque(self, observed: Observed) -> np.ndarray:
        """Joint torques (3,) in N.m; none before the arm is armed."""
        if observed.seconds < 0:
            return np.zeros_like(observed.angles)
        course, now = self.course, observed.seconds
        course.advance(now, observed.angles, observed.confirm)
        q, w = self.placement.angles(observed.angles), self.placement.speeds(observed.speeds)
        pull = self.placement.world_force(observed.force, q)
        learned = self._disagreement(observed, q, w, pull)
        alpha = course.activations(now)
        pulled = np.zeros(2)
        asked = self._held(observed)
        if course.phase is Phase.STIMULATE:
            pulled = self.muscles.torques(alpha, q, w, self.strength)
            emulated = self.placement.robot_torques(pulled - self.learning.share * learned)
            asked[list(PLANE)] = emulated[list(PLANE)]
        parts = (alpha, q, w, pull, pulled, self.residual.torque, self.residual.deviation, learned)
        if self._cycle % UNSURE_EVERY == 0:
            self._unsure = self.corrections.uncertainty(q, w)
        self._cycle += 1
        self.shown = (float(course.trial), float(course.phase), *np.concatenate(parts).tolist(), self._unsure)
        return asked

    def _held(self, observed: Observed) -> np.ndarray:
        """Torques (3,) that keep the robot on its way from posture to posture."""
        posture, speeds = self.course.desired(observed.seconds)
        return np.asarray(self.stiffness * (posture - observed.angles) + self.damping * (speeds - observed.speeds))

    def _disagreement(self, observed: Observed, q: np.ndarray, w: np.ndarray, pull: np.ndarray) -> np.ndarray:
        """Follow the residual and learn from it; returns the torque (2,) in N.m that has been learned so far."""
        seconds = observed.seconds - self._last if self._last >= 0 else 0.0
        self._last = observed.seconds
        self.residual.advance(q, w, self.placement.speeds(observed.sent), pull, seconds, observed.fresh)
        self.corrections.advance(self.residual, q, seconds, self.course.phase is Phase.STIMULATE)
        learned = self.corrections.predict(q, w)
        left = self.residual.torque - learned
        sure = np.maximum(np.abs(left) - SURE * self.residual.deviation, 0.0)
        self.unmodelled = tuple(self.placement.robot_torques(np.copysign(sure, left)).tolist())
        return learned
