"""The one way to a robot's torque: whoever commands one, a session or a coupled run, comes through here.

The same questions, refusals, recorder, watchdog and stop button for all of them.
"""

import json
import os
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fmus.errors import MisfitError
from hil.bus.wire import Wire, open_wire
from hil.control.abilities import Ending
from hil.control.pilot import Decision, Pilot
from hil.control.timing import RealTimer
from hil.recording.recorder import Recorder
from hil.robots.absent import refusals, unchecked, warning
from hil.robots.base import Robot
from hil.safety.rules import module_agrees
from hil.session.heartbeat import Heartbeat
from hil.session.loop import Loop, Summary, Wishes
from hil.session.recorded import ROBOT, SETTINGS, pilot_of
from hil.session.round_trip import measured, too_slow
from hil.session.watchdog import watchdog
from hil.settings import Settings
from hil.stop.flag import StopFlag
from hil.view.about import about, session_name
from hil.view.window import Window
from hil.virtual.direct_bus import DirectBus, VirtualTimer

# So long somebody has time to press Activate on the pendant after the operator's word; what is waited for is said after
# a moment.
PATIENCE_S, MOMENT_S = 60.0, 1.0
_NOT_ACTIVE = f"press Activate on the pendant; there are {PATIENCE_S:g} s for it"


@dataclass(frozen=True)
class Operator:
    """Who is asked: whether the arm is on its stops, whether it may be armed.

    `abort` and `confirm` are looked at in every cycle; `watch` is told of every decision and must not take long; `tell`
    says words on the screen.
    """

    at_home: Callable[[], bool]
    may_arm: Callable[[Robot], bool]
    abort: threading.Event = field(default_factory=threading.Event)
    confirm: threading.Event = field(default_factory=threading.Event)
    watch: Callable[[Pilot, Decision], None] = lambda pilot, decision: None
    tell: Callable[[str], None] = lambda words: None


@dataclass(frozen=True)
class Opened:
    """A robot that is started up and whose operator has been asked: `armed` says whether it may be armed."""

    settings: Settings
    pilot: Pilot
    loop: Loop
    timer: RealTimer | VirtualTimer
    recorder: Recorder | None
    armed: bool
    operator: Operator
    stop: StopFlag

    def run(self, seconds: float) -> Summary:
        """Cycle for so long after arming, or until the controller, the operator or a rule of the safety core ends it.

        Raises:
            MisfitError: if the robot answers too slowly.
        """
        self.refuse_slow()
        return self.loop.run(self.wishes(seconds))

    def refuse_slow(self) -> None:
        """Measure how long the robot takes to answer; right before the first cycle, as a robot that was spoken to expects more.

        Raises:
            MisfitError: if that is too slow for the rate.
        """
        wire, pilot = self.loop.wire, self.pilot
        if slow := too_slow(measured(wire, pilot.robot), pilot.limits):
            raise MisfitError(f"{wire.name}: {slow}")
        self.timer.start()

    def wishes(self, seconds: float) -> Callable[[], Wishes]:
        """Arm as soon as the safety module is active and all is well; abort when told; end when done, or so long after
        arming."""
        pilot, operator, stop, heartbeat, clock = (
            self.pilot,
            self.operator,
            self.stop,
            self.loop.heartbeat,
            self.loop.wire.now,
        )
        began = clock()
        armed: int | None = None if self.armed else began
        said = ""

        def wishes() -> Wishes:
            nonlocal armed, said
            now = clock()
            if armed is None and pilot.is_armed:
                armed = now
            if armed is None and now - began > MOMENT_S * 1e9 and not said:
                operator.tell(said := f"waiting to arm: {self.refusal}")
            over = now - began > PATIENCE_S * 1e9 if armed is None else now - armed > seconds * 1e9
            # A watchdog that is gone, or has let the arm go, does not come back.
            over |= armed is None and heartbeat is not None and not heartbeat.is_watched
            over |= isinstance(pilot.controller, Ending) and pilot.controller.is_done
            abort, confirm = operator.abort.is_set(), operator.confirm.is_set()
            if stop.is_pressed:
                abort = True
                stop.saw()
            operator.confirm.clear()
            return Wishes(arm=armed is None, abort=abort, over=over or (armed is None and abort), confirm=confirm)

        return wishes

    @property
    def refusal(self) -> str:
        """Why the arm is not armed; what its module has against that is cleared on the pendant."""
        refused = self.pilot.refused
        if refused is None or refused.rule != module_agrees.__name__:
            return _NOT_ACTIVE if refused is None else self.pilot.told(refused)
        return f"{refused}; {_NOT_ACTIVE}"

    def result(self, refused: list[str]) -> dict[str, Any]:
        """What the session came to, as `hil hold --json` says it.

        Args:
            refused: what the machine did not permit.
        """
        summary, pilot, heartbeat = self.loop.summary, self.pilot, self.loop.heartbeat
        silent_ns = summary.cycle_gap_ns if heartbeat is None else heartbeat.longest_ns
        if self.armed and not pilot.is_armed:
            summary.faults.append(f"the arm could not be armed: {self.refusal}")
        return {
            **nothing(self.settings),
            "cycles": summary.cycles,
            "missed": self.timer.missed,
            "answers_late": summary.answers_late,
            "frames_lost": summary.frames_lost,
            "lateness_us": summary.lateness.to_json(),
            "faults": summary.faults,
            "recording": str(self.recorder.folder) if self.recorder is not None else None,
            "not_permitted": refused,
            "slow_cycles": pilot.slow_cycles,
            "round_trip_us": pilot.round_trip.to_json(),
            "largest_gap_ms": {
                "cycles": round(summary.cycle_gap_ns * 1e-6, 3),
                "torque_frames": round(summary.torque_gap_ns * 1e-6, 3),
                "signs": round(silent_ns * 1e-6, 3),
                "limit": self.settings.limits.stall_s * 1e3,
            },
            "without": list(self.settings.waived),
        }


def nothing(settings: Settings) -> dict[str, Any]:
    """What can be said of a session that did not come to its end."""
    return {"schema": "misfit.hil/1", "rate_hz": 1e9 / settings.limits.period_ns}


@contextmanager
def open_robot_session(
    settings: Settings,
    operator: Operator,
    folder: Path | None,
    stop: StopFlag,
    *,
    dry_run: bool = False,
    asked: Callable[[], tuple[float, ...] | None] = lambda: None,
    inside: DirectBus | None = None,
) -> Iterator[Opened]:
    """Bring a robot up to where it can be armed, with everything that watches over it.

    Args:
        folder: where to record.
        stop: the button.
        asked: what a program beside the session asks for, for the controller `asked`.
        inside: a virtual robot in this process, instead of the settings' bus: its time is virtual, and there is no watchdog.

    Raises:
        MisfitError: if the bus, the robot or the settings do not fit, or a safeguard is missing.
        ComponentError: if bus, recorder or watchdog fail.
    """
    kind = settings.kind
    with ExitStack() as stack:
        heartbeat: Heartbeat | None = None
        timer: RealTimer | VirtualTimer
        sleep: Callable[[float], None]
        if inside is None:
            limit_s = settings.limits.stall_s
            heartbeat = stack.enter_context(watchdog(settings.bus, limit_s, dry_run=dry_run, frames=kind.stop()))
            wire, sleep = open_wire(settings.bus, kind.torque_identifiers), time.sleep
            timer = RealTimer(settings.limits.period_ns, heartbeat.beat_and_look)
        else:
            wire, sleep = Wire(inside, kind.torque_identifiers, "virtual robot", inside.now), inside.sleep
            timer = VirtualTimer(inside, settings.limits.period_ns)
        stack.callback(wire.close)
        recorder = _recorder(folder, settings)
        if recorder is not None:
            wire.tap = recorder.frame
            stack.callback(recorder.finish)
        robot = kind.start_up(wire, sleep, operator.at_home)
        _refuse(wire, robot, settings)
        wire.hear_only(kind.heard)
        for words in (warning(settings.waived), unchecked(settings.limits)):
            if words:
                operator.tell(words)
        armed = operator.may_arm(robot)
        if recorder is not None:
            (recorder.folder / ROBOT).write_text(json.dumps(robot.to_json(), indent=2) + "\n")
        pilot = pilot_of(robot, settings)
        window = Window.create(settings.limits.period_ns, about(settings, pilot, folder, stop.path, dry_run))
        stack.callback(window.remove)
        loop = Loop(
            wire,
            pilot,
            timer,
            recorder,
            heartbeat,
            dry_run=dry_run,
            watch=lambda start_ns, decision: operator.watch(pilot, decision),
            window=window,
            asked=asked,
        )
        stop.stops(session_name(settings, os.getpid()))
        yield Opened(settings, pilot, loop, timer, recorder, armed, operator, stop)
        stop.finish()


def _refuse(wire: Wire, robot: Robot, settings: Settings) -> None:
    """Refuse a robot that lacks a safeguard, or whose module allows less than the session.

    Raises:
        MisfitError: with all reasons.
    """
    found = refusals(robot, settings.waived)
    found += robot.looser_limits(wire, settings.limits)
    if found:
        raise MisfitError(f"{wire.name}: {'; '.join(found)}")


def _recorder(folder: Path | None, settings: Settings) -> Recorder | None:
    if folder is None:
        return None
    recorder = Recorder(folder)
    (folder / SETTINGS).write_text(json.dumps(settings.to_json(), indent=2) + "\n")
    return recorder
