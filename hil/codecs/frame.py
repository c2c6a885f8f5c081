"""A CAN frame as the codecs see it."""

from hil.errors import FrameError
from hil.record import Record

# Standard identifiers have 11 bits, classic frames carry 8 bytes.
LAST_IDENTIFIER = 0x7FF
MOST_BYTES = 8


class Frame(Record):
    """Identifier (11 bits) and data (0 to 8 bytes) of a classic CAN frame."""

    def __init__(self, identifier: int, data: bytes) -> None:
        self.identifier = identifier
        self.data = data

    def __str__(self) -> str:
        """The notation of candump, such as `401#AA0004002000C004`."""
        return f"{self.identifier:03X}#{self.data.hex().upper()}"


class Timed(Record):
    """A frame and when it was, or will be, on the bus (monotonic ns)."""

    def __init__(self, time_ns: int, frame: Frame) -> None:
        self.time_ns = time_ns
        self.frame = frame


def parse_frame(text: str) -> Frame:
    """Read the notation of candump.

    Raises:
        FrameError: if the text is no standard data frame.

    Example:
        >>> parse_frame("423#0003E8")
        Frame(identifier=1059, data=b'\\x00\\x03\\xe8')
    """
    head, separator, tail = text.strip().partition("#")
    try:
        frame = Frame(int(head, 16), bytes.fromhex(tail))
    except ValueError as error:
        raise FrameError(f"{text!r} is no CAN frame; write identifier#data in hexadecimal, as 401#AA00") from error
    if not separator or not 0 <= frame.identifier <= LAST_IDENTIFIER or len(frame.data) > MOST_BYTES:
        raise FrameError(f"{text!r} is no standard CAN frame: identifier up to 7FF, then #, then up to 8 bytes")
    return frame
