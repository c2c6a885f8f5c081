"""A robot on its bus as a component of a co-simulation: it stands where an FMU of the robot stood."""

import contextlib
import tempfile
import threading
import time as clock
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from fmus.errors import ComponentError, MisfitError
from hil.control.pilot import Decision, Pilot
from hil.control.timing import real_time_priority
from hil.robots import proficio
from hil.session.entry import PATIENCE_S, Opened, Operator, open_robot_session
from hil.session.recorded import finish_session
from hil.settings import Settings, read_settings, virtual_settings
from hil.stop.server import stop_button
from hil.terminal import ask_arm, ask_home, yes
from hil.virtual.body import Body, Burden
from hil.virtual.process import virtual_robot
from orchestrator.cosim import Component, Port, StepEnd
from orchestrator.cosim.isolate.component import IsolatedComponent
from orchestrator.cosim.system import ComponentSpec
from orchestrator.measurements.toml_values import number

# Torques that were not asked for again within this time count no longer: a run that hangs must not go on pushing.
STALE_S = 0.2
_JOINTS = range(1, proficio.JOINTS + 1)


class RobotComponent(Component):
    """Cycles at its own rate beside the run; a step waits until its time has passed, so the run keeps pace with the robot.

    Inputs `asked1..3` (N.m) are those of the controller `asked` of a session like any other: the same questions, refusals,
    proof, recording, watchdog and stop button. Outputs are angles, speeds, the force at the wrist, the torques sent, and
    what the safety core did; they change by a step only.
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

    def __init__(
        self, settings: Settings, *, virtual: bool, folder: Path | None = None, body: Body | None = None
    ) -> None:
        self.body = body
        self.settings, self.virtual, self.folder = replace(settings, controller="asked"), virtual, folder
        self._torques: tuple[float, ...] = (0.0,) * proficio.JOINTS
        self._asked_until = 0.0
        self._stack = contextlib.ExitStack()
        self._opened: Opened | None = None
        self._thread: threading.Thread | None = None
        self._failure, self._ended, self._began = "", threading.Event(), 0.0
        self._document: dict[str, Any] | None = None
        self._abort = threading.Event()
        self._values: dict[str, float] = dict.fromkeys(self.feedthrough, 0.0)
        self._is_ready = False

    def initialise(self, time: float, stop: float | None, tolerance: float | None) -> None:
        """Start the robot up and ask whether it may be armed; its torques stay off."""
        settings = self.settings
        if self.virtual:
            settings = replace(settings, bus=self._stack.enter_context(virtual_robot(settings.side, self.body)))
        self.folder = self.folder or _new_folder()
        at_home, may_arm = (yes, yes) if self.virtual else (ask_home, ask_arm)
        operator = Operator(at_home, may_arm, abort=self._abort, watch=self._watch, tell=_tell)
        button = self._stack.enter_context(stop_button())
        session = open_robot_session(settings, operator, self.folder, button, asked=self._wanted)
        self._opened = self._stack.enter_context(session)
        if not self._opened.armed:
            raise ComponentError("the robot was not armed; type ARM when asked")

    def start(self) -> None:
        """Cycle with zero torque until the arm is armed and has proved itself, and from then on beside the run.

        Raises:
            ComponentError: if it cannot be armed, or does not prove itself.
        """
        opened = self._running()
        self._thread = threading.Thread(target=self._cycle, args=(opened,), daemon=True)
        self._thread.start()
        deadline = clock.monotonic() + PATIENCE_S
        while not self._is_ready:
            if self._ended.is_set() or clock.monotonic() > deadline:
                faults = opened.loop.summary.faults
                said = self._failure or (faults[0] if faults else opened.refusal)
                raise ComponentError(f"the robot could not be armed: {said}")
            clock.sleep(0.01)

    def set(self, names: Sequence[str], values: Sequence[Any]) -> None:
        """Ask for torques."""
        torques = list(self._torques)
        for name, value in zip(names, values, strict=True):
            torques[int(name.removeprefix("asked")) - 1] = float(value)
        self._torques = tuple(torques)
        self._asked_until = clock.monotonic() + STALE_S

    def get(self, names: Sequence[str]) -> list[Any]:
        """What the last cycle has shown; inputs as they were set."""
        inputs = {f"asked{k}": self._torques[k - 1] for k in _JOINTS}
        values = {**self._values, **inputs}
        return [values[name] for name in names]

    def step(self, time: float, size: float) -> StepEnd:
        """Wait until the robot has lived through the step.

        Raises:
            ComponentError: if the bus broke, or a rule of the safety core has stopped the arm.
        """
        opened = self._running()
        self._began = self._began or clock.monotonic() - time
        self._asked_until = max(self._asked_until, clock.monotonic() + size + STALE_S)
        self._ended.wait(max(self._began + time + size - clock.monotonic(), 0.0))
        if opened.loop.summary.faults:
            raise ComponentError(
                f"the safety core stopped the robot: {opened.loop.summary.faults[0]}; recorded in {self.folder}"
            )
        if self._failure or self._ended.is_set():
            raise ComponentError(self._failure or f"the robot's session has ended; recorded in {self.folder}")
        return StepEnd(time + size)

    def terminate(self) -> None:
        """Let the arm down, give the bus back and finish the recording."""
        self._ended.set()
        if self._thread is not None:
            self._thread.join(timeout=10)
        opened, self._opened, self._thread = self._opened, None, None
        self._stack.close()
        if opened is not None and self._document is not None and self.folder is not None:
            finish_session(self.folder, self._document)

    def _cycle(self, opened: Opened) -> None:
        """The session's own thread: from the first cycle to the last torque."""
        wishes = opened.wishes(float("inf"))
        try:
            with real_time_priority() as refused:
                opened.refuse_slow()
                opened.loop.run(lambda: wishes()._replace(over=True) if self._ended.is_set() else wishes())
                self._document = opened.result(refused)
        except MisfitError as error:
            self._failure = str(error)
        except Exception as error:  # the run must not go on with what the robot said last
            self._failure = f"the robot's session failed: {type(error).__name__}: {error}"
        finally:
            self._ended.set()

    def _wanted(self) -> tuple[float, ...] | None:
        """What the run asks for; nothing once it has not asked for long."""
        return self._torques if clock.monotonic() < self._asked_until else None

    def _running(self) -> Opened:
        if self._opened is None:
            raise ComponentError("the robot has not been started up")
        return self._opened

    def _watch(self, pilot: Pilot, decision: Decision) -> None:
        sent = decision.outcome.torques or (0.0,) * proficio.JOINTS
        seen, values = decision.observed, dict[str, float]()
        for k in _JOINTS:
            values |= {f"q{k}": seen.q[k - 1], f"w{k}": seen.w[k - 1], f"tau{k}": sent[k - 1]}
        values |= {f"f{axis}": part for axis, part in zip("xyz", seen.f, strict=True)}
        values["reaction"] = int(decision.outcome.reaction)
        self._values = values  # all at once: the run reads from another thread
        self._is_ready = pilot.is_ready  # and not before it can be read where the arm is


def _new_folder() -> Path:
    """A new folder in ./recordings, where a session of its own would record, too."""
    recordings = Path("recordings")
    recordings.mkdir(exist_ok=True)
    return Path(tempfile.mkdtemp(prefix="run-", dir=recordings))


def _tell(words: str) -> None:
    click.echo(words, err=True)


def _body(given: Any, virtual: bool) -> Body | None:
    """What a virtual robot is burdened with, or the arm strapped to it (`model`, with its parameters).

    Raises:
        MisfitError: if that is no table, or is for a real robot.
    """
    if given is None:
        return None
    if not virtual or not isinstance(given, Mapping):
        raise MisfitError("body is a table of a virtual robot, such as { friction = 0.5, payload = 1.0 }")
    if "model" in given:
        return Body(str(given["model"]), {name: float(value) for name, value in given.items() if name != "model"})
    return Body(burden=Burden.of(given))


def open_robot(spec: ComponentSpec, folder: Path) -> Component:
    """Make the component of a system file: `kind = "robot"` with `virtual = true`, or `source` a bench file.

    `body` says what a virtual one is burdened with: `friction` N.m.s/rad, `dry` N.m, `payload` kg, `delay` s, `noise`
    rad, or an arm by its `model`. `record` names the folder to record in, next to the system file; without it a new one
    in ./recordings is made. A virtual robot gets a process of its own unless `isolate = false`: whatever else Python
    does would stop its cycle for too long. To ask an operator, as a real robot does, it needs the terminal, and so
    `isolate = false`.

    Raises:
        MisfitError: if neither or both are given, or the bench file is wrong.
    """
    virtual = bool(spec.options.get("virtual", False))
    unknown = set(spec.options) - {"virtual", "rate_hz", "record", "body"}
    if unknown or virtual == bool(spec.source):
        raise MisfitError("a robot takes either virtual = true or source = BENCH.toml, and rate_hz, record, body")
    if spec.isolate is None and virtual:
        return IsolatedComponent(replace(spec, isolate=False), folder)
    rate = number(spec.options.get("rate_hz", 500.0))
    if rate is None:
        raise MisfitError(f"rate_hz = {spec.options['rate_hz']!r}; a number of cycles a second was expected")
    body = _body(spec.options.get("body"), virtual)
    into = folder / str(spec.options["record"]) if "record" in spec.options else None
    if virtual:
        return RobotComponent(virtual_settings(rate_hz=rate), virtual=True, folder=into, body=body)
    return RobotComponent(read_settings(folder / spec.source, rate), virtual=False, folder=into)
