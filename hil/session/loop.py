"""The loop of a session: wait, ask, listen, decide, send, record."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

from hil.bus.wire import Wire
from hil.codecs.frame import Frame, Timed
from hil.control.pilot import CycleInput, Decision, Pilot
from hil.control.timing import Lateness
from hil.recording.recorder import Recorder
from hil.safety.rules import not_aborted, recorded, watched
from hil.session.heartbeat import Heartbeat
from hil.view.window import Window


class CycleTimer(Protocol):
    """When cycles begin."""

    missed: int

    def wait(self) -> tuple[int, int]:
        """Wait for the next cycle; returns when it is due and the time now (ns)."""
        ...


class Wishes(NamedTuple):
    """What the operator wants in this cycle."""

    arm: bool = False
    abort: bool = False
    over: bool = False
    confirm: bool = False


@dataclass
class Summary:
    """What a session came to; late answers came after the cycle that had asked, lost ones not at all."""

    cycles: int = 0
    answers_late: int = 0
    frames_lost: int = 0
    # The longest times (ns) between the beginnings of two cycles, and between two torque frames.
    cycle_gap_ns: int = 0
    torque_gap_ns: int = 0
    lateness: Lateness = field(default_factory=Lateness)
    faults: list[str] = field(default_factory=list)


class Loop:
    """Runs a pilot on a wire.

    Args:
        dry_run: decide and record everything, send no torque.
        watch: told of every decision; it must not take long.
        window: where the loop shows itself to a live view.
        asked: what a program beside the loop asks for in N.m; None while it does not.
    """

    def __init__(
        self,
        wire: Wire,
        pilot: Pilot,
        timer: CycleTimer,
        recorder: Recorder | None = None,
        heartbeat: Heartbeat | None = None,
        *,
        dry_run: bool = False,
        watch: Callable[[int, Decision], None] = lambda start_ns, decision: None,
        window: Window | None = None,
        asked: Callable[[], tuple[float, ...] | None] = lambda: None,
    ) -> None:
        self.wire, self.pilot, self.timer, self.recorder, self.heartbeat = wire, pilot, timer, recorder, heartbeat
        self.dry_run, self.watch, self.window = dry_run, watch, window
        self._last_cycle_ns = self._last_torque_ns = 0
        self.asked = asked
        self._late_ns = 0
        self._computing_ns = 0
        self._letting_down = False
        self.summary = Summary()

    def run(self, wishes: Callable[[], Wishes]) -> Summary:
        """Cycle until the wishes say that it is over, or a rule has stopped the arm; then let it down and go."""
        self.begin()
        try:
            while not (wish := wishes()).over and not self.pilot.is_over:
                self.cycle(wish)
        finally:
            self.end()
        return self.summary

    def begin(self) -> None:
        """Forget what waits on the bus; the next frames are those of cycles."""
        self.wire.drain()
        self._last_cycle_ns = self._last_torque_ns = 0
        if self.recorder is not None:
            self.recorder.begin(self.wire.now())

    def cycle(self, wish: Wishes) -> None:
        """Wait until the next cycle is due and do it."""
        due, now = self.timer.wait()
        self._late_ns = now - due
        self.summary.lateness.add(self._late_ns)
        self._cycle(wish)
        self.summary.cycles += 1
        self._tally()
        trip = self.pilot.stopped
        if trip is None or not self.pilot.is_armed or (self._letting_down and trip.rule == not_aborted.__name__):
            return
        words = self.pilot.told(trip)
        if trip.rule == recorded.__name__ and self.recorder is not None and self.recorder.trouble:
            words = f"{words} ({self.recorder.trouble})"
        if trip.rule == watched.__name__ and self.heartbeat is not None:
            words += self.heartbeat.stood_still(self.wire.now())
        if words not in self.summary.faults:
            self.summary.faults.append(words)

    def end(self) -> None:
        """Let the arm down; whatever goes wrong, the last torque on the bus is none."""
        self._letting_down = True
        try:
            while self.pilot.is_armed and not self.pilot.is_over:
                self.cycle(Wishes(abort=True))
        finally:
            self._cycle(Wishes(abort=True, over=True))
            self._tally()

    def _tally(self) -> None:
        """Count answers in every cycle: a bus that breaks in the last one must not leave them uncounted."""
        self.summary.answers_late = self.pilot.late_answers
        self.summary.frames_lost = self.pilot.missing_answers - self.pilot.late_answers

    def _cycle(self, wish: Wishes) -> None:
        # What waits on the bus answers an earlier question; what comes after this moment answers this one.
        frames = self.wire.drain()
        start_ns = self.wire.now()
        if self.heartbeat is not None:
            self.heartbeat.beat(start_ns)
        if self._last_cycle_ns:
            self.summary.cycle_gap_ns = max(self.summary.cycle_gap_ns, start_ns - self._last_cycle_ns)
        self._last_cycle_ns = start_ns
        self.wire.send(*self.pilot.requests(frames))
        frames += self._answers(start_ns)
        recording = self.recorder is None or self.recorder.keeps_up()
        silent = self.heartbeat is not None and self.heartbeat.is_watchdog_silent(self.wire.now())
        watched = self.heartbeat is None or (self.heartbeat.is_watched and not silent)
        wishes = (wish.arm, wish.abort, recording, wish.over, watched, wish.confirm, silent, self.asked())
        given = CycleInput(start_ns, frames, self._computing_ns, *wishes)
        if self.recorder is not None:
            self.recorder.cycle(given)
        # By the clock of the session: where time is virtual, a busy machine must not look like a slow controller.
        began = self.wire.now()
        decision = self.pilot.decide(given)
        self._computing_ns = self.wire.now() - began
        self._send(decision.frames)
        self.watch(start_ns, decision)
        if self.window is not None:
            self.window.put(start_ns, self._late_ns, self.timer.missed, self.pilot, decision)

    def _answers(self, start_ns: int) -> list[Timed]:
        """Frames until all answers are there, or time is up."""
        deadline = start_ns + self.pilot.listen_ns
        awaited, found = set(self.pilot.awaited), []
        while awaited and (left := deadline - self.wire.now()) > 0:
            timed = self.wire.receive(left * 1e-9)
            if timed is None:
                break
            found.append(timed)
            awaited.discard(timed.frame.identifier)
        return found

    def _send(self, frames: list[Frame]) -> None:
        for frame in frames:
            if self.recorder is not None:
                self.recorder.decided(Timed(self.wire.now(), frame))
            if not self.dry_run:
                self.wire.send_decided(frame)
        if frames:
            now = self.wire.now()
            if self._last_torque_ns:
                self.summary.torque_gap_ns = max(self.summary.torque_gap_ns, now - self._last_torque_ns)
            self._last_torque_ns = now
