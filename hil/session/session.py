"""A session from the open bus to the finished recording."""

import json
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from fmus.errors import ComponentError, MisfitError
from hil.bus.gate import TORQUE_IDENTIFIERS
from hil.bus.wire import Wire, open_wire
from hil.codecs.barrett.identifiers import Node
from hil.errors import BusError
from hil.recording.recorder import Recorder
from hil.safety.limits import Limits
from hil.session.controllers import Ending
from hil.session.loop import Loop, Summary, Wishes
from hil.session.module_limits import looser_than
from hil.session.pilot import Decision, Pilot
from hil.session.recorded import ROBOT, SETTINGS, finish_session, pilot_of
from hil.session.settings import Settings
from hil.session.start_up import Robot, must, start_up
from hil.session.timing import Metronome, real_time_priority
from hil.session.watchdog import watchdog
from hil.stop.flag import StopFlag
from hil.stop.server import stop_button
from hil.view.about import about
from hil.view.window import Window

# So long somebody has time to press Activate on the pendant after the operator's word.
PATIENCE_S = 60.0


@dataclass(frozen=True)
class Operator:
    """Who is asked: whether the arm is on its stops, whether it may be armed.

    `abort` and `confirm` are looked at in every cycle; `watch` is told of every decision and must not take long.
    """

    at_home: Callable[[], bool]
    may_arm: Callable[[Robot], bool]
    abort: threading.Event = field(default_factory=threading.Event)
    confirm: threading.Event = field(default_factory=threading.Event)
    watch: Callable[[Pilot, Decision], None] = lambda pilot, decision: None


class BrokenSession(BusError):
    """A bus that broke while a session was cycling, without anybody having stopped it; what was recorded is finished."""


def run_session(
    settings: Settings, seconds: float, operator: Operator, folder: Path | None, *, dry_run: bool = False
) -> dict[str, Any]:
    """Hold the arm, or what the settings' controller does, for a time; returns what `hil hold --json` says.

    What was recorded until a bus broke is finished as well.

    Raises:
        MisfitError: if the bus, the robot or the settings do not fit.
        BrokenSession: if the bus breaks while nobody has stopped the session.
        ComponentError: if it breaks otherwise, or records are lost.
    """
    # The button outlives the loop: while files are written it says that the arm has been let go. So do the handlers of
    # signals: an impatient second Ctrl-C must not leave half of the files.
    with ExitStack() as until_written:
        stop = until_written.enter_context(stop_button())
        is_new = folder is not None and not (folder / ROBOT).exists()
        try:
            document = _cycles(settings, seconds, operator, folder, stop, until_written, dry_run)
        except ComponentError as error:
            if folder is None or not (is_new and (folder / ROBOT).exists()):
                raise
            finish_session(folder, {**_nothing(settings), "faults": [str(error)], "recording": str(folder)})
            was_running = isinstance(error, BusError) and not operator.abort.is_set() and not stop.is_pressed
            kind = BrokenSession if was_running else ComponentError
            raise kind(f"{error}; what was recorded until then is in {folder}") from error
        if folder is not None:
            finish_session(folder, document)
    return document


def _cycles(
    settings: Settings,
    seconds: float,
    operator: Operator,
    folder: Path | None,
    stop: StopFlag,
    until_written: ExitStack,
    dry_run: bool,
) -> dict[str, Any]:
    """From the open bus to the last torque; what goes on until files are written is entered into that stack."""
    with ExitStack() as stack:
        heart = stack.enter_context(watchdog(settings.bus, dry_run=dry_run))
        wire = open_wire(settings.bus, TORQUE_IDENTIFIERS)
        stack.callback(wire.close)
        recorder = _recorder(folder, settings)
        if recorder is not None:
            wire.tap = recorder.frame
            stack.callback(recorder.finish)
        robot = start_up(wire, settings.side, time.sleep, operator.at_home)
        _refuse_looser(wire, robot, settings.limits)
        armed = operator.may_arm(robot)
        if recorder is not None:
            (recorder.folder / ROBOT).write_text(json.dumps(_robot_json(robot), indent=2) + "\n")
        pilot = pilot_of(robot, settings)
        until_written.enter_context(_signals(operator.abort))
        refused = stack.enter_context(real_time_priority())
        beats = Metronome(settings.limits.period_ns)
        window = Window.create(settings.limits.period_ns, about(settings, pilot, folder, stop.path, dry_run))
        stack.callback(window.remove)
        loop = Loop(
            wire,
            pilot,
            beats,
            recorder,
            heart,
            dry_run=dry_run,
            watch=lambda start_ns, decision: operator.watch(pilot, decision),
            window=window,
        )
        summary = loop.run(_wishes(seconds, armed, pilot, operator, stop))
        stop.finish()
        if armed and not pilot.is_armed:
            said = f" ({pilot.controller_error})" if pilot.controller_error else ""
            summary.faults.append(f"the arm could not be armed: {pilot.refused}{said}")
        return {**_result(settings, summary, beats.missed, recorder, refused), "slow_cycles": pilot.slow_cycles}


def _refuse_looser(wire: Wire, robot: Robot, limits: Limits) -> None:
    """Only a session whose limits are tighter than the module's is armed.

    Raises:
        MisfitError: if one is looser, or the module has none.
    """
    if robot.module is None:
        return
    torque, speed = (must(wire, Node.SAFETY, name, robot.module) for name in ("TL2", "VL2"))
    if found := looser_than(limits.joints, robot.torque_units, torque, speed):
        raise MisfitError(f"{wire.name}: {'; '.join(found)}")


def _recorder(folder: Path | None, settings: Settings) -> Recorder | None:
    if folder is None:
        return None
    recorder = Recorder(folder)
    (folder / SETTINGS).write_text(json.dumps(settings.to_json(), indent=2) + "\n")
    return recorder


def _robot_json(robot: Robot) -> dict[str, Any]:
    return {**asdict(robot), "motor": dict(robot.motor)}


def _wishes(seconds: float, arm: bool, pilot: Pilot, operator: Operator, stop: StopFlag) -> Callable[[], Wishes]:
    """Arm as soon as the safety module is active and all is well; abort when told; end when done, or so long after arming."""
    began = time.monotonic()
    armed: float | None = None if arm else began

    def wishes() -> Wishes:
        nonlocal armed
        now = time.monotonic()
        if armed is None and pilot.is_armed:
            armed = now
        over = now - began > PATIENCE_S if armed is None else now - armed > seconds
        over |= isinstance(pilot.controller, Ending) and pilot.controller.is_done
        abort, confirm = operator.abort.is_set(), operator.confirm.is_set()
        if stop.is_pressed:
            abort = True
            stop.saw()
        operator.confirm.clear()
        return Wishes(arm=armed is None, abort=abort, over=over or (armed is None and abort), confirm=confirm)

    return wishes


@contextmanager
def _signals(abort: threading.Event) -> Iterator[None]:
    """Ctrl-C, a closed terminal and a polite kill let the arm down instead of dropping it; later ones wait for the files."""
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

    def stop(number: int, frame: object) -> None:
        if abort.is_set():
            with suppress(OSError):  # a terminal that was closed
                os.write(2, b"the arm is being let go and the recording written; that takes a few seconds\n")
        abort.set()

    before = {number: signal.signal(number, stop) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _nothing(settings: Settings) -> dict[str, Any]:
    """What can be said of a session that did not come to its end."""
    return {"schema": "misfit.hil/1", "rate_hz": 1e9 / settings.limits.period_ns}


def _result(
    settings: Settings, summary: Summary, missed: int, recorder: Recorder | None, refused: list[str]
) -> dict[str, Any]:
    return {
        **_nothing(settings),
        "cycles": summary.cycles,
        "missed": missed,
        "answers_late": summary.answers_late,
        "frames_lost": summary.frames_lost,
        "lateness_us": summary.lateness.to_json(),
        "faults": summary.faults,
        "recording": str(recorder.folder) if recorder is not None else None,
        "not_permitted": refused,
    }
