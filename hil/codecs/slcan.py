"""The text of serial CAN adapters (slcan, after LAWICEL): `t42330003E8`, ended by a carriage return, both ways.

`t` and three hexadecimal digits of the identifier, or `T` and eight, one digit of the length, two for each byte, and from
adapters that stamp four more of the time in ms; `r` and `R` are remote frames. A carriage return alone acknowledges a
command, a bell refuses one.
"""

import re

import can

from hil.codecs.can_text import Heard, Language
from hil.codecs.frame import MOST_BYTES, Frame
from hil.errors import FrameError

# No line is longer; what is has lost its end.
LONGEST = 64
_STANDARD = re.compile(r"t([0-7][0-9A-Fa-f]{2})([0-8])((?:[0-9A-Fa-f]{2}){0,8})([0-9A-Fa-f]{4})?", re.ASCII)
_OTHER = re.compile(r"([TRr])([0-7][0-9A-Fa-f]{2}|[01][0-9A-Fa-f]{7})([0-8])((?:[0-9A-Fa-f]{2})*)", re.ASCII)
_DIGITS = {"T": 8, "R": 8, "r": 3}


def cut(text: str) -> tuple[list[str], str]:
    r"""Lines without their ends, and what may be the begin of one more; acknowledgements are passed over.

    Example:
        >>> cut("\r\rt12300\rt4")
        (['t12300'], 't4')
    """
    *lines, rest = text.replace("\a", "\r").split("\r")
    # One character more than may be shows later that it was too long.
    return [line for line in lines if line and len(line) <= LONGEST], rest[: LONGEST + 1]


def parse(text: str) -> Heard:
    """What a line stands for; None for what is no frame."""
    match = _STANDARD.fullmatch(text)
    if match is None:
        return _other(text)
    size = 2 * int(match[2])
    data = match[3] + (match[4] or "")
    if len(data) not in (size, size + 4):
        return None
    return Frame(int(match[1], 16), bytes.fromhex(data[:size]))


def stamp(text: str) -> None:
    """Adapters that stamp count ms of a minute, which says nothing of the host's time."""


def write(frame: Frame) -> bytes:
    """The line that puts a frame on the bus."""
    identifier, data = frame.identifier, frame.data
    return f"t{identifier:03X}{len(data)}{data.hex().upper()}\r".encode()


def write_message(message: can.Message) -> bytes:
    """The same for a message of python-can, which may be remote or have an extended identifier.

    Raises:
        FrameError: for an error or FD frame.
    """
    if message.is_error_frame or message.is_fd or message.dlc > MOST_BYTES:
        raise FrameError(f"slcan carries classic frames of up to {MOST_BYTES} bytes only; not sent: {message}")
    letter = "r" if message.is_remote_frame else "t"
    head = (
        f"{letter.upper()}{message.arbitration_id:08X}"
        if message.is_extended_id
        else f"{letter}{message.arbitration_id:03X}"
    )
    data = "" if message.is_remote_frame else message.data.hex().upper()
    return f"{head}{message.dlc}{data}\r".encode()


def _other(text: str) -> can.Message | None:
    match = _OTHER.fullmatch(text)
    if match is None or len(match[2]) != _DIGITS[match[1]]:
        return None
    remote, size, data = match[1] in "Rr", int(match[3]), bytes.fromhex(match[4])
    if len(data) - (0 if remote else size) not in (0, 2):
        return None
    return can.Message(
        arbitration_id=int(match[2], 16),
        is_extended_id=match[1] != "r",
        is_remote_frame=remote,
        dlc=size,
        data=None if remote else data[:size],
    )


SLCAN = Language(cut, parse, stamp, write, write_message)
