"""Barrett's frames as a DBC, for tools that know nothing of the protocol: made from the same tables as the codecs.

Angles are those of motors and torques those at motors, in rad and N.m, by what the motors say of themselves (CTS, IPNM).
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from fmus.errors import MisfitError
from hil.codecs.barrett.force_torque import DIVISORS, UNITS
from hil.codecs.barrett.identifiers import Group, Node, answer_of, to_group, to_node
from hil.codecs.barrett.tables import Kind, properties
from hil.codecs.barrett.torques import MOST, SLOTS

# Motors by the name of the robot.
ROBOTS: Mapping[str, int] = {"proficio": 3, "wam4": 4, "wam7": 7}
# Properties whose answers have 32 bits (the number after them is theirs, too).
_LONG = frozenset({"P", "DP", "E", "OT", "CT", "M", "MECH", "CTS", "IOFF", "HALLH", "EN", "JP", "JOFST", "SN"})
_PROPERTY_UNITS = {"TEMP": "degC", "PTEMP": "degC", "OTEMP": "degC", "VBUS": "V", "VLOGIC": "V"}
_CHOICES = {
    (Kind.MOTOR, "MODE"): {0: "idle", 1: "duty", 2: "torque", 3: "PID", 4: "velocity", 5: "trapezoidal"},
    (Kind.SAFETY, "MODE"): {0: "emergency stop", 1: "idle", 2: "active"},
}
# Signals in the pendant's answer: start bit in the frame, bits.
_PENDANT = {
    "Button": (42, 2), "ActivateLight": (41, 1), "IdleLight": (40, 1), "Display": (32, 8), "Other": (28, 3),
    "Heartbeat": (25, 3), "Voltage": (22, 3), "Torque": (19, 3), "Velocity": (16, 3),
}  # fmt: skip
_HOST = "Host"


@dataclass(frozen=True)
class _Signal:
    """A line `SG_`: `start` as a DBC counts bits, `order` 1 for little-endian; `choice` of a multiplexer's value, or
    "M" for it."""

    name: str
    start: int
    size: int
    order: int = 1
    sign: str = "-"
    factor: float = 1.0
    unit: str = ""
    choice: str = ""

    def line(self, reader: str) -> str:
        low, high = (-(1 << self.size - 1), (1 << self.size - 1) - 1) if self.sign == "-" else (0, (1 << self.size) - 1)
        ends = f"[{low * self.factor:.12g}|{high * self.factor:.12g}]"
        place = f"{self.start}|{self.size}@{self.order}{self.sign}"
        choice = f" {self.choice}" if self.choice else ""
        return f' SG_ {self.name}{choice} : {place} ({self.factor:.17g},0) {ends} "{self.unit}" {reader}'


def dbc_of(robot: str, counts: float = 4096, torque_units: float = 2700, version: int = 200) -> str:
    """The text of a DBC for a robot.

    Args:
        robot: one of `ROBOTS`.
        counts: counts of a motor's encoder in a turn (CTS); `torque_units` of its controller per N.m (IPNM).
        version: firmware of the motors, which numbers their properties.

    Raises:
        MisfitError: if there is no such robot, or such numbers.
    """
    if robot not in ROBOTS:
        raise MisfitError(f"there is no robot {robot!r}; there are {', '.join(ROBOTS)}")
    if not (math.isfinite(counts) and counts > 0 and math.isfinite(torque_units) and torque_units > 0):
        raise MisfitError(
            f"{counts:g} counts a turn and {torque_units:g} units per N.m; positive numbers were expected"
        )
    motors = range(1, ROBOTS[robot] + 1)
    nodes = [_HOST, *(f"Motor{k}" for k in motors), "ForceSensor", "SafetyModule"]
    messages = [*_from_host(motors, torque_units), *_from_nodes(motors, counts, version)]
    choices = [
        f"VAL_ {identifier} {name} " + " ".join(f'{value} "{words}"' for value, words in given.items()) + " ;"
        for identifier, kind in _answering(motors)
        for (of, name), given in _CHOICES.items()
        if of is kind
    ]
    head = f'VERSION "misfit {robot}"\n\nNS_ :\n\nBS_:\n\nBU_: {" ".join(nodes)}\n'
    said = f"CTS {counts:g}, IPNM {torque_units:g}, firmware {version}"
    about = f'CM_ "Barrett {robot}: angles of motors and torques at motors, for {said}.";'
    return "\n\n".join([head, *messages, about, *choices]) + "\n"


def _answering(motors: range) -> list[tuple[int, Kind]]:
    """Identifiers on which nodes answer for their properties, and what they are."""
    nodes = [*((k, Kind.MOTOR) for k in motors), (Node.SAFETY, Kind.SAFETY)]
    return [(answer_of(number, Group.PROPERTIES), kind) for number, kind in nodes]


def _message(identifier: int, name: str, size: int, sender: str, signals: list[_Signal]) -> str:
    reader = "Vector__XXX" if sender == _HOST else _HOST
    return "\n".join([f"BO_ {identifier} {name}: {size} {sender}", *(signal.line(reader) for signal in signals)])


def _from_host(motors: range, torque_units: float) -> Iterator[str]:
    """Torques, and what is asked or set."""
    for group, first in ((Group.LOWER_TORQUES, 1), (Group.UPPER_TORQUES, SLOTS + 1)):
        slots = [k for k in motors if first <= k < first + SLOTS]
        signals = [_torque(slot, motor, torque_units) for slot, motor in enumerate(slots)]
        if signals:
            yield _message(to_group(group), f"Torques{first}", 8, _HOST, signals)
    receivers = [(to_node(k), f"Motor{k}") for k in motors]
    receivers += [(to_node(Node.FORCE_SENSOR), "ForceSensor"), (to_node(Node.SAFETY), "SafetyModule")]
    receivers += [(to_group(Group.ALL), "All"), (to_group(Group.ARM), "Arm")]
    for identifier, name in receivers:
        asked = [_Signal("Property", 0, 7, sign="+"), _Signal("Sets", 7, 1, sign="+")]
        yield _message(identifier, f"To{name}", 1, _HOST, asked)


def _torque(slot: int, motor: int, torque_units: float) -> _Signal:
    """A torque of 14 bits after the first byte, most significant bit first."""
    byte, bit = divmod(8 + 14 * slot, 8)
    return _Signal(f"Torque{motor}", 8 * byte + 7 - bit, MOST.bit_length() + 1, 0, "-", 1.0 / torque_units, "N.m")


def _from_nodes(motors: range, counts: float, version: int) -> Iterator[str]:
    """Positions, properties and readings."""
    for k in motors:
        angle = _Signal("Angle", 5, 22, 0, "-", 2 * math.pi / counts, "rad")
        yield _message(answer_of(k, Group.POSITIONS), f"Position{k}", 3, f"Motor{k}", [angle])
        yield _answers(k, f"Motor{k}", Kind.MOTOR, version)
    for group, name in ((Group.FORCE, "Force"), (Group.TORQUE, "ForceTorque"), (Group.ACCELERATION, "Acceleration")):
        factor, unit = 1.0 / DIVISORS[group], UNITS[group].replace("m/s2", "m/s^2")
        axes = [_Signal(axis.upper(), 16 * place, 16, 1, "-", factor, unit) for place, axis in enumerate("xyz")]
        yield _message(answer_of(Node.FORCE_SENSOR, group), name, 6, "ForceSensor", axes)
    yield _answers(Node.FORCE_SENSOR, "ForceSensor", Kind.FORCE_SENSOR, version)
    yield _answers(Node.SAFETY, "SafetyModule", Kind.SAFETY, version)


def _answers(node: int, sender: str, kind: Kind, version: int) -> str:
    """All properties of a node; the first byte says which one a frame holds."""
    signals = [_Signal("Answers", 0, 8, sign="+", choice="M")]
    for name, number in properties(kind, version).items():
        choice = f"m{0x80 | number}"
        if name == "PEN":
            signals += [
                _Signal(f"Pendant{part}", start, size, sign="+", choice=choice)
                for part, (start, size) in _PENDANT.items()
            ]
            continue
        size = 32 if name in _LONG else 16
        signals.append(_Signal(name, 16, size, unit=_PROPERTY_UNITS.get(name, ""), choice=choice))
    return _message(answer_of(node, Group.PROPERTIES), f"{sender}Says", 6, sender, signals)
