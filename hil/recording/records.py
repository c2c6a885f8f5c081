"""What is recorded, 24 bytes each: frames with their times, and what a cycle's decision depended on besides them."""

from collections.abc import Iterator, Sequence
from enum import IntEnum
from struct import Struct
from typing import NamedTuple

from hil.codecs.frame import Frame, Timed

MAGIC = b"misfit frames 1\n"
# kind, flags, identifier, data bytes, time in ns, data
RECORD = Struct("<BBHIq8s")
DOUBLE = Struct("<d")


class Kind(IntEnum):
    """What a record is; `DECIDED` are the frames that a cycle's decision sent, `BEGIN` is when the cycles begin,
    `ASKED` the torque of a joint that a program beside the session asked for, ahead of its cycle."""

    RECEIVED = 1
    SENT = 2
    DECIDED = 3
    CYCLE = 4
    BEGIN = 5
    ASKED = 6


class Flag(IntEnum):
    """Wishes and state in a cycle's record."""

    ARM = 1
    ABORT = 2
    RECORDING = 4
    END = 8
    WATCHED = 16
    CONFIRM = 32
    WATCHDOG_SILENT = 64


class Record(NamedTuple):
    """One record; `data` of a cycle is the time (ns) that the controller took in the cycle before."""

    kind: Kind
    flags: int
    timed: Timed


def pack_frame(kind: Kind, timed: Timed) -> bytes:
    """Bytes of a frame's record."""
    frame = timed.frame
    return RECORD.pack(kind, 0, frame.identifier, len(frame.data), timed.time_ns, frame.data)


def pack_cycle(start_ns: int, flags: int, computing_ns: int) -> bytes:
    """Bytes of a cycle's record."""
    return RECORD.pack(Kind.CYCLE, flags, 0, 8, start_ns, computing_ns.to_bytes(8, "little", signed=True))


def pack_asked(start_ns: int, torques: Sequence[float]) -> Iterator[bytes]:
    """Bytes of the records of what was asked for from outside (N.m), one a joint."""
    for joint, torque in enumerate(torques):
        yield RECORD.pack(Kind.ASKED, 0, joint, 8, start_ns, DOUBLE.pack(torque))


def pack_begin(time_ns: int) -> bytes:
    """Bytes of the record before the first cycle."""
    return RECORD.pack(Kind.BEGIN, 0, 0, 0, time_ns, b"")


def unknown_kind(kind: int) -> str:
    """Why a record cannot be read."""
    return f"a record of the kind {kind}, which is not known"


def unpack_records(data: bytes) -> Iterator[Record]:
    """Records of bytes; a last one that is cut off is left out."""
    whole = len(data) - len(data) % RECORD.size
    for kind, flags, identifier, size, time_ns, content in RECORD.iter_unpack(data[:whole]):
        if kind not in _KINDS:
            raise ValueError(unknown_kind(kind))
        yield Record(_KINDS[kind], flags, Timed(time_ns, Frame(identifier, content[:size])))


# A look into a table costs a third of a call of the enumeration.
_KINDS = {int(kind): kind for kind in Kind}
