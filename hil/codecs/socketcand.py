"""The text of a socketcand server in raw mode: `< frame 423 1795222169.624496 0003E8 >` comes, `< send 401 2 aa 1 >` goes."""

import re

import can

from hil.codecs.can_text import Heard, Language
from hil.codecs.frame import LAST_IDENTIFIER, MOST_BYTES, Frame
from hil.errors import FrameError

# No saying is longer; a `<` whose `>` is further away is garbage.
LONGEST = 256
LAST_EXTENDED = 0x1FFFFFFF
# Servers write data with blanks between the bytes or without, and a frame without data with one blank more or less.
_FRAME = re.compile(
    r" *frame ([0-9A-Fa-f]{3}|[0-9A-Fa-f]{8}) +([0-9]+\.[0-9]+) *((?: *[0-9A-Fa-f]{2}){0,8}) *", re.ASCII
)
_ERROR = re.compile(r" *error (?:([0-9A-Fa-f]{1,8}) +([0-9]+\.[0-9]+) *$)?", re.ASCII)


def cut(text: str) -> tuple[list[str], str]:
    r"""Sayings without their brackets, and what may be the begin of one more; all else is passed over.

    Example:
        >>> cut("noise < ok >< frame 123 1.5 A")
        ([' ok '], '< frame 123 1.5 A')
    """
    *parts, rest = text.split(">")
    found = [part[at + 1 :] for part in parts if (at := part.rfind("<")) >= 0 and len(part) - at <= LONGEST]
    at = rest.rfind("<")
    # One character more than may be shows later that it was too long.
    return found, rest[at : at + LONGEST + 1] if at >= 0 else ""


def parse(text: str) -> Heard:
    """What a saying stands for; None for what is no frame and no error."""
    match = _FRAME.fullmatch(text)
    if match is None:
        return _error(text)
    identifier, data = int(match[1], 16), bytes.fromhex(match[3])
    if len(match[1]) == 3:
        return Frame(identifier, data) if identifier <= LAST_IDENTIFIER else None
    return can.Message(arbitration_id=identifier, data=data) if identifier <= LAST_EXTENDED else None


def stamp(text: str) -> float | None:
    """The server's time of a frame or an error frame in s."""
    match = _FRAME.fullmatch(text) or _ERROR.match(text)
    return float(match[2]) if match is not None and match[2] else None


def write(frame: Frame) -> bytes:
    """The saying that puts a frame on the bus."""
    identifier, data = frame.identifier, frame.data
    return f"< send {identifier:03X} {len(data):X} {data.hex(' ')} >".encode()


def write_message(message: can.Message) -> bytes:
    """The same for a message of python-can, which may have an extended identifier.

    Raises:
        FrameError: for a remote, error or FD frame: the server would take it for a data frame.
    """
    if message.is_remote_frame or message.is_error_frame or message.is_fd or len(message.data) > MOST_BYTES:
        raise FrameError(f"socketcand carries data frames of up to {MOST_BYTES} bytes only; not sent: {message}")
    digits = 8 if message.is_extended_id else 3
    return f"< send {message.arbitration_id:0{digits}X} {len(message.data):X} {message.data.hex(' ')} >".encode()


def _error(text: str) -> can.Message | None:
    match = _ERROR.match(text)
    if match is None:
        return None
    identifier = int(match[1], 16) & LAST_EXTENDED if match[1] else 0
    return can.Message(arbitration_id=identifier, is_error_frame=True, data=[0])


SOCKETCAND = Language(cut, parse, stamp, write, write_message)
