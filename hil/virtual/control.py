"""Words to a virtual robot beside its bus: what its caregiver does, which button is pressed, which fault happens.

They come as `< misfit WORDS >` over any connection to the socketcand server; other programs never say that.
"""

import socket
from collections.abc import Callable
from types import TracebackType

from fmus.errors import MisfitError
from hil.codecs.barrett.safety_module import Button, Level
from hil.codecs.frame import Frame, Timed
from hil.virtual.arm_plant import ArmPlant
from hil.virtual.faults import Fault, Faults
from hil.virtual.robot import RealTime, VirtualRobot

LATE_NS = 3_000_000


class Control:
    """Follows words; `follow` says whether they were understood."""

    def __init__(self, robot: RealTime, faults: Faults) -> None:
        self.robot, self.faults = robot, faults
        # What was changed, and its value before.
        self._before: list[tuple[object, str, object]] = []

    def follow(self, words: list[str], time_ns: int) -> bool:
        """Do what is said.

        hold, relax: the caregiver takes hold of the wrist, or lets go.
        press BUTTON: estop, activate, idle or none on the pendant.
        lose|late|double|corrupt|freeze [N]: the next N position answers (all without a number) do not come, come 3 ms
        late, twice, with a bit flipped, or repeat the first one. silence N: node N answers no longer. fail N: drive N
        has a fault. drift NEWTON, saturate: of the force sensor. warn: the safety module warns. heal: all of that ends,
        but not a drive's fault.
        """
        verb, rest = (words[0], words[1:]) if words else ("", [])
        try:
            return self._caregiver(verb) or self._node(verb, rest, time_ns) or self._frames(verb, rest)
        except (ValueError, KeyError, IndexError):
            return False

    def _caregiver(self, verb: str) -> bool:
        plant = self.robot.plant
        if verb not in ("hold", "relax") or not isinstance(plant, ArmPlant):
            return False
        plant.caregiver.hold() if verb == "hold" else plant.caregiver.relax()
        return True

    def _node(self, verb: str, rest: list[str], time_ns: int) -> bool:
        robot = self.robot
        if verb == "silence":
            self._change(next(node for node in robot.nodes if node.number == int(rest[0])), "powered", False)
        elif verb == "fail":
            return robot.fail(int(rest[0]), time_ns)
        elif not isinstance(robot, VirtualRobot):
            return False
        elif verb == "press":
            robot.safety.press(Button[rest[0].upper()], time_ns)
        elif verb == "drift":
            self._change(robot.sensor, "zero", robot.sensor.zero + float(rest[0]))
        elif verb == "saturate":
            self._change(robot.sensor, "zero", robot.sensor.zero + 1e4)
        elif verb == "warn":
            self._change(robot.safety, "levels", {**robot.safety.levels, "voltage": Level.WARNING})
        else:
            return False
        return True

    def _change(self, thing: object, name: str, value: object) -> None:
        self._before.append((thing, name, getattr(thing, name)))
        setattr(thing, name, value)

    def _frames(self, verb: str, rest: list[str]) -> bool:
        if verb == "heal":
            self.faults.towards_host.clear()
            while self._before:
                setattr(*self._before.pop())
            return True
        if not self.robot.positions:
            return False
        count = int(rest[0]) if rest else None
        self.faults.towards_host.append(_limited(_CHANGES[verb](self.robot), count, self.robot.positions))
        return True


def _limited(change: Fault, count: int | None, positions: frozenset[int]) -> Fault:
    """A fault of so many position answers."""
    left = count

    def fault(timed: Timed) -> list[Timed]:
        nonlocal left
        if timed.frame.identifier not in positions or left == 0:
            return [timed]
        left = None if left is None else left - 1
        return change(timed)

    return fault


def _with(timed: Timed, data: bytes) -> list[Timed]:
    return [Timed(timed.time_ns, Frame(timed.frame.identifier, data))]


def _flip(robot: RealTime) -> Fault:
    high = robot.position[2]

    def fault(timed: Timed) -> list[Timed]:
        data = timed.frame.data
        return _with(timed, bytes([*data[:high], data[high] ^ 0x10, *data[high + 1 :]]))

    return fault


def _freeze(robot: RealTime) -> Fault:
    first, (begin, end, _) = dict[int, bytes](), robot.position

    def fault(timed: Timed) -> list[Timed]:
        data = timed.frame.data
        return _with(timed, data[:begin] + first.setdefault(timed.frame.identifier, data[begin:end]) + data[end:])

    return fault


_CHANGES: dict[str, Callable[[RealTime], Fault]] = {
    "lose": lambda robot: lambda timed: [],
    "late": lambda robot: lambda timed: [Timed(timed.time_ns + LATE_NS, timed.frame)],
    "double": lambda robot: lambda timed: [timed, timed],
    "corrupt": _flip,
    "freeze": _freeze,
}


PATIENCE_S = 5.0


class Remote:
    """A connection beside the bus, open within a `with` block."""

    def __init__(self, port: int, host: str = "127.0.0.1") -> None:
        """Connect.

        Raises:
            MisfitError: if no virtual robot is there.
        """
        try:
            self._socket = socket.create_connection((host, port), PATIENCE_S)
            greeting = self._socket.recv(64)
        except OSError as error:
            raise MisfitError(
                f"no virtual robot at {host}, port {port}: {error}; start one: misfit hil robot"
            ) from error
        if greeting != b"< hi >":
            raise MisfitError(f"what listens at {host}, port {port} is no virtual robot; name the port of one")

    def tell(self, words: str) -> None:
        """Say something and wait for the answer.

        Raises:
            MisfitError: if it was not understood, or nobody answers.
        """
        try:
            self._socket.sendall(f"< misfit {words} >".encode("ascii"))
            answer = self._socket.recv(64)
        except (OSError, UnicodeEncodeError) as error:
            raise MisfitError(f"the virtual robot does not answer to {words!r}: {error}") from error
        if answer != b"< ok >":
            raise MisfitError(f"the virtual robot does not understand {words!r}; what it does is in docs/bench.md")

    def __enter__(self) -> "Remote":
        """Itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the connection."""
        self._socket.close()
