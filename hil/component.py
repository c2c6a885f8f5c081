"""A robot on its bus as a component of a co-simulation: it stands where an FMU of the robot stood."""

import contextlib
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
from hil.session.settings import Settings, default_settings, read_settings
from hil.session.start_up import start_up
from hil.session.timing import Metronome
from hil.session.watchdog import watchdog
from hil.virtual.process import virtual_robot
from orchestrator.cosim import Component, Port, StepEnd
from orchestrator.cosim.system import ComponentSpec

# Somebody has so long to press Activate on the pendant.
PATIENCE_S = 60.0
_JOINTS = range(1, proficio.JOINTS + 1)


class _Asked:
    """A controller that asks for what was set last."""

    def __init__(self) -> None:
        self.torques = np.zeros(proficio.JOINTS)

    def torque(self, observed: Observed) -> np.ndarray:
        """The torques that were set."""
        return self.torques


class RobotComponent(Component):
    """One step is one cycle of a session, at the session's own pace: a run with a robot takes as long as it takes.

    Inputs `asked1..3` (N.m) pass the safety core like those of any controller; outputs are angles, speeds, the force at the
    wrist, the torques sent, and what the core did. Outputs change by a step only.
    """

    kind = "robot"
    follows_inputs = False
    variable_step = False
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
        self.own_step = settings.limits.period_ns * 1e-9
        self._asked = _Asked()
        self._stack = contextlib.ExitStack()
        self._loop: Loop | None = None
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
        pilot = Pilot(robot, settings.limits, self._asked, gravity=settings.gravity)
        beats = Metronome(settings.limits.period_ns)
        self._loop = Loop(wire, pilot, beats, None, heart, watch=self._watch)
        self._loop.begin()
        self._stack.callback(self._loop.end)

    def start(self) -> None:
        """Cycle with zero torque until the arm is armed.

        Raises:
            ComponentError: if it cannot be.
        """
        loop, deadline = self._running(), clock.monotonic() + PATIENCE_S
        while not loop.pilot.is_armed:
            if clock.monotonic() > deadline:
                raise ComponentError(f"the robot could not be armed: {loop.pilot.refused}")
            loop.beat(Wishes(arm=True))

    def set(self, names: Sequence[str], values: Sequence[Any]) -> None:
        """Ask for torques."""
        for name, value in zip(names, values, strict=True):
            self._asked.torques[int(name.removeprefix("asked")) - 1] = value

    def get(self, names: Sequence[str]) -> list[Any]:
        """What the last cycle has shown; inputs as they were set."""
        inputs = {f"asked{k}": float(self._asked.torques[k - 1]) for k in _JOINTS}
        return [{**self._values, **inputs}[name] for name in names]

    def step(self, time: float, size: float) -> StepEnd:
        """Do one cycle.

        Raises:
            ComponentError: if a rule of the safety core has stopped the arm.
        """
        loop = self._running()
        loop.beat(Wishes())
        if loop.pilot.stopped is not None:
            raise ComponentError(f"the safety core stopped the robot: {loop.pilot.stopped}")
        return StepEnd(time + size)

    def terminate(self) -> None:
        """Let the arm down and give the bus back."""
        self._stack.close()
        self._loop = None

    def _running(self) -> Loop:
        if self._loop is None:
            raise ComponentError("the robot has not been started up")
        return self._loop

    def _watch(self, start_ns: int, decision: Decision) -> None:
        sent = decision.outcome.torques or (0.0,) * proficio.JOINTS
        seen = decision.observed
        for k in _JOINTS:
            self._values |= {f"q{k}": float(seen.angles[k - 1]), f"w{k}": float(seen.speeds[k - 1])}
            self._values[f"tau{k}"] = float(sent[k - 1])
        self._values |= {f"f{axis}": float(part) for axis, part in zip("xyz", seen.force, strict=True)}
        self._values["reaction"] = int(decision.outcome.reaction)


def open_robot(spec: ComponentSpec, folder: Path) -> Component:
    """Make the component of a system file: `kind = "robot"` with `virtual = true`, or `source` a bench file.

    Raises:
        MisfitError: if neither or both are given, or the bench file is wrong.
    """
    virtual = bool(spec.options.get("virtual", False))
    unknown = set(spec.options) - {"virtual", "rate_hz"}
    if unknown or virtual == bool(spec.source):
        raise MisfitError("a robot takes either virtual = true or source = BENCH.toml, and rate_hz")
    rate = float(spec.options.get("rate_hz", 500.0))
    if virtual:
        return RobotComponent(replace(default_settings(rate_hz=rate), gravity=False), virtual=True)
    return RobotComponent(read_settings(folder / spec.source, rate), virtual=False)
