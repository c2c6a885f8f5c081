"""The decision of a cycle, from its frames alone: the same live, in a dry run and in replay."""

import math
from collections.abc import Collection, Sequence
from typing import Final

import numpy as np

from fmus.errors import MisfitError
from hil.codecs.frame import Frame, Timed
from hil.control.abilities import Modelling, Pausing, Showing
from hil.control.controllers import Controller, Observed
from hil.control.proof import Proof
from hil.control.timing import Lateness
from hil.record import Record, replaced
from hil.robots.base import Reading, Robot
from hil.safety.core import begin, step
from hil.safety.cycle import Outcome, Reaction, Seen, State, Trip, Vector
from hil.safety.limits import Limits
from hil.safety.motion import follow
from hil.safety.rules import SLOW_SHARE, finite_command

_NO_FORCE: Final = (0.0, 0.0, 0.0)


class CycleInput(Record):
    """All that a decision depends on; a recording holds exactly this.

    `start_ns` is when the cycle asked for positions (monotonic), `frames` what came since the last cycle listened,
    `computing_ns` what the controller took in the cycle before, `asked` N.m what somebody outside asks for, None while
    nobody does; the rest are wishes of the operator, and whether recorder and watchdog are content.
    """

    def __init__(
        self,
        start_ns: int,
        frames: Sequence[Timed],
        computing_ns: int = 0,
        arm: bool = False,
        abort: bool = False,
        recording: bool = True,
        end: bool = False,
        watched: bool = True,
        confirm: bool = False,
        watchdog_silent: bool = False,
        asked: tuple[float, ...] | None = None,
    ) -> None:
        self.start_ns = start_ns
        self.frames = frames
        self.computing_ns = computing_ns
        self.arm = arm
        self.abort = abort
        self.recording = recording
        self.end = end
        self.watched = watched
        self.confirm = confirm
        self.watchdog_silent = watchdog_silent
        self.asked = asked


class Decision(Record):
    """What a cycle sends, and what was known when that was decided.

    `passed` (3,) N.m is what the core let pass of the torque `asked` for, without the part that holds the weight;
    `shown` are the controller's own signals.
    """

    def __init__(
        self,
        frames: list[Frame],
        outcome: Outcome,
        observed: Observed,
        asked: Vector,
        passed: Vector,
        shown: tuple[float, ...] = (),
    ) -> None:
        self.frames = frames
        self.outcome = outcome
        self.observed = observed
        self.asked = asked
        self.passed = passed
        self.shown = shown


class Pilot:
    """Turns the frames of a cycle into the frames of a decision; has no clock and no bus.

    Args:
        gravity: whether the arm's weight is held; a robot whose joints are vertical has none to hold.
        proof: what an armed arm has to prove before the controller gets it.
        waived: safeguards that this bench may do without, see `hil.robots.absent`.
        force_axes: (3, 3), turns what the force sensor shows into the wrist's axes and N; as it is without them.
    """

    def __init__(
        self,
        robot: Robot,
        limits: Limits,
        controller: Controller,
        *,
        gravity: bool = True,
        proof: Proof | None = None,
        force_axes: np.ndarray | None = None,
        waived: Collection[str] = (),
    ) -> None:
        self.proof = proof
        # Who asked for torques last, how many have taken over so far, and when the last of them did.
        self._asking: tuple[object, int] = (None, 0)
        self._takeovers, self._taken_ns = 0, 0
        self.robot, self.limits, self.controller, self.gravity = robot, limits, controller, gravity
        self._showing = controller if isinstance(controller, Showing) else None
        # What a controller can do is looked at once: that takes longer than all rules of the core.
        self._looked_at: object = None
        self._modelling: Modelling | None = None
        self._pausing: Pausing | None = None
        self.link = robot.link(limits, waived, np.eye(3) if force_axes is None else force_axes)
        self.state: State | None = None
        self.cycle = 0
        # How old the positions of each cycle were when they came, from their question on.
        self.round_trip = Lateness()
        # Decisions that took more than their share of the period, so that the next cycle began late or may have.
        self.slow_cycles = 0
        self.controller_error = ""
        # The trip for which the arm was not armed when somebody last wanted that; None if the module alone did not let it.
        self.refused: Trip | None = None
        self._unsure: tuple[int, ...] = (0,) * len(limits.joints)

    def requests(self, arrived: Sequence[Timed] = ()) -> list[Frame]:
        """What a cycle asks for at its beginning; `arrived` are the frames that have come since the last one."""
        return self.link.requests(arrived)

    @property
    def awaited(self) -> frozenset[int]:
        """Identifiers that a decision needs."""
        return self.link.awaited

    @property
    def listen_ns(self) -> int:
        """How long answers are waited for."""
        return self.link.listen_ns

    @property
    def missing_answers(self) -> int:
        """Questions for positions that were not answered in time."""
        return self.link.missing_answers

    @property
    def late_answers(self) -> int:
        """Those of them that were answered later."""
        return self.link.late_answers

    def decide(self, given: CycleInput) -> Decision:
        """Decide what to send."""
        self.slow_cycles += given.computing_ns > SLOW_SHARE * self.limits.period_ns
        reading = self.link.read(given.start_ns, given.frames)
        if reading.age_ns is not None:
            self.round_trip.add(reading.age_ns)
        if self.state is None:
            positions = tuple([0.0 if q is None else q for q in reading.positions])
            self.state = begin(self.limits, given.start_ns - self.limits.period_ns, positions)
            self.state = replaced(self.state, unsure=self._unsure)
        # The controller sees what the core believes, never a raw answer.
        motion = follow(self.limits, self.state, given.start_ns, reading.positions, reading.doubted)
        q, w, armed = motion.positions, motion.speeds, self.state.armed_ns
        seconds = -1.0 if armed is None else (given.start_ns - armed) * 1e-9
        force, fresh = reading.force or _NO_FORCE, not any(motion.missing)
        observed = Observed(seconds, q, w, force, self.state.active, given.confirm, fresh, given.asked)
        asked = self._ask(observed, given.start_ns)
        support = _plain(self.robot.holding_torques(q)) if self.gravity else (0.0,) * len(q)
        seen = _seen(given, reading, asked, support, self._unmodelled(), self._takeovers)
        self.state, outcome = step(self.limits, self.state, seen, motion=motion)
        self.cycle += 1
        passed = self.state.active
        frames = self.link.frames(outcome, self.is_armed)
        if not self.is_armed:
            if given.arm:
                self.refused = max(outcome.trips, key=lambda trip: trip.reaction) if outcome.trips else None
            if outcome.trips:
                # Nothing is worth remembering of an arm that was never energised; a first position may have been wrong.
                self._unsure, self.state = self.state.unsure, None
        shown = self._showing.shown if self._showing is not None else ()
        return Decision(frames, outcome, observed, asked, passed, shown)

    @property
    def is_armed(self) -> bool:
        """Whether the arm was armed at some time."""
        return self.state is not None and self.state.armed_ns is not None

    @property
    def is_ready(self) -> bool:
        """Whether the arm is armed and has proved what it has to, so that the controller asks for torques."""
        return self.is_armed and (self.proof is None or self.proof.is_done)

    @property
    def stopped(self) -> Trip | None:
        """Why the arm is stopped; None while it is not."""
        return self.state.stopped if self.state is not None else None

    def told(self, trip: Trip) -> str:
        """What an operator is told of a trip: the error of whoever asked for torques, not that its torques are no numbers."""
        if trip.rule == finite_command.__name__ and self.controller_error:
            return f"{trip.rule}: {self.controller_error}"
        return str(trip)

    @property
    def is_over(self) -> bool:
        """Whether the arm was let go, or gives way without anything left of what was asked."""
        state = self.state
        if state is None or state.stopped is None or not self.is_armed:
            return False
        return state.reaction >= Reaction.RELEASE or state.fading == 0.0

    def _ask(self, observed: Observed, now_ns: int) -> Vector:
        """What the controller asks for; one that raises asks for what is no number, which the core does not let pass."""
        is_proving = self.proof is not None and observed.seconds >= 0 and not self.proof.is_done
        try:
            if is_proving and self.proof is not None:
                self._take_over(self.proof, 0, now_ns)
                return _plain(self.proof.torque(observed))
            self._take_over(self.controller, self._turn(), now_ns)
            since = (now_ns - self._taken_ns) * 1e-9
            if 0 <= since < observed.seconds:
                force, sent = observed.f, observed.tau
                observed = Observed(
                    since, observed.q, observed.w, force, sent, observed.confirm, observed.fresh, observed.asked
                )
            asked = _plain(self.controller.torque(observed))
            self._take_over(self.controller, self._turn(), now_ns)  # it may just have begun again
            return asked
        except BaseException as error:  # a user's own class may raise anything, and end the process as well
            is_plain = isinstance(error, MisfitError)
            self.controller_error = str(error) if is_plain else f"the controller raised {type(error).__name__}: {error}"
            return (math.nan,) * len(self.limits.joints)

    def _unmodelled(self) -> tuple[float, ...] | None:
        """What the controller's model of the arm leaves unexplained; nothing is known while somebody else asks for torques."""
        return (
            self._modelling.unmodelled if self._modelling is not None and self._asking[0] is self.controller else None
        )

    def _turn(self) -> int:
        """How often the controller has begun to ask; 0 of one that does not pause."""
        controller = self.controller
        if controller is not self._looked_at:
            self._looked_at = controller
            self._modelling = controller if isinstance(controller, Modelling) else None
            self._pausing = controller if isinstance(controller, Pausing) else None
        return self._pausing.turn if self._pausing is not None else 0

    def _take_over(self, asking: object, turn: int, now_ns: int) -> None:
        """Note who asks, and when somebody else begins to: its torque comes up along the ramp."""
        if asking is not self._asking[0] or turn != self._asking[1]:
            self._asking = asking, turn
            self._takeovers += 1
            self._taken_ns = now_ns


def _plain(torques: np.ndarray | Vector) -> Vector:
    """Torques as plain numbers, whatever a controller gave."""
    if isinstance(torques, tuple):
        return tuple([float(torque) for torque in torques])
    return tuple(np.asarray(torques, dtype=float).ravel().tolist())


def _seen(
    given: CycleInput, reading: Reading, asked: Vector, support: Vector, unmodelled: Vector | None, controller: int
) -> Seen:
    """What the core is shown of a cycle."""
    return Seen(
        time_ns=given.start_ns,
        positions=reading.positions,
        doubted=reading.doubted,
        asked=asked,
        support=support,
        computing_ns=given.computing_ns,
        force=reading.force,
        force_saturated=reading.force_saturated,
        force_missing_ns=reading.force_missing_ns,
        sensor=reading.sensor,
        temperatures=reading.temperatures,
        module=reading.module,
        warning=reading.warning,
        fault=reading.fault,
        foreign_torque=reading.foreign_torque,
        trouble=reading.trouble,
        recording=given.recording,
        abort=given.abort,
        end=given.end,
        watched=given.watched,
        watchdog_silent=given.watchdog_silent,
        arm=given.arm,
        unmodelled=unmodelled,
        controller=controller,
    )
