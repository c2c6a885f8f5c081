"""A serial CAN adapter (slcan, after LAWICEL) on a pseudo-terminal, with the virtual robot behind it.

Each line ends with a carriage return: `t` and three hexadecimal digits of the identifier, one of the length, two for
each byte. `S8`, `O` and `C` set the bit rate, open and close; all else is answered with a bell, as an adapter does.
"""

import os
import re
import select
import time
from collections import deque

import can

_FRAME = re.compile(rb"t([0-7][0-9A-Fa-f]{2})([0-8])((?:[0-9A-Fa-f]{2})*)")
_OK, _BELL = b"\r", b"\a"
# A line is not longer than this.
_LONGEST = 64


class SerialAdapter(can.BusABC):
    """The robot's side of an adapter; programs open the terminal at `path`."""

    def __init__(self) -> None:
        super().__init__(channel="slcan")
        self._master, self._slave = os.openpty()
        import tty  # not on Windows

        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.path = os.ttyname(self._slave)
        self._text = b""
        self._frames: deque[can.Message] = deque()

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Type a frame; a program that does not read loses it."""
        self._type(f"t{msg.arbitration_id:03X}{len(msg.data)}{bytes(msg.data).hex().upper()}\r".encode())

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """The next frame that was typed, None if none is in time."""
        end = None if timeout is None else time.monotonic() + timeout
        # What comes first may be an answer, or a part of a line: neither is a frame.
        while not self._frames:
            left = None if end is None else max(end - time.monotonic(), 0.0)
            if not select.select([self._master], [], [], left)[0]:
                return None
            self.hear(os.read(self._master, 4096))
        return self._frames.popleft()

    def hear(self, text: bytes) -> None:
        """Take in what was typed."""
        *lines, rest = (self._text + text).split(b"\r")
        self._text = rest[-_LONGEST:]
        for line in lines:
            self._follow(line)

    def shutdown(self) -> None:
        """Close the terminal."""
        if not self._is_shutdown:
            os.close(self._master)
            os.close(self._slave)
        super().shutdown()

    def _follow(self, line: bytes) -> None:
        match = _FRAME.fullmatch(line)
        if match is not None and len(match[3]) == 2 * int(match[2]):
            data = bytes.fromhex(match[3].decode())
            self._frames.append(can.Message(arbitration_id=int(match[1], 16), data=data, is_extended_id=False))
        self._type(_OK if match is not None or line[:1] in (b"S", b"O", b"C", b"") else _BELL)

    def _type(self, text: bytes) -> None:
        if select.select([], [self._master], [], 0)[1]:
            os.write(self._master, text)
