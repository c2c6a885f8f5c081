"""Barrett's Proficio behind the contract of robots; what it is and how it starts up is in `hil.robots.proficio` and
`hil.barrett.start_up`."""

from collections.abc import Callable, Mapping
from typing import Any

from fmus.errors import MisfitError
from hil.barrett.start_up import NODES, TRIES, Robot, ask, company, scan, start_up
from hil.bus.gate import TORQUE_IDENTIFIERS, let_go
from hil.codecs.barrett.identifiers import SENDER_MASK, SENDER_SHIFT
from hil.codecs.barrett.tables import MONITOR
from hil.codecs.frame import Frame
from hil.robots import proficio
from hil.robots.base import Gains, Line, Sleep
from hil.robots.chain import Chain
from hil.robots.defaults import limits_of
from hil.safety.limits import JointLimits, Limits

# Ranges are those in which examples move a Proficio; torques are below the controllers' own limits of 31, 17, 31 N.m.
_RANGES = {
    "right": ((-1.1, 0.5), (-1.05, 1.05), (0.05, 2.9)),
    "left": ((-1.1, 0.5), (-1.05, 1.05), (-2.9, -0.05)),
}
_TORQUES, _RATE, _SPEED = (20.0, 15.0, 12.0), 2000.0, 1.5
# N.m under which the proof shows that each joint turns; more moves it for certain.
_PROOF_TORQUES = (4.0, 4.0, 3.0)
# rad/s by which a joint may speed up though nothing known pushes it: half of what it may do at all.
_UNEXPLAINED = 0.5 * _SPEED
# A motor on a bus that is back answers within so long.
ANSWER_S = 0.05


class Proficio:
    """A rehabilitation arm with three joints, a force sensor and a safety module; `side` is where it is mounted.

    Raises:
        MisfitError: if there is no such side.
    """

    name, joints = "Proficio", proficio.JOINTS
    frame = "robot: Proficio (1 lifts the arm, 2 turns it in the plane, 3 bends the elbow)"
    torque_identifiers = TORQUE_IDENTIFIERS
    heard = tuple((node << SENDER_SHIFT, SENDER_MASK) for node in (0, *NODES))

    def __init__(self, side: proficio.Side = "right") -> None:
        if side not in proficio.HOME:
            raise MisfitError(f"side = {side!r}; left or right was expected")
        self.side: proficio.Side = side

    @property
    def chain(self) -> Chain:
        """Its links."""
        return proficio.chain(self.side)

    def limits(self, rate_hz: float) -> Limits:
        """Those in which the vendor's examples move it."""
        joints = tuple(
            JointLimits(torque, _RATE, _SPEED, low, high, breakaway=breakaway)
            for torque, breakaway, (low, high) in zip(_TORQUES, _PROOF_TORQUES, _RANGES[self.side], strict=True)
        )
        return limits_of(joints, rate_hz, _UNEXPLAINED)

    def gains(self) -> Gains:
        """A posture that gives way to a person."""
        return Gains((40.0, 40.0, 20.0), (2.0, 2.0, 1.0), _PROOF_TORQUES)

    def company(self, line: Line) -> Frame | None:
        """A frame of another host."""
        return company(line)

    def enumerate(self, line: Line) -> list[str]:
        """Nodes with their firmware."""
        return [
            f"node {node.number}: {node.kind.value}, firmware {node.version}, {'awake' if node.awake else 'asleep'}"
            for node in scan(line)
        ]

    def start_up(self, line: Line, sleep: Sleep, at_home: Callable[[], bool]) -> Robot:
        """Look who is there, wake them, ask for their scales, and zero the arm if it has not been."""
        return start_up(line, self.side, sleep, at_home)

    def missing(self, line: Line) -> str:
        """A motor that does not answer."""
        for motor in range(1, self.joints + 1):
            if ask(line, motor, MONITOR["STAT"], ANSWER_S, TRIES) is None:
                return f"{line.name}: motor {motor} does not answer"
        return ""

    def stop(self) -> list[Frame]:
        """No torque, and motors idle, where they brake by themselves."""
        return let_go()

    def restore(self, document: Mapping[str, Any]) -> Robot:
        """The robot of a recording."""
        return Robot(**{**document, **{name: tuple(document[name]) for name in ("counts", "torque_units")}})
