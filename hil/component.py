"""A robot on its bus as a component of a co-simulation: it stands where an FMU of the robot stood."""

import contextlib
import threading
import time as clock
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fmus.errors import ComponentError, MisfitError
from hil.bus.gate import TORQUE_IDENTIFIERS
from hil.bus.wire import open_wire
from hil.cli import ask_arm, ask_home
from hil.robots import proficio
from hil.session.controllers import Observed
from hil.session.loop import Loop, Wishes
from hil.session.pilot import Decision, Pilot
from hil.session.settings import Settings, read_settings, virtual_settings
from hil.session.start_up import start_up
from hil.session.timing import Metronome
from hil.session.watchdog import watchdog
from hil.virtual.process import virtual_robot
from orchestrator.cosim import Component, Port, StepEnd
from orchestrator.cosim.isolate.component import IsolatedComponent
from orchestrator.cosim.system import ComponentSpec
from orchestrator.measurements.toml_values import number

# Somebody has so long to press Activate on the pendant.
PATIENCE_S = 60.0
# Torques that were not asked for again within this time count no longer.
STALE_S = 0.2
_JOINTS = range(1, proficio.JOINTS + 1)


class _Asked:
    """A controller that asks for what was set last, as long as that is not old: a run that hangs must not go on pushing."""

    def __init__(self) -> None:
        self.torques = np.zeros(proficio.JOINTS)
        self.until = 0.0

    def torque(self, observed: Observed) -> np.ndarray:
        """The torques that were set."""
        return self.torques if clock.monotonic() < self.until else np.zeros(proficio.JOINTS)


class RobotComponent(Component):
    """Cycles at its own rate beside the run; a step waits until its time has passed, so the run keeps pace with the robot.

    Inputs `asked1..3` (N.m) pass the safety core like those of any controller; outputs are angles, speeds, the force at the
    wrist, the torques sent, and what the core did. Outputs change by a step only.
    """

    kind = "robot"
    follows_inputs = False
    ports = (
        *(
            Port(f"asked{k}", "input", unit="N.m", start=0.0, description=f"torque wanted at joint {k}")
            for k in _JOINTS
        ),
        *(Port(f"q{k}", "output", unit="rad", description=f"angle of joint {k}") for k in _JOINTS),
        *(Port(f"w{k}", "output", unit="rad/s", description=f"speed of joint {k}") for k in _JOINTS),
        *(Port(f"tau{k}", "output", unit="N.m", description=f"torque sent to joint {k}") for k in _JOINTS),
        *(Port(f"f{axis}", "output", unit="N", description=f"force at the wrist along {axis}") for axis in "xyz"),
        Port("reaction", "output", "Int32", description="what the safety core did, from 0 (pass) to 5 (silence)"),
    )
    feedthrough = {port.name: () for port in ports if port.causality == "output"}

    def __init__(self, settings: Settings, *, virtual: bool) -> None:
        self.settings, self.virtual = settings, virtual
        self._asked = _Asked()
        self._stack = contextlib.ExitStack()
        self._loop: Loop | None = None
        self._thread: threading.Thread | None = None
        self._failure, self._ended = "", threading.Event()
        self._began: float | None = None
        self._values: dict[str, float] = dict.fromkeys(self.feedthrough, 0.0)

    def initialise(self, time: float, stop: float | None, tolerance: float | None) -> None:
        """Start the robot up; its torques stay off."""
        settings = self.settings
        if self.virtual:
            settings = replace(settings, bus=self._stack.enter_context(virtual_robot(settings.side)))
        heart = self._stack.enter_context(watchdog(settings.bus))
        wire = open_wire(settings.bus, TORQUE_IDENTIFIERS)
        self._stack.callback(wire.close)
        robot = start_up(wire, settings.side, clock.sleep, (lambda: True) if self.virtual else ask_home)
        if not self.virtual and not ask_arm(robot):
            raise ComponentError("the robot was not armed; type ARM when asked")
        axes = np.array(settings.force_axes)
        pilot = Pilot(robot, settings.limits, self._asked, gravity=settings.gravity, force_axes=axes)
        beats = Metronome(settings.limits.period_ns)
        self._loop = Loop(wire, pilot, beats, None, heart, watch=self._watch)
        self._loop.begin()

    def start(self) -> None:
        """Cycle with zero torque until the arm is armed, and from then on beside the run.

        Raises:
            ComponentError: if it cannot be armed.
        """
        loop = self._running()
        self._thread = threading.Thread(target=self._cycle, args=(loop,), daemon=True)
        self._thread.start()
        deadline = clock.monotonic() + PATIENCE_S
        while not loop.pilot.is_armed:
            if self._failure or clock.monotonic() > deadline:
                raise ComponentError(f"the robot could not be armed: {self._failure or loop.pilot.refused}")
            clock.sleep(0.01)

    def set(self, names: Sequence[str], values: Sequence[Any]) -> None:
        """Ask for torques."""
        torques = self._asked.torques.copy()
        for name, value in zip(names, values, strict=True):
            torques[int(name.removeprefix("asked")) - 1] = value
        self._asked.torques = torques
        self._asked.until = clock.monotonic() + STALE_S

    def get(self, names: Sequence[str]) -> list[Any]:
        """What the last cycle has shown; inputs as they were set."""
        inputs = {f"asked{k}": float(self._asked.torques[k - 1]) for k in _JOINTS}
        values = {**self._values, **inputs}
        return [values[name] for name in names]

    def step(self, time: float, size: float) -> StepEnd:
        """Wait until the robot has lived through the step.

        Raises:
            ComponentError: if the bus broke, or a rule of the safety core has stopped the arm.
        """
        loop = self._running()
        if self._began is None:
            self._began = clock.monotonic() - time
        self._asked.until = max(self._asked.until, clock.monotonic() + size + STALE_S)
        self._ended.wait(max(self._began + time + size - clock.monotonic(), 0.0))
        if loop.summary.faults:
            raise ComponentError(f"the safety core stopped the robot: {loop.summary.faults[0]}")
        if self._failure:
            raise ComponentError(self._failure)
        return StepEnd(time + size)

    def terminate(self) -> None:
        """Let the arm down and give the bus back."""
        self._ended.set()
        if self._thread is not None:
            self._thread.join(timeout=10)
        elif self._loop is not None:
            self._loop.end()
        self._stack.close()
        self._loop = self._thread = None

    def _cycle(self, loop: Loop) -> None:
        try:
            while not self._ended.is_set() and not loop.pilot.is_over:
                loop.beat(Wishes(arm=not loop.pilot.is_armed))
            loop.end()
        except MisfitError as error:
            self._failure = str(error)
            self._ended.set()

    def _running(self) -> Loop:
        if self._loop is None:
            raise ComponentError("the robot has not been started up")
        return self._loop

    def _watch(self, start_ns: int, decision: Decision) -> None:
        sent = decision.outcome.torques or (0.0,) * proficio.JOINTS
        seen, values = decision.observed, dict[str, float]()
        for k in _JOINTS:
            values |= {f"q{k}": float(seen.angles[k - 1]), f"w{k}": float(seen.speeds[k - 1])}
            values[f"tau{k}"] = float(sent[k - 1])
        values |= {f"f{axis}": float(part) for axis, part in zip("xyz", seen.force, strict=True)}
        values["reaction"] = int(decision.outcome.reaction)
        self._values = values  # all at once: the run reads from another thread


def open_robot(spec: ComponentSpec, folder: Path) -> Component:
    """Make the component of a system file: `kind = "robot"` with `virtual = true`, or `source` a bench file.

    It gets a process of its own unless `isolate = false`: whatever else Python does would stop its cycle for too long. To ask
    an operator, as a real robot does, it needs the terminal, and so `isolate = false`.

    Raises:
        MisfitError: if neither or both are given, or the bench file is wrong.
    """
    virtual = bool(spec.options.get("virtual", False))
    unknown = set(spec.options) - {"virtual", "rate_hz"}
    if unknown or virtual == bool(spec.source):
        raise MisfitError("a robot takes either virtual = true or source = BENCH.toml, and rate_hz")
    if spec.isolate is None and virtual:
        return IsolatedComponent(replace(spec, isolate=False), folder)
    rate = number(spec.options.get("rate_hz", 500.0))
    if rate is None:
        raise MisfitError(f"rate_hz = {spec.options['rate_hz']!r}; a number of cycles a second was expected")
    if virtual:
        return RobotComponent(virtual_settings(rate_hz=rate), virtual=True)
    return RobotComponent(read_settings(folder / spec.source, rate), virtual=False)
