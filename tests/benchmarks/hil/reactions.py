"""How soon the arm is made safe: watchdog, abort in all its ways, and controllers that take too long."""

import multiprocessing
import os
import signal
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from hil.bus.gate import TORQUES
from hil.codecs.barrett.safety_module import Button
from hil.codecs.barrett.torques import pack_torques
from hil.codecs.frame import Frame
from hil.control.controllers import Observed
from hil.control.pilot import Decision
from hil.control.timing import real_time_priority
from hil.safety.cycle import Reaction
from hil.session.heartbeat import Heartbeat
from hil.session.loop import Loop, Wishes
from hil.session.watchdog import watchdog
from hil.virtual.process import virtual_robot
from tests.hil.bench import Bench, ExactTimer

_WAYS = ("frozen with SIGSTOP", "killed with SIGKILL", "hangs in a busy loop")


def watchdog_reactions(trials: int) -> dict[str, tuple[list[float], int]]:
    """Times in ms from the last heartbeat to the watchdog's reaction, by what happened to the loop; and false trips."""
    found = {}
    with virtual_robot() as settings:
        for way in _WAYS:
            times, false_trips = [], 0
            for _ in range(trials):
                with watchdog(settings) as heartbeat:
                    times.append(_reaction(heartbeat, way))
                    false_trips += times[-1] < 0
            found[way] = ([t for t in times if t >= 0], false_trips)
    return found


def _reaction(heartbeat: Heartbeat, way: str) -> float:
    context = multiprocessing.get_context("fork")
    hang = context.Event()
    loop = context.Process(target=_beat, args=(heartbeat.path, hang), daemon=True)
    loop.start()
    time.sleep(0.3)
    if heartbeat.tripped_ns:
        os.kill(loop.pid or 0, signal.SIGKILL)
        return -1.0
    if way == _WAYS[2]:
        hang.set()
    else:
        os.kill(loop.pid or 0, signal.SIGSTOP if way == _WAYS[0] else signal.SIGKILL)
    end = time.monotonic() + 5
    while not heartbeat.tripped_ns and time.monotonic() < end:
        time.sleep(0.001)
    reaction = (heartbeat.tripped_ns - heartbeat.last_ns) * 1e-6
    os.kill(loop.pid or 0, signal.SIGKILL)
    loop.join()
    return reaction


def _beat(path: Path, hang) -> None:  # type: ignore[no-untyped-def]
    heartbeat = Heartbeat(path)
    with real_time_priority():
        while True:
            heartbeat.beat(time.monotonic_ns())
            if hang.is_set():
                while True:
                    pass
            time.sleep(0.002)


class _Raises:
    """Works for a while, then raises."""

    broken = False

    def torque(self, observed: Observed) -> np.ndarray:
        """Raise, once told so."""
        if self.broken:
            raise RuntimeError("a mistake of the user's")
        return np.zeros(3)


def _lost(bench: Bench, controller: _Raises) -> None:
    bench.faults.towards_host.append(lambda timed: [])


ABORTS: dict[str, tuple[Callable[[Bench, _Raises], None] | None, Reaction, int]] = {
    "Ctrl-C, SIGTERM, closed terminal (one flag)": (None, Reaction.COMPLY, 2),
    "exception in user code": (lambda b, c: setattr(c, "broken", True), Reaction.SUPPORT, 2),
    "pendant: idle": (lambda b, c: b.robot.safety.press(Button.IDLE, b.bus.time_ns), Reaction.RELEASE, 11),
    "pendant: emergency stop": (lambda b, c: b.robot.safety.press(Button.ESTOP, b.bus.time_ns), Reaction.SILENCE, 11),
    "somebody else's torque": (lambda b, c: b.bus.inject(Frame(TORQUES, pack_torques([9]))), Reaction.RELEASE, 2),
    "lost peer: give way": (_lost, Reaction.COMPLY, 4),
    "lost peer: let go": (_lost, Reaction.RELEASE, 16),
}


def abort_cycles(way: str, trials: int) -> list[int]:
    """Cycles from the event to the reaction, in trials that begin at different cycles; time is virtual."""
    return [_abort(way, 60 + 7 * trial % 40) for trial in range(trials)]


def _abort(way: str, at: int) -> int:
    event, wanted, _ = ABORTS[way]
    bench, controller = Bench(), _Raises()
    pilot = bench.pilot(controller)
    count, reacted = 0, 0

    def wishes() -> Wishes:
        nonlocal count
        count += 1
        if count == at and event is not None:
            event(bench, controller)
        return Wishes(arm=not pilot.is_armed and count < 40, abort=event is None and count >= at, over=count > at + 40)

    def watch(start_ns: int, decision: Decision) -> None:
        nonlocal reacted
        if not reacted and count >= at and decision.outcome.reaction >= wanted:
            reacted = count - at + 1

    Loop(bench.wire, pilot, ExactTimer(bench), watch=watch).run(wishes)
    bench.wire.close()
    return reacted or 10**6


class _Slow:
    """Takes 60 % of a period of 2 ms, once it is told so."""

    def __init__(self, bench: Bench) -> None:
        self.bench, self.slow = bench, False

    def torque(self, observed: Observed) -> np.ndarray:
        """No torque, late."""
        self.bench.sleep(0.0012 if self.slow else 0.0)
        return np.zeros(3)


def slow_controller() -> dict[Reaction, int]:
    """Cycles until a controller that takes too long has less torque, and until the arm gives way."""
    bench = Bench()
    controller = _Slow(bench)
    pilot = bench.pilot(controller)
    count, found = 0, dict[Reaction, int]()

    def wishes() -> Wishes:
        nonlocal count
        count += 1
        controller.slow = count >= 100
        return Wishes(arm=not pilot.is_armed, over=count > 140)

    def watch(start_ns: int, decision: Decision) -> None:
        if count >= 100:
            found.setdefault(decision.outcome.reaction, count - 100)

    Loop(bench.wire, pilot, ExactTimer(bench), watch=watch).run(wishes)
    bench.wire.close()
    return found
