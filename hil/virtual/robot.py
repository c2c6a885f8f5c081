"""The virtual robot: nodes on a bus, and a plant that their motors move."""

import contextlib
from collections.abc import Sequence
from typing import Any

import numpy as np

from hil.codecs.barrett.force_torque import DIVISORS, Status, pack_reading
from hil.codecs.barrett.identifiers import Group, address_of, answer_of
from hil.codecs.barrett.identifiers import Node as Place
from hil.codecs.barrett.tables import Kind
from hil.codecs.barrett.torques import unpack_torques
from hil.codecs.frame import Frame, Timed
from hil.errors import FrameError
from hil.robots import proficio
from hil.virtual.motor import Motor
from hil.virtual.node import ANSWER_NS, VERSION, Node
from hil.virtual.plant import Plant, encoder_angles
from hil.virtual.safety_module import HEARTBEAT_NS, SafetyModule

# N that it can say.
_MOST = 32767 / DIVISORS[Group.FORCE]


class ForceSensor(Node):
    """Says the force that a plant feels at its wrist, with noise, its own zero error and its limits."""

    def __init__(self, noise: float = 0.3, seed: int = 1) -> None:
        super().__init__(Place.FORCE_SENSOR, Kind.FORCE_SENSOR, (Group.ALL,))
        self.force = np.zeros(3)
        self.zero = np.array([1.5, -0.7, 0.4])
        self.tare = np.zeros(3)
        self.noise = noise
        self._random = np.random.default_rng(seed)

    def _asked(self, number: int, time_ns: int) -> list[Timed]:
        if not (self.is_awake and number in (self.numbers["FT"], self.numbers["A"])):
            return super()._asked(number, time_ns)
        if number == self.numbers["A"]:
            data = pack_reading(Group.ACCELERATION, (0.0, 0.0, -9.80665))
            return [Timed(time_ns + ANSWER_NS, Frame(answer_of(self.number, Group.ACCELERATION), data))]
        raw = (self.force + self.zero - self.tare + self.noise * self._random.standard_normal(3)).tolist()
        status = Status(False, False, (0,)) if max(map(abs, raw)) > _MOST else None
        force = pack_reading(Group.FORCE, [min(max(part, -_MOST), _MOST) for part in raw], status)
        torque = pack_reading(Group.TORQUE, (0.0, 0.0, 0.0), status)
        return [
            Timed(time_ns + ANSWER_NS, Frame(answer_of(self.number, Group.FORCE), force)),
            Timed(time_ns + 2 * ANSWER_NS, Frame(answer_of(self.number, Group.TORQUE), torque)),
        ]

    def _set(self, name: str, value: int, time_ns: int) -> None:
        if name == "FT":
            self.tare = self.force + self.zero
        else:
            super()._set(name, value, time_ns)


# The plant moves on in steps of at most this; motors take their torques at the frame's own time.
LONGEST_STEP_S = 0.001
# In real time the plant moves on so often without a question, to be near when one comes.
EVERY_NS = 2_000_000
# What comes so soon after the plant has moved finds it where it is: a cycle's questions move it once, and are answered
# in time. Its torques come later, and act from their own time on.
_TOGETHER_NS = 100_000
# Time that the plant may be behind: after a longer silence (a stopped machine) it does not catch up.
MOST_BEHIND_S = 0.1


class RealTime:
    """What a virtual robot of any kind needs to keep up with the clock; `time_ns` is up to when its plant has moved.

    `positions` are the identifiers of answers with a position, which is from byte `position[0]` on, to before `position[1]`;
    byte `position[2]` is one of its high ones.
    """

    time_ns: int | None
    plant: Plant
    nodes: Sequence[Any]  # each with its `number`, and `powered` unless somebody pulls its plug
    positions: frozenset[int] = frozenset()
    position = (0, 8, 0)

    def receive(self, frame: Frame, time_ns: int) -> list[Timed]:
        """Take a frame from the bus; returns what is answered, in the order of time."""
        raise NotImplementedError

    def advance(self, time_ns: int) -> None:
        """Let the plant move until a time."""
        raise NotImplementedError

    def fail(self, number: int, time_ns: int) -> bool:
        """Let a node have a fault; whether there is one of that number that can."""
        return False

    def arrival(self, now: int) -> int:
        """When a frame that is read at `now` (ns) has come: not before the plant, and not just after it."""
        moved = self.time_ns or 0
        return moved if now - moved < _TOGETHER_NS else now

    def keep_up(self, now: int) -> None:
        """Let the plant move on, if it is long enough behind."""
        if now - (self.time_ns or 0) >= EVERY_NS:
            self.advance(now)


class VirtualRobot(RealTime):
    """A Proficio with force/torque sensor and safety module.

    It has no clock: `receive` is told when a frame came, and says when its answers are on the bus.
    """

    def __init__(
        self,
        plant: Plant,
        controllers: Sequence[proficio.Controller] = (proficio.Controller(),) * proficio.JOINTS,
        *,
        eager: bool = False,
        heartbeat_ns: int = HEARTBEAT_NS,
        version: int = VERSION,
        seed: int = 1,
    ) -> None:
        self.plant = plant
        self.motors = [Motor(k, controller, version) for k, controller in enumerate(controllers, start=1)]
        self.sensor = ForceSensor(seed=seed)
        self.safety = SafetyModule(self.motors, eager=eager, heartbeat_ns=heartbeat_ns)
        self.nodes: Sequence[Node] = (*self.motors, self.sensor, self.safety)
        self.positions = frozenset(answer_of(motor.number, Group.POSITIONS) for motor in self.motors)
        self.time_ns: int | None = None
        self._show()

    def receive(self, frame: Frame, time_ns: int) -> list[Timed]:
        """Take a frame from the bus; returns what is answered, in the order of time."""
        if time_ns > (self.time_ns or 0):
            self.advance(time_ns)
        address = address_of(frame.identifier)
        answers: list[Timed] = []
        for node in self.nodes:
            if node.hears(address):
                if isinstance(node, Motor):
                    node.command(address, frame.data)
                answers += node.receive(frame.data, time_ns)
        if any(motor.hears(address) for motor in self.motors):
            self.safety.hear_host(time_ns)
        if address.to_group and address.receiver == Group.LOWER_TORQUES:
            with contextlib.suppress(FrameError):
                self.safety.hear_torques(unpack_torques(frame.data))
        return sorted(answers, key=lambda timed: timed.time_ns)

    def advance(self, time_ns: int) -> None:
        """Let the plant move until a time."""
        if self.time_ns is None:
            self.time_ns = time_ns
        left = min((time_ns - self.time_ns) * 1e-9, MOST_BEHIND_S)
        torques = proficio.joint_torques(np.array([motor.torque for motor in self.motors]))
        while left > 1e-12:
            step = min(left, LONGEST_STEP_S)
            self.plant.step(torques, step)
            left -= step
        self.time_ns = max(self.time_ns, time_ns)
        self._show()
        self.safety.watch(max(map(abs, self.plant.speeds.tolist())) * 0.65, time_ns)

    def _show(self) -> None:
        angles = encoder_angles(self.plant)
        for motor, angle in zip(self.motors, proficio.motor_angles(angles).tolist(), strict=True):
            motor.angle = angle
        self.sensor.force = self.plant.force
