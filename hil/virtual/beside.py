"""Where a virtual robot hears words beside a bus that carries frames alone: TCP on 127.0.0.1, as `Remote` speaks it."""

import contextlib
import os
import re
import select
import socket

from fmus.errors import MisfitError
from hil.virtual.control import Control

COMMAND = re.compile(rb"<\s*([^<>]*?)\s*>")
# What nobody has ended with `>` is not kept for longer.
_LONGEST = 4096


def listen(port: int) -> socket.socket:
    """Listen on 127.0.0.1; port 0 takes a free one.

    Raises:
        MisfitError: if the port is taken.
    """
    try:
        listener = socket.create_server(("127.0.0.1", port))
    except OSError as error:
        why = os.strerror(error.errno) if error.errno else str(error)
        raise MisfitError(f"port {port} of 127.0.0.1 cannot be listened at: {why}; name another: --port N") from error
    listener.setblocking(False)
    return listener


def follow(control: Control, said: bytes, time_ns: int) -> bytes:
    """The answer to `misfit WORDS`."""
    words = [word.decode("ascii", "replace") for word in said.split()[1:]]
    return b"< ok >" if control.follow(words, time_ns) else b"< error 2 not understood >"


class Ears:
    """Hears whoever connects; `hear` never waits.

    Raises:
        MisfitError: if the port is taken.
    """

    def __init__(self, port: int) -> None:
        self._listener = listen(port)
        self._speakers: dict[socket.socket, bytes] = {}

    @property
    def port(self) -> int:
        """The port that `misfit hil tell --port` names."""
        return int(self._listener.getsockname()[1])

    def hear(self, control: Control, time_ns: int) -> None:
        """Follow all that has been said."""
        for ready in select.select([self._listener, *self._speakers], [], [], 0.0)[0]:
            if ready is self._listener:
                speaker, _address = self._listener.accept()
                speaker.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                speaker.setblocking(False)
                self._speakers[speaker] = b""
                _say(speaker, b"< hi >")
            else:
                self._listen(ready, control, time_ns)

    def _listen(self, speaker: socket.socket, control: Control, time_ns: int) -> None:
        try:
            received = speaker.recv(_LONGEST)
        except BlockingIOError:
            return
        except OSError:
            received = b""
        if not received:
            del self._speakers[speaker]
            speaker.close()
            return
        text = self._speakers[speaker] + received
        for match in COMMAND.finditer(text):
            said = match.group(1)
            known = said.split()[:1] == [b"misfit"]
            _say(speaker, follow(control, said, time_ns) if known else b"< error 1 unknown command >")
        self._speakers[speaker] = text[text.rfind(b">") + 1 :][-_LONGEST:]

    def close(self) -> None:
        """Hear nobody any more."""
        for each in (*self._speakers, self._listener):
            each.close()


def _say(speaker: socket.socket, text: bytes) -> None:
    """Send; one that is gone is noticed when it is heard."""
    with contextlib.suppress(OSError):
        speaker.send(text)
