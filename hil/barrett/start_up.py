"""Find out what is on the bus, wake it, and make sure that it is the robot one expects."""

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from fmus.errors import MisfitError
from hil.barrett.link import BarrettLink
from hil.barrett.module_limits import looser_than
from hil.bus.gate import TORQUES
from hil.codecs.barrett.identifiers import LAST_NODE, SENDER_MASK, Group, Node, answer_of, to_group, to_node
from hil.codecs.barrett.properties import decode_value, encode_request, encode_value
from hil.codecs.barrett.tables import MONITOR, Kind, kind_of, properties
from hil.codecs.barrett.torques import unpack_torques
from hil.codecs.frame import Frame
from hil.errors import BusError, FrameError
from hil.robots import proficio
from hil.robots.absent import MODULE, SENSOR
from hil.robots.base import Line, Link, Sleep
from hil.robots.proficio import Side
from hil.safety.cycle import Vector
from hil.safety.limits import Limits

# Waits of the protocol, in s.
ANSWER_S, WAKING_S, SETTLE_S = 1.0, 0.010, 1.0
# A lost answer is asked for again.
TRIES = 3
# A node answers within 1 ms; the host itself may be busy, so those that did not are asked again with more patience.
SCAN_S = (0.001, 0.010)
AWAKE = 2
# Another host's session, of 10 Hz or more, is heard within this time.
COMPANY_S = 0.15
# The module ignores this many velocities after the positions jump to those of home.
VELOCITY_HISTORY = 5

# Those that a session hears: motors, force sensor and safety module.
NODES = (1, 2, 3, int(Node.FORCE_SENSOR), int(Node.SAFETY))


@dataclass(frozen=True)
class FoundNode:
    """A node that answered: its kind, firmware, and whether that runs."""

    number: int
    kind: Kind
    version: int
    awake: bool

    @property
    def numbers(self) -> Mapping[str, int]:
        """Its properties' numbers by name."""
        return properties(self.kind, self.version)


@dataclass(frozen=True)
class Robot:
    """A Proficio that is awake and zeroed.

    `counts` per motor turn and `torque_units` per N.m by motor; numbers of properties by name for motors and module.
    """

    side: Side
    counts: tuple[int, ...]
    torque_units: tuple[int, ...]
    motor: Mapping[str, int] = field(repr=False)
    sensor: Mapping[str, int] | None = field(repr=False)
    module: Mapping[str, int] | None = field(repr=False)

    def joint_angles(self, counts: proficio.Vector) -> proficio.Vector:
        """Joint angles in rad from the unwrapped counts of each motor."""
        (one, two, three), (x, y, z) = self.counts, counts
        whole = 2 * math.pi
        return proficio.times(proficio.ANGLES_OF_MOTORS, (whole / one * x, whole / two * y, whole / three * z))

    @property
    def about(self) -> str:
        """What an operator is asked about."""
        return f"Proficio, mounted on the {self.side},"

    @property
    def steps(self) -> np.ndarray:
        """Resolution (3,) rad of the joints' angles."""
        return np.asarray(np.abs(proficio.MOTOR_TO_JOINT) @ (2 * math.pi / np.array(self.counts)))

    @property
    def lacks(self) -> tuple[str, ...]:
        """Safeguards that did not answer."""
        there = {MODULE: self.module, SENSOR: self.sensor}
        return tuple(name for name, numbers in there.items() if numbers is None)

    def link(self, limits: Limits, waived: Collection[str], force_axes: np.ndarray) -> Link:
        """The frames of a new session."""
        return BarrettLink(self, limits, waived, force_axes)

    def question(self) -> tuple[list[Frame], frozenset[int]]:
        """What asks for all positions, and on which identifiers they come."""
        awaited = frozenset(answer_of(k + 1, Group.POSITIONS) for k in range(proficio.JOINTS))
        return [Frame(to_group(Group.ARM), encode_request(self.motor["P"]))], awaited

    def holding_torques(self, angles: Vector) -> Vector:
        """Joint torques in N.m that hold the arm's weight at angles in rad."""
        return proficio.holding_torques(angles, self.side)

    def looser_limits(self, line: Line, limits: Limits) -> list[str]:
        """Where limits of a session are looser than those of the robot's module, or the module has none; in words."""
        if self.module is None:
            return []
        torque, speed = (must(line, Node.SAFETY, name, self.module) for name in ("TL2", "VL2"))
        return looser_than(limits.joints, self.torque_units, torque, speed)

    def commanded(self, frames: Sequence[Frame]) -> np.ndarray | None:
        """Joint torques (3,) in N.m of the last torque frame, in the controllers' whole units; None without one."""
        said = [unpack_torques(frame.data) for frame in frames if frame.identifier == TORQUES]
        if not said:
            return None
        return proficio.joint_torques(np.array(said[-1][: proficio.JOINTS]) / np.array(self.torque_units))

    def to_json(self) -> dict[str, Any]:
        """All of it, for a recording."""
        return {**asdict(self), "motor": dict(self.motor)}


def company(wire: Line) -> Frame | None:
    """A frame of another host, to be heard before the own first one; None if nobody else talks to the robot."""
    deadline = wire.now() + int(COMPANY_S * 1e9)
    while (left := (deadline - wire.now()) * 1e-9) > 0:
        timed = wire.receive(left)
        if timed is not None and timed.frame.identifier & SENDER_MASK == 0:
            return timed.frame
    return None


def scan(wire: Line) -> list[FoundNode]:
    """Ask every node whether it is there, and if not, once more.

    Raises:
        BusError: if the bus breaks.
        FrameError: if a node answers what makes no sense.
    """
    found: dict[int, FoundNode] = {}
    for patience in SCAN_S:
        for number in range(1, LAST_NODE + 1):
            if number not in found and ask(wire, number, MONITOR["STAT"], patience) is not None:
                role, version, stat = (must(wire, number, name) for name in ("ROLE", "VERS", "STAT"))
                found[number] = FoundNode(number, kind_of(role), version, stat == AWAKE)
    return [found[number] for number in sorted(found)]


def wake(wire: Line, nodes: list[FoundNode], sleep: Sleep) -> None:
    """Start the firmware of nodes that sleep; none of them may be spoken to while it restarts.

    Raises:
        BusError: if one does not come up.
    """
    asleep = [node for node in nodes if not node.awake]
    for node in asleep:
        wire.send(Frame(to_node(node.number), encode_value(MONITOR["STAT"], AWAKE)))
        sleep(WAKING_S)
    if asleep:
        sleep(SETTLE_S)
    for node in asleep:
        stat = ask(wire, node.number, MONITOR["STAT"], 0.05, TRIES)
        if stat != AWAKE:
            raise BusError(f"node {node.number} ({node.kind.value}) did not wake: STAT is {stat}, 2 was expected")


def start_up(wire: Line, side: Side, sleep: Sleep, at_home: Callable[[], bool]) -> Robot:
    """Bring a Proficio up to where it can be armed.

    Args:
        at_home: asks the operator to put the arm on its stops, if it has not been zeroed; False ends the session.

    Raises:
        MisfitError: if this is no Proficio, the arm is not where it was said to be, or another host talks to it.
        BusError: if the bus or a node fails.
    """
    if (heard := company(wire)) is not None:
        raise MisfitError(f"{wire.name}: another program talks to this robot ({heard}); end its session first")
    nodes = scan(wire)
    motors = [node for node in nodes if node.number <= Node.LAST_MOTOR]
    if [node.number for node in motors] != [1, 2, 3] or any(node.kind is not Kind.MOTOR for node in motors):
        there = ", ".join(f"{node.number} ({node.kind.value})" for node in nodes) or "nothing"
        raise MisfitError(f"{wire.name}: a Proficio has motors 1, 2, 3 and no others; found {there}")
    by_number = {node.number: node for node in nodes}
    wake(wire, nodes, sleep)
    module = by_number.get(Node.SAFETY)
    numbers = motors[0].numbers
    counts = tuple(must(wire, node.number, "CTS", node.numbers) for node in motors)
    units = tuple(must(wire, node.number, "IPNM", node.numbers) for node in motors)
    if min(counts) <= 0 or min(units) <= 0:
        raise MisfitError(
            f"motors say {counts} counts a turn and {units} units per N.m; positive numbers were expected"
        )
    robot = Robot(
        side,
        counts,
        units,
        numbers,
        by_number[Node.FORCE_SENSOR].numbers if Node.FORCE_SENSOR in by_number else None,
        module.numbers if module is not None else None,
    )
    wire.send(Frame(to_group(Group.ARM), encode_value(numbers["MODE"], 0)))
    _zero(wire, robot, at_home)
    if robot.sensor is not None:
        wire.send(Frame(to_node(Node.FORCE_SENSOR), encode_value(robot.sensor["FT"], 0)))
    return robot


def _zero(wire: Line, robot: Robot, at_home: Callable[[], bool]) -> None:
    """Define the positions at the stops, unless that has been done since the power came on."""
    if robot.module is not None and must(wire, Node.SAFETY, "ZERO", robot.module) == 1:
        return
    if not at_home():
        raise MisfitError("the arm is not zeroed and not on its stops; move it there and start again")
    if robot.module is not None:
        wire.send(Frame(to_node(Node.SAFETY), encode_value(robot.module["IFAULT"], VELOCITY_HISTORY)))
    home = proficio.motor_angles(proficio.HOME[robot.side])
    for k, angle in enumerate(home):
        counts = math.floor(robot.counts[k] / (2 * math.pi) * angle)
        wire.send(Frame(to_node(k + 1), encode_value(robot.motor["P"], counts)))
    if robot.module is not None:
        wire.send(Frame(to_node(Node.SAFETY), encode_value(robot.module["ZERO"], 1)))


def ask(wire: Line, node: int, property: int, timeout_s: float, tries: int = 1) -> int | None:
    """Value of a node's property; None if it does not answer in time. Answers to older questions are passed over.

    Args:
        wire: the bus.
        node: number of the node.
        property: number of the property.
        timeout_s: to wait for an answer, in s.
        tries: questions, at most.
    """
    for _ in range(tries):
        value = _asked(wire, node, property, timeout_s)
        if value is not None:
            return value
    return None


def _asked(wire: Line, node: int, property: int, timeout_s: float) -> int | None:
    wire.drain()
    wire.send(Frame(to_node(node), encode_request(property)))
    deadline = wire.now() + int(timeout_s * 1e9)
    while (left := (deadline - wire.now()) * 1e-9) > 0:
        timed = wire.receive(left)
        if timed is None or timed.frame.identifier != answer_of(node, Group.PROPERTIES):
            continue
        try:
            return decode_value(timed.frame.data, property).value
        except FrameError:
            continue
    return None


def must(wire: Line, node: int, name: str, numbers: Mapping[str, int] = MONITOR) -> int:
    """Value of a property that a session cannot do without.

    Args:
        wire: the bus.
        node: number of the node.
        name: of the property.
        numbers: of properties by name.

    Raises:
        BusError: if the node does not answer.
    """
    value = ask(wire, node, numbers[name], ANSWER_S, TRIES)
    if value is None:
        raise BusError(f"{wire.name}: node {node} did not answer for its {name} within {ANSWER_S:g} s")
    return value
