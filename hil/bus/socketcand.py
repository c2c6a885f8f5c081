"""A client for socketcand servers: never 40 ms behind, and not hanging on a server that is silent.

python-can's own waits for Nagle's algorithm unless told otherwise, for a silent server without end, and takes frames that
follow the handshake's last `< ok >` at once for an error.
"""

import contextlib
import socket
import time

import can

from fmus.errors import MisfitError
from hil.bus.text_bus import TextBus
from hil.codecs.socketcand import SOCKETCAND

# So long a server may take to be reached, and for each answer of the handshake.
CONNECT_S, ANSWER_S = 5.0, 2.0
_READ_BYTES = 65536


class TcpLine:
    """A TCP connection that sends small texts at once, and has its own acknowledged at once."""

    def __init__(self, host: str, port: int, timeout_s: float) -> None:
        """Connect.

        Raises:
            OSError: if nobody is there.
        """
        self.name = f"socketcand at {host}, port {port}"
        self._socket = socket.create_connection((host, port), timeout_s)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket.setblocking(False)

    def fileno(self) -> int:
        """The socket's."""
        return self._socket.fileno()

    def read(self) -> bytes:
        """What has come; a server that follows Nagle's algorithm waits for its acknowledgement before it says more."""
        data = self._socket.recv(_READ_BYTES)
        with contextlib.suppress(AttributeError):  # Linux has it
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_QUICKACK, 1)
        return data

    def write(self, data: bytes) -> int:
        """Send at once."""
        try:
            return self._socket.send(data)
        except BlockingIOError:
            return 0

    def close(self) -> None:
        """Say good-bye."""
        self._socket.close()


class SocketcandBus(TextBus):
    """A bus that a socketcand server serves.

    Args:
        channel: the server's name of the bus, such as can0.
        connect_s: so long the server may take to be reached.
        answer_s: so long it may take to answer.
        tcp_tune: there so that settings for python-can's client fit; it is always tuned.
    """

    def __init__(
        self,
        channel: str,
        host: str,
        port: int | str,
        can_filters: can.typechecking.CanFilters | None = None,
        *,
        connect_s: float = CONNECT_S,
        answer_s: float = ANSWER_S,
        tcp_tune: bool = True,
    ) -> None:
        """Connect.

        Raises:
            MisfitError: if nobody is there, or what is there does not speak socketcand.
        """
        try:
            line = TcpLine(host, int(port), connect_s)
        except (OSError, ValueError) as error:
            raise MisfitError(
                f"socketcand at {host}, port {port} cannot be reached within {connect_s:g} s: {error}"
            ) from error
        super().__init__(line, SOCKETCAND, channel, can_filters)
        try:
            self._expect("hi", "the connection", answer_s)
            for command in (f"< open {channel} >", "< rawmode >"):
                self._line.write(command.encode())
                self._expect("ok", command, answer_s)
        except BaseException:
            self.shutdown()
            raise

    def _expect(self, wanted: str, after: str, answer_s: float) -> None:
        """Wait for an answer; what came with it stays for later.

        Raises:
            MisfitError: if another one comes, or none.
        """
        end = time.monotonic() + answer_s
        try:
            while not self._waiting and (left := end - time.monotonic()) > 0:
                self._fill(left)
        except (can.CanError, OSError) as error:
            raise MisfitError(f"{self._line.name}: the connection was lost after {after}: {error}") from error
        said = f"answered {self._waiting[0].strip()!r}" if self._waiting else f"said nothing for {answer_s:g} s"
        if not self._waiting or self._waiting.popleft().strip() != wanted:
            raise MisfitError(f"{self._line.name} {said} after {after}; '< {wanted} >' was expected")
