"""Who speaks to whom: identifiers are a group flag (bit 10), the sender (bits 9 to 5) and the receiver (bits 4 to 0)."""

from enum import IntEnum
from functools import cache
from typing import NamedTuple

from hil.codecs.frame import LAST_IDENTIFIER
from hil.errors import FrameError, ValueRangeError

LAST_NODE = 31
_GROUP_FLAG = 0x400
SENDER_MASK, SENDER_SHIFT = 0x3E0, 5


class Node(IntEnum):
    """Nodes with a fixed place; motors have 1 to 7, the hand 11 to 14."""

    HOST = 0
    FIRST_MOTOR = 1
    LAST_MOTOR = 7
    FORCE_SENSOR = 8
    SAFETY = 10


class Group(IntEnum):
    """Receivers that are not one node, and channels on which nodes answer."""

    ALL = 0
    LOWER_TORQUES = 1
    UPPER_TORQUES = 2
    POSITIONS = 3
    ARM = 4
    HAND = 5
    PROPERTIES = 6
    JOINT_POSITIONS = 7
    FORCE = 10
    TORQUE = 11
    ACCELERATION = 12


class Address(NamedTuple):
    """Sender and receiver of a frame; the receiver is a group if `to_group`."""

    sender: int
    receiver: int
    to_group: bool = False

    @property
    def identifier(self) -> int:
        """The 11 bits on the bus.

        Raises:
            ValueRangeError: if a node or group has no 5 bits.

        Example:
            >>> hex(Address(Node.FIRST_MOTOR, Group.PROPERTIES, to_group=True).identifier)
            '0x426'
        """
        for words, number in (("sender", self.sender), ("receiver", self.receiver)):
            if not 0 <= number <= LAST_NODE:
                raise ValueRangeError(f"{words} {number} is outside [0, {LAST_NODE}], the nodes and groups of the bus")
        return _GROUP_FLAG * self.to_group | self.sender << 5 | self.receiver


def address_of(identifier: int) -> Address:
    """Take an identifier apart.

    Raises:
        FrameError: if it is no standard identifier.
    """
    if not 0 <= identifier <= LAST_IDENTIFIER:
        raise FrameError(f"identifier {identifier:#x} is outside [0x0, {LAST_IDENTIFIER:#x}], the standard ones")
    return Address(identifier >> 5 & LAST_NODE, identifier & LAST_NODE, bool(identifier & _GROUP_FLAG))


@cache
def to_node(node: int) -> int:
    """Identifier of a frame from the host to a node."""
    return Address(Node.HOST, node).identifier


@cache
def to_group(group: Group) -> int:
    """Identifier of a frame from the host to a group."""
    return Address(Node.HOST, group, to_group=True).identifier


@cache
def answer_of(node: int, group: Group) -> int:
    """Identifier on which a node answers."""
    return Address(node, group, to_group=True).identifier
