"""A CAN frame as the codecs see it; plain classes, which compiled code makes in a fraction of the time of a named tuple."""

from hil.errors import FrameError

# Standard identifiers have 11 bits, classic frames carry 8 bytes.
LAST_IDENTIFIER = 0x7FF
MOST_BYTES = 8


class Frame:
    """Identifier (11 bits) and data (0 to 8 bytes) of a classic CAN frame; nobody changes one."""

    def __init__(self, identifier: int, data: bytes) -> None:
        self.identifier = identifier
        self.data = data

    def __eq__(self, other: object) -> bool:
        """Whether the other is a frame with the same identifier and data."""
        return isinstance(other, Frame) and self.identifier == other.identifier and self.data == other.data

    def __hash__(self) -> int:
        """By both."""
        return hash((self.identifier, self.data))

    def __repr__(self) -> str:
        """As Python writes it."""
        return f"Frame(identifier={self.identifier!r}, data={self.data!r})"

    def __str__(self) -> str:
        """The notation of candump, such as `401#AA0004002000C004`."""
        return f"{self.identifier:03X}#{self.data.hex().upper()}"


class Timed:
    """A frame and when it was, or will be, on the bus (monotonic ns); nobody changes one."""

    def __init__(self, time_ns: int, frame: Frame) -> None:
        self.time_ns = time_ns
        self.frame = frame

    def __eq__(self, other: object) -> bool:
        """Whether the other is the same frame at the same time."""
        return isinstance(other, Timed) and self.time_ns == other.time_ns and self.frame == other.frame

    def __hash__(self) -> int:
        """By both."""
        return hash((self.time_ns, self.frame))

    def __repr__(self) -> str:
        """As Python writes it."""
        return f"Timed(time_ns={self.time_ns!r}, frame={self.frame!r})"


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
