"""Faults that a man in the middle on the bus makes, or a node, or a controller, in virtual time."""

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fmus.errors import MisfitError
from hil.bus.gate import TORQUES
from hil.codecs.barrett.identifiers import Group, Node, answer_of
from hil.codecs.barrett.positions import pack_positions, unpack_positions
from hil.codecs.barrett.safety_module import Button
from hil.codecs.barrett.torques import pack_torques
from hil.codecs.frame import Frame, Timed
from hil.control.controllers import Observed
from hil.control.pilot import CycleInput, Decision, Pilot
from hil.record import replaced
from hil.robots.absent import refusals
from hil.safety.cycle import Reaction
from hil.session.loop import Loop, Wishes
from hil.settings import Settings, default_settings
from tests.hil.bench import Bench, ExactTimer

POSITIONS = frozenset(answer_of(k, Group.POSITIONS) for k in (1, 2, 3))
FORCE = answer_of(Node.FORCE_SENSOR, Group.FORCE)
# s from arming to the fault: the ramp is over by then.
CALM_S = 1.3
START = np.array([-0.3, 0.2, 1.0])


class Steady:
    """Asks for a torque at the elbow, and for something else once it is told so."""

    def __init__(self) -> None:
        self.torques = np.array([0.0, 0.0, 2.0])
        self.error: Exception | None = None

    def torque(self, observed: Observed) -> np.ndarray:
        """The torques."""
        if self.error is not None:
            raise self.error
        return self.torques


@dataclass
class Scene:
    """A bench with an arm that hardly moves, and the fault on it."""

    bench: Bench
    controller: Steady
    period_ns: int
    recording: bool = True
    watchdog_silent: bool = False
    memory: dict[int, bytes] = field(default_factory=dict)

    def change(self, wanted: frozenset[int], change: Callable[[Timed], list[Timed]]) -> None:
        """Change frames towards the host from now on."""
        self.bench.faults.towards_host.append(lambda t: change(t) if t.frame.identifier in wanted else [t])


class Misled:
    """A pilot that is told what the scene says of recorder and watchdog; also a compiled one, of which nothing can be replaced."""

    def __init__(self, pilot: Pilot, scene: Scene) -> None:
        self.pilot, self.scene = pilot, scene

    def __getattr__(self, name: str) -> Any:
        return getattr(self.pilot, name)

    def decide(self, given: CycleInput) -> Decision:
        """Decide with that."""
        silent = self.scene.watchdog_silent
        told = replaced(given, recording=self.scene.recording, watched=not silent, watchdog_silent=silent)
        return self.pilot.decide(told)


@dataclass(frozen=True)
class Fault:
    """A fault by its name; `at_once` if a single cycle shows it. `moving`: it happens while somebody moves the elbow."""

    name: str
    start: Callable[[Scene], None]
    at_once: bool = False
    moving: bool = False


@dataclass(frozen=True)
class Times:
    """ms until the safety core reacted (more than half the torque), until no motor made torque, and what was said."""

    seen_ms: float
    zero_ms: float
    told: str


def _late(periods: float) -> Callable[[Scene], None]:
    def start(scene: Scene) -> None:
        delay = int(periods * scene.period_ns)
        scene.change(POSITIONS, lambda t: [Timed(t.time_ns + delay, t.frame)])

    return start


def _ageing(scene: Scene) -> None:
    """Forces come two periods later at every tenth answer: each of them when one is awaited, and none missing for long."""
    count = itertools.count()
    scene.change(frozenset({FORCE}), lambda t: [Timed(t.time_ns + next(count) // 10 * 2 * scene.period_ns, t.frame)])


def _shifted(timed: Timed) -> list[Timed]:
    """A position 0.3 rad of the elbow further."""
    counts = unpack_positions(timed.frame.data).motor + int(0.3 * 9.55 * 4096 / (2 * math.pi))
    return [Timed(timed.time_ns, Frame(timed.frame.identifier, pack_positions(counts)))]


def _frozen(wanted: frozenset[int]) -> Callable[[Scene], None]:
    def start(scene: Scene) -> None:
        def repeat(timed: Timed) -> list[Timed]:
            first = scene.memory.setdefault(timed.frame.identifier, timed.frame.data)
            return [Timed(timed.time_ns, Frame(timed.frame.identifier, first))]

        scene.change(wanted, repeat)

    return start


def _lost_torques(scene: Scene) -> None:
    """Torque frames do not arrive; the controller asks for more and more, as one that holds a posture does."""
    scene.bench.faults.towards_robot.append(lambda t: [] if t.frame.identifier == TORQUES else [t])
    scene.controller.torques = np.array([0.0, 0.0, 6.0])


def _runs_away(scene: Scene) -> None:
    scene.bench.plant.damping = 0.3
    scene.bench.plant.outside = np.array([0.0, 0.0, -6.0])


def _switched_off(number: int) -> Callable[[Scene], None]:
    def start(scene: Scene) -> None:
        next(node for node in scene.bench.robot.nodes if node.number == number).powered = False

    return start


def _press(button: Button) -> Callable[[Scene], None]:
    return lambda scene: scene.bench.robot.safety.press(button, scene.bench.bus.time_ns)


def _stranger(scene: Scene) -> None:
    scene.bench.bus.inject(Frame(TORQUES, pack_torques([50, 0, 0])))


def _nan(scene: Scene) -> None:
    scene.controller.torques = np.full(3, np.nan)


def _raises(scene: Scene) -> None:
    scene.controller.error = ZeroDivisionError("no answer to this posture")


def _babble(scene: Scene) -> None:
    """Another node's frames between all others, 75 us each: the bus is full, and answers wait their turn."""
    bus, hears = scene.bench.bus, scene.bench.bus.recv

    def recv(timeout: float | None = None) -> object:
        if not timeout:
            return hears(timeout)
        bus.time_ns += 75_000
        bus.inject(Frame(0x7E5, b"x"))
        return hears(timeout)

    bus.recv = recv  # type: ignore[assignment, method-assign]


FAULTS: tuple[Fault, ...] = (
    Fault("the controller asks for NaN", _nan, at_once=True),
    Fault("the controller raises", _raises, at_once=True),
    Fault("emergency stop on the pendant", _press(Button.ESTOP), at_once=True),
    Fault("Idle on the pendant", _press(Button.IDLE), at_once=True),
    Fault("somebody else's torques", _stranger, at_once=True),
    Fault("the watchdog falls silent", lambda s: setattr(s, "watchdog_silent", True), at_once=True),
    Fault("the session stands still for 300 ms", lambda s: s.bench.sleep(0.3)),
    *(Fault(f"all positions {p:g} periods late", _late(p)) for p in (0.6, 0.975, 1.5, 2.05, 2.3, 3.3, 4.4, 5.0)),
    Fault("all positions lost", lambda s: s.change(POSITIONS, lambda t: [])),
    Fault("a node that never stops talking", _babble),
    Fault("all torque frames lost on the way", _lost_torques),
    Fault("a motor that runs away", _runs_away),
    Fault("an encoder that freezes in motion", _frozen(frozenset({answer_of(3, Group.POSITIONS)})), moving=True),
    Fault("an encoder that jumps by 0.3 rad", lambda s: s.change(frozenset({answer_of(3, Group.POSITIONS)}), _shifted)),
    Fault("a force sensor that is dead", _switched_off(Node.FORCE_SENSOR)),
    Fault("a force sensor that freezes", _frozen(frozenset({FORCE}))),
    Fault("forces that grow old step by step", _ageing),
    Fault("a safety module that is dead", _switched_off(Node.SAFETY)),
    Fault("a recorder that is dead", lambda s: setattr(s, "recording", False)),
)


def times_of(fault: Fault, rate_hz: float, trial: int, settings: Settings | None = None) -> Times:
    """Run a session with a fault; trials differ by the cycle in which it begins."""
    settings = settings or replace(default_settings(rate_hz=rate_hz), gravity=False)
    bench, controller = Bench(settings=settings), Steady()
    scene = Scene(bench, controller, settings.limits.period_ns)
    pilot = bench.pilot(controller)
    bench.plant.angles, bench.plant.damping = START.copy(), 200.0
    bench.robot.advance(bench.bus.time_ns)
    began = seen = zero = 0
    wait = int((CALM_S + 0.5 * fault.moving) * rate_hz) + 5 * trial + trial

    def wishes() -> Wishes:
        nonlocal began
        if fault.moving and pilot.cycle == int(CALM_S * rate_hz):
            bench.plant.damping, bench.plant.force = 0.3, np.array([6.0, 0.0, 0.0])
            controller.torques = np.array([0.0, 0.0, 0.15])
        if not began and pilot.cycle >= wait:
            began = bench.bus.time_ns
            fault.start(scene)
        return Wishes(arm=not pilot.is_armed and not began, over=began > 0 and bench.bus.time_ns - began > 4 * 10**9)

    def watch(start_ns: int, decision: Decision) -> None:
        nonlocal seen, zero
        now = bench.bus.time_ns
        if began and not seen and decision.outcome.reaction >= Reaction.COMPLY:
            seen = now
        if began and any(motor.torque for motor in bench.robot.motors):
            zero = 0
        elif began:
            zero = zero or now

    summary = Loop(bench.wire, Misled(pilot, scene), ExactTimer(bench), watch=watch).run(wishes)  # type: ignore[arg-type]
    bench.wire.close()
    bench.robot.advance(bench.bus.time_ns)
    end = zero or bench.bus.time_ns
    if any(motor.torque for motor in bench.robot.motors):
        raise AssertionError(f"{fault.name} at {rate_hz:g} Hz: a motor still makes torque")
    if not summary.faults:
        return Times(0.0, 0.0, "nothing: the session bears it and goes on")
    told = summary.faults[0]
    return Times((seen - began) * 1e-6 if seen else math.inf, (end - began) * 1e-6, told)


def refusals_at_start() -> list[str]:
    """What is said of robots that lack a safeguard from the beginning."""
    found = []
    for number in (Node.SAFETY, Node.FORCE_SENSOR):
        bench = Bench()
        next(node for node in bench.robot.nodes if node.number == number).powered = False
        try:
            found += refusals(bench.started(), ())
        except MisfitError as error:
            found.append(str(error))
        bench.wire.close()
    return found
