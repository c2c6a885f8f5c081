"""Walk through a bus and say in plain words what is there, missing or set up wrongly; nothing is energised."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

from fmus.errors import MisfitError
from hil.barrett.module_limits import looser_than
from hil.barrett.start_up import ANSWER_S, FoundNode, ask, company, scan, wake
from hil.bus.wire import Wire
from hil.codecs.barrett.identifiers import Group, Node, answer_of, to_group
from hil.codecs.barrett.properties import encode_request
from hil.codecs.barrett.safety_module import decode_mode, decode_pendant
from hil.codecs.barrett.tables import Kind
from hil.codecs.frame import Frame
from hil.errors import BusError, FrameError
from hil.robots.absent import MODULE, SENSOR, refusal
from hil.robots.base import RobotKind, Sleep
from hil.safety.limits import JointLimits

# Nodes without which a session is refused, unless its bench file says otherwise.
_SAFEGUARDS = {Kind.SAFETY: MODULE, Kind.FORCE_SENSOR: SENSOR}
# A cycle is tried so many times; its slowest tells whether a rate can be held.
TRIES = 200


@dataclass(frozen=True)
class Finding:
    """One line: whether it is as it should be, and what was found."""

    good: bool
    words: str


def check_any(wire: Wire, kind: RobotKind, rate_hz: float) -> Iterator[Finding]:
    """Look at a robot of any kind as far as its contract goes: who else is there, who answers. Nothing is woken.

    Args:
        wire: the bus with its filters.
        kind: the robot by its contract.
        rate_hz: cycles a second of the session that is planned.

    Yields:
        What is well and what is not, each with words for the user.

    Raises:
        BusError: if the bus breaks.
    """
    if (heard := kind.company(wire)) is not None:
        yield Finding(False, f"another program talks to this robot ({heard}); it is left alone, end that session first")
        return
    missing = kind.missing(wire)
    yield from (Finding(not missing, words) for words in kind.enumerate(wire))


def check(
    wire: Wire, rate_hz: float, sleep: Sleep, joints: Sequence[JointLimits] = (), waived: Collection[str] = ()
) -> Iterator[Finding]:
    """Look at everything that a session needs; motors are woken for it.

    Args:
        wire: the bus with its filters.
        rate_hz: cycles a second of the session that is planned.
        sleep: waits so many s.
        joints: limits of the session, which are compared with those of the safety module.
        waived: safeguards that this bench may do without, see `hil.robots.absent`.

    Yields:
        What is well and what is not, each with words for the user.

    Raises:
        BusError: if the bus breaks.
    """
    if (heard := company(wire)) is not None:
        yield Finding(False, f"another program talks to this robot ({heard}); it is left alone, end that session first")
        return
    try:
        nodes = scan(wire)
    except (MisfitError, FrameError) as error:
        yield Finding(False, str(error))
        return
    if not nodes:
        yield Finding(
            False, f"{wire.name}: nothing answers; is the robot on, is the bit rate 1 Mbit/s, is the cable plugged in?"
        )
        return
    by_number = {node.number: node for node in nodes}
    for number, kind in ((1, Kind.MOTOR), (2, Kind.MOTOR), (3, Kind.MOTOR), (8, Kind.FORCE_SENSOR), (10, Kind.SAFETY)):
        yield _place(by_number.get(number), number, kind, waived)
    for node in nodes:
        if node.number not in (1, 2, 3, 8, 10):
            yield Finding(False, f"node {node.number} is a {node.kind.value} that a Proficio does not have")
    if Node.SAFETY in by_number:
        yield from _module(wire, by_number[Node.SAFETY])
    motors = [by_number[k] for k in (1, 2, 3) if k in by_number]
    if len(motors) < 3:
        return
    try:
        wake(wire, motors, sleep)
    except BusError as error:
        yield Finding(False, str(error))
        return
    yield from _motors(wire, motors)
    if Node.SAFETY in by_number and by_number[Node.SAFETY].awake and joints:
        yield _tighter(wire, motors, by_number[Node.SAFETY], joints)
    yield _round_trip(wire, motors[0], rate_hz)


def _place(node: FoundNode | None, number: int, kind: Kind, waived: Collection[str]) -> Finding:
    if node is None:
        words, safeguard = f"node {number} ({kind.value}) does not answer", _SAFEGUARDS.get(kind)
        if safeguard in waived:
            return Finding(True, f"{words}; the bench file says that a session may do without, its limits are halved")
        return Finding(False, words if safeguard is None else f"{words}: {refusal(safeguard)}")
    if node.kind is not kind:
        return Finding(False, f"node {number} is a {node.kind.value}, a {kind.value} belongs there")
    state = "awake" if node.awake else "asleep, a session wakes it"
    return Finding(True, f"node {number}: {kind.value}, firmware {node.version}, {state}")


def _module(wire: Wire, node: FoundNode) -> Iterator[Finding]:
    if not node.awake:
        return
    values = {
        name: ask(wire, Node.SAFETY, node.numbers[name], ANSWER_S) for name in ("MODE", "PEN", "ZERO", "VL2", "TL2")
    }
    silent = [name for name, value in values.items() if value is None]
    if silent:
        yield Finding(False, f"the safety module does not answer for {', '.join(silent)}")
        return
    known = {name: value for name, value in values.items() if value is not None}
    try:
        mode = decode_mode(known["MODE"])
        pendant = decode_pendant(known["PEN"])
    except FrameError as error:
        yield Finding(False, str(error))
        return
    yield Finding(
        mode > 0, f"safety module: {mode.name}; heartbeat {pendant.heartbeat.name}, voltage {pendant.voltage.name}"
    )
    yield Finding(
        True, "the arm is zeroed" if known["ZERO"] == 1 else "the arm is not zeroed; a session asks for its stops"
    )
    speed = known["VL2"] / 4096
    yield Finding(0 < speed <= 2.0, f"limit of speed {speed:g} m/s" + ("" if speed else ": none is set"))
    yield Finding(known["TL2"] > 0, f"limit of torque {known['TL2']} units" + ("" if known["TL2"] else ": none is set"))


def _motors(wire: Wire, motors: list[FoundNode]) -> Iterator[Finding]:
    for k, node in enumerate(motors):
        counts, units, slot = (ask(wire, node.number, node.numbers[name], ANSWER_S) for name in ("CTS", "IPNM", "PIDX"))
        good = bool(counts and counts > 0 and units and units > 0)
        yield Finding(good, f"motor {node.number}: {counts} counts a turn, {units} units per N.m")
        if slot not in (k, k + 1):
            yield Finding(
                False,
                f"motor {node.number} takes torque {slot} of the frame; {k} (or {k + 1}, counted from 1) was expected",
            )


def _tighter(wire: Wire, motors: list[FoundNode], module: FoundNode, joints: Sequence[JointLimits]) -> Finding:
    """Whether the session's limits are within the module's."""
    units = [ask(wire, node.number, node.numbers["IPNM"], ANSWER_S) for node in motors]
    torque, speed = (ask(wire, Node.SAFETY, module.numbers[name], ANSWER_S) for name in ("TL2", "VL2"))
    known = [value for value in (*units, torque, speed) if value is not None]
    if len(known) < len(units) + 2:
        return Finding(False, "the session's limits cannot be compared with the safety module's: it does not answer")
    *scales, torque_limit, speed_limit = known
    found = looser_than(joints, scales, torque_limit, speed_limit)
    return Finding(not found, "; ".join(found) or "the session's torques are within the safety module's limit")


def _round_trip(wire: Wire, motor: FoundNode, rate_hz: float) -> Finding:
    """Whether all positions come back fast enough: whole cycles, since a single question and answer shows less."""
    awaited = {answer_of(k, Group.POSITIONS) for k in (1, 2, 3)}
    times = []
    for _ in range(TRIES):
        wire.drain()
        began, missing = wire.now(), set(awaited)
        wire.send(Frame(to_group(Group.ARM), encode_request(motor.numbers["P"])))
        while missing and wire.now() - began < 100_000_000:
            timed = wire.receive(0.02)
            if timed is None:
                break
            missing.discard(timed.frame.identifier)
        times.append((wire.now() - began) * 1e-6)
    times.sort()
    slowest, period = times[int(0.99 * len(times))], 1e3 / rate_hz
    words = f"positions of all motors in {times[len(times) // 2]:.3g} ms (median), {slowest:.3g} ms (99 %)"
    if slowest > 0.5 * period:
        return Finding(False, f"{words}: too slow for {rate_hz:g} Hz, which leaves {0.5 * period:.3g} ms; lower --rate")
    return Finding(True, f"{words}: fast enough for {rate_hz:g} Hz")
