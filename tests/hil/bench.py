"""A bench without time: a virtual robot on a bus inside the process, whose clock moves when somebody waits for it."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from hil.barrett.start_up import Robot, start_up
from hil.bus.gate import TORQUE_IDENTIFIERS
from hil.bus.wire import Wire
from hil.codecs.frame import Timed
from hil.control.controllers import Controller
from hil.control.pilot import Pilot
from hil.robots import proficio
from hil.session.loop import Loop, Summary, Wishes
from hil.settings import Settings, default_settings
from hil.virtual.direct_bus import DirectBus
from hil.virtual.faults import Faults
from hil.virtual.plant import FreeJoints
from hil.virtual.robot import VirtualRobot

SETTINGS: Settings = replace(default_settings(), gravity=False)


# Closed after each test.
OPEN: list[Wire] = []


class Bench:
    """A virtual Proficio, started up, with everything that went over its bus."""

    def __init__(self, *, eager: bool = True, settings: Settings = SETTINGS, faults: Faults | None = None) -> None:
        self.settings, self.faults = settings, faults or Faults()
        self.plant = FreeJoints(proficio.HOME[settings.side])
        self.robot = VirtualRobot(self.plant, eager=eager)
        self.bus = DirectBus(self.robot, self.faults)
        self.wire = Wire(self.bus, TORQUE_IDENTIFIERS, "virtual robot", self.bus.now)
        self.sent: list[Timed] = []
        self.wire.tap = lambda timed, sent: self.sent.append(timed) if sent else None
        self.cycle = 0
        OPEN.append(self.wire)

    def started(self, at_home: Callable[[], bool] = lambda: True) -> Robot:
        return start_up(self.wire, self.settings.side, self.sleep, at_home)

    def sleep(self, seconds: float) -> None:
        self.bus.sleep(seconds)

    def close(self) -> None:
        OPEN.remove(self.wire)
        self.wire.close()

    def pilot(self, controller: Controller | None = None) -> Pilot:
        robot = self.started()
        # Away from the stops, so that the arm may be armed.
        self.plant.angles = np.array([-0.3, 0.2, 1.5])
        self.robot.advance(self.bus.time_ns)
        return Pilot(robot, self.settings.limits, controller or self.settings.make_controller(), gravity=False)

    def run(self, pilot: Pilot, cycles: int, disturb: Callable[[int], None] = lambda cycle: None) -> Summary:
        """Hold for some cycles, armed from the first one on that allows it; `disturb` is called before each."""

        def wishes() -> Wishes:
            self.cycle += 1
            disturb(self.cycle)
            return Wishes(arm=not pilot.is_armed and self.cycle < 50, over=self.cycle > cycles)

        return Loop(self.wire, pilot, ExactTimer(self)).run(wishes)

    def torque_frames(self) -> list[Timed]:
        return [timed for timed in self.sent if timed.frame.identifier in TORQUE_IDENTIFIERS]


class ExactTimer:
    """Cycles begin exactly when they should."""

    missed = 0

    def __init__(self, bench: Bench) -> None:
        self.bench = bench
        self._next = bench.bus.time_ns + bench.settings.limits.period_ns

    def wait(self) -> tuple[int, int]:
        self.bench.bus.time_ns = max(self._next, self.bench.bus.time_ns)
        self._next += self.bench.settings.limits.period_ns
        return self.bench.bus.time_ns, self.bench.bus.time_ns


def recorded(folder: Path) -> bytes:
    return (folder / "frames.bin").read_bytes()
