"""Everything that can go wrong on a bus or at a host: a class of faults each, and the phase in which it happens."""

import math
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field
from unittest.mock import patch

import can
import numpy as np

from hil.bus.gate import TORQUES
from hil.codecs.barrett.identifiers import Group, Node, answer_of
from hil.codecs.barrett.positions import pack_positions, unpack_positions
from hil.codecs.barrett.safety_module import Button, Level
from hil.codecs.barrett.torques import pack_torques
from hil.codecs.frame import Frame, Timed
from hil.control.controllers import Controller, Observed
from hil.recording.recorder import Recorder
from hil.recording.records import RECORD
from hil.recording.ring import Ring
from tests.hil.bench import Bench

POSITIONS = frozenset(answer_of(k, Group.POSITIONS) for k in (1, 2, 3))
STATES = answer_of(Node.SAFETY, Group.ALL)


class Shaken:
    """The controller of a session until a fault takes its place."""

    def __init__(self, inner: Controller) -> None:
        self.inner = inner
        self.fault: Callable[[Observed], np.ndarray] | None = None

    def torque(self, observed: Observed) -> np.ndarray:
        return self.inner.torque(observed) if self.fault is None else self.fault(observed)


class Writer:
    """The recorder's process: it runs as long as it has no exit code."""

    code: int | None = None

    def poll(self) -> int | None:
        return self.code


def recorder() -> Recorder:
    """The loop's side of a recording that nobody writes to a disk."""
    found = Recorder.__new__(Recorder)
    found.ring, found._process, found._clock = Ring.create(20_000), Writer(), time.monotonic_ns  # type: ignore[assignment]
    return found


@dataclass
class Trouble:
    """A fault that is switched on at some time; `count` frames may still be changed.

    `undo` is closed when the session is over.
    """

    bench: Bench
    controller: Shaken
    recorder: Recorder
    count: float = math.inf
    memory: dict = field(default_factory=dict)
    undo: ExitStack = field(default_factory=ExitStack)

    def hits(self, timed: Timed) -> bool:
        """Whether a frame towards the host is changed: positions while cycling, any answer before."""
        wanted = POSITIONS if self.memory.get("cycling", True) else None
        if self.count <= 0 or (wanted is not None and timed.frame.identifier not in wanted):
            return False
        self.count -= 1
        return True


Start = Callable[[Trouble], None]


def _on_the_way(change: Callable[[Trouble, Timed], list[Timed]], count: float) -> Start:
    def start(trouble: Trouble) -> None:
        trouble.count = count
        trouble.bench.faults.towards_host.append(
            lambda timed: change(trouble, timed) if trouble.hits(timed) else [timed]
        )

    return start


def _with(data: Callable[[bytes], bytes]) -> Callable[[Trouble, Timed], list[Timed]]:
    return lambda trouble, timed: [Timed(timed.time_ns, Frame(timed.frame.identifier, data(timed.frame.data)))]


def _frozen(trouble: Trouble, timed: Timed) -> list[Timed]:
    first = trouble.memory.setdefault(timed.frame.identifier, timed.frame.data)
    return [Timed(timed.time_ns, Frame(timed.frame.identifier, first))]


def _swapped(trouble: Trouble, timed: Timed) -> list[Timed]:
    held = trouble.memory.pop("held", None)
    if held is None:
        trouble.memory["held"] = timed
        return []
    return [timed, Timed(timed.time_ns, held.frame)]


def _node(action: Callable[[Bench], None]) -> Start:
    return lambda trouble: action(trouble.bench)


def _press(button: Button) -> Start:
    return _node(lambda bench: bench.robot.safety.press(button, bench.bus.time_ns))


def _fault_of_module(bench: Bench) -> None:
    bench.robot.safety.levels["velocity"] = Level.WARNING
    bench.robot.safety._fault("velocity")


def _reset(bench: Bench) -> None:
    bench.robot.motors[1].values["STAT"] = 0


def _broken_bus(bench: Bench) -> None:
    def send(msg: object, timeout: float | None = None) -> None:
        raise can.CanOperationError("bus off")

    bench.bus.send = send  # type: ignore[method-assign]


def _deaf_bus(error: Exception) -> Start:
    def start(trouble: Trouble) -> None:
        def recv(timeout: float | None = None) -> None:
            raise error

        trouble.bench.bus.recv = recv  # type: ignore[method-assign]

    return start


def _error_frame(trouble: Trouble) -> None:
    bus = trouble.bench.bus
    hears = bus.recv

    def recv(timeout: float | None = None) -> can.Message:
        bus.recv = hears  # type: ignore[method-assign]
        return can.Message(arbitration_id=0x20, is_error_frame=True)

    bus.recv = recv  # type: ignore[method-assign]


def _held_back(milliseconds: float) -> Callable[[Trouble, Timed], list[Timed]]:
    def change(trouble: Trouble, timed: Timed) -> list[Timed]:
        end = trouble.memory.setdefault("end", timed.time_ns + int(milliseconds * 1e6))
        return [Timed(max(timed.time_ns, end), timed.frame)]

    return change


def _turned_over(data: bytes) -> bytes:
    """A position whose register starts again at its other end; other answers stay."""
    if len(data) != 3:
        return data
    counts = unpack_positions(data).motor
    return pack_positions(counts - 2**21 if counts >= 0 else counts + 2**21)


def _asks(torque: Callable[[Trouble], np.ndarray]) -> Start:
    def start(trouble: Trouble) -> None:
        trouble.controller.fault = lambda observed: torque(trouble)

    return start


def _raises(trouble: Trouble) -> np.ndarray:
    raise ZeroDivisionError("no answer to this posture")


def _takes(milliseconds: float, cycles: float = math.inf) -> Callable[[Trouble], np.ndarray]:
    def torque(trouble: Trouble) -> np.ndarray:
        trouble.memory["slow"] = trouble.memory.get("slow", 0) + 1
        if trouble.memory["slow"] <= cycles:
            trouble.bench.sleep(milliseconds * 1e-3)
        return np.zeros(3)

    return torque


def _other_time(trouble: Trouble) -> None:
    real = time.time
    trouble.undo.enter_context(patch("time.time", lambda: real() - 3600.0))
    trouble.undo.enter_context(patch("time.time_ns", lambda: int((real() - 3600.0) * 1e9)))


def _recorder_ends(code: int) -> Start:
    return lambda trouble: setattr(trouble.recorder._process, "code", code)


def _ring_is_full(trouble: Trouble) -> None:
    while not trouble.recorder.ring.overflowed:
        trouble.recorder.ring.put(bytes(RECORD.size))


def _stall(milliseconds: float) -> Start:
    return _node(lambda bench: bench.sleep(milliseconds * 1e-3))


def _babble(bench: Bench) -> None:
    for _ in range(200):
        bench.bus.inject(Frame(STATES, b"\x00" * 8))


def _stranger(bench: Bench) -> None:
    bench.bus.inject(Frame(TORQUES, pack_torques([50, 0, 0])))


def _second_node(trouble: Trouble, timed: Timed) -> list[Timed]:
    other = Frame(timed.frame.identifier, bytes([timed.frame.data[0], *reversed(timed.frame.data[1:])]))
    return [timed, Timed(timed.time_ns + 1000, other)]


def _reversed_motor(bench: Bench) -> None:
    motor = bench.robot.motors[2]
    motor.controller = type(motor.controller)(motor.controller.counts, -motor.controller.torque_units)


@dataclass(frozen=True)
class FaultClass:
    """A class of faults: how it begins, and whether it ever ends by itself."""

    name: str
    start: Start


CLASSES: tuple[FaultClass, ...] = (
    FaultClass("one answer lost", _on_the_way(lambda t, f: [], 1)),
    FaultClass("three answers of a motor lost", _on_the_way(lambda t, f: [], 9)),
    FaultClass("all answers lost", _on_the_way(lambda t, f: [], math.inf)),
    FaultClass("answers doubled", _on_the_way(lambda t, f: [f, f], math.inf)),
    FaultClass("answers out of order", _on_the_way(_swapped, 60)),
    FaultClass("a flipped high bit", _on_the_way(_with(lambda d: bytes([d[0] ^ 0x10, *d[1:]])), 3)),
    FaultClass("a length of 2", _on_the_way(_with(lambda d: d[:2]), math.inf)),
    FaultClass("a second node of the same number", _on_the_way(_second_node, math.inf)),
    FaultClass("a jump of the position", _on_the_way(_with(lambda d: bytes([d[0] ^ 0x08, *d[1:]])), math.inf)),
    FaultClass("a frozen encoder", _on_the_way(_frozen, math.inf)),
    FaultClass("a motor with its sign reversed", _node(_reversed_motor)),
    FaultClass("a motor that resets", _node(_reset)),
    FaultClass("Idle pressed on the pendant", _press(Button.IDLE)),
    FaultClass("emergency stop pressed", _press(Button.ESTOP)),
    FaultClass("the safety module finds a fault", _node(_fault_of_module)),
    FaultClass("the bus goes off", _node(_broken_bus)),
    FaultClass("the connection is reset", _deaf_bus(can.CanOperationError("connection reset by peer"))),
    FaultClass("a node that babbles", _node(_babble)),
    FaultClass("somebody else's torques", _node(_stranger)),
    FaultClass("the host stands still for 30 ms", _stall(30)),
    FaultClass("the wall clock goes back by an hour", _other_time),
    FaultClass("a controller that raises", _asks(_raises)),
    FaultClass("a controller that asks for NaN", _asks(lambda t: np.full(3, np.nan))),
    FaultClass("a controller that asks for -8192 N.m", _asks(lambda t: np.full(3, -8192.0))),
    FaultClass("a controller that takes 5 ms", _asks(_takes(5.0))),
    FaultClass("the disk is full, and the recorder ends", _recorder_ends(1)),
    FaultClass("the force sensor saturates", _node(lambda b: setattr(b.plant, "force", np.array([500.0, 0.0, 0.0])))),
)
