"""A bus of text over TCP on 127.0.0.1, as python-can's `socketcand` interface expects it; the robot is at its other end."""

import contextlib
import heapq
import itertools
import selectors
import socket
import time
from collections.abc import Callable

from hil.codecs.frame import Frame, Timed
from hil.control.timing import SPIN_NS
from hil.virtual.beside import COMMAND, follow, listen
from hil.virtual.control import Control
from hil.virtual.faults import Faults
from hil.virtual.robot import EVERY_NS, RealTime

# A frame behind the answer to `rawmode` would break the client's handshake: hold back until it speaks, or so long.
_SETTLE_NS = 50_000_000


class _Client:
    """One connection; several may listen to the same bus."""

    def __init__(self, connection: socket.socket) -> None:
        self.connection, self.buffer, self.said, self.raw_since = connection, b"", b"", 0
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        connection.setblocking(False)
        self.say(b"< hi >")
        self.send()

    def say(self, text: bytes) -> None:
        """Have something for it; `send` sends it."""
        self.said += text

    def send(self) -> None:
        """A client that does not read loses what it does not take, and one that is gone is noticed when it is read."""
        if self.said:
            with contextlib.suppress(OSError):
                self.connection.send(self.said)
            self.said = b""

    def commands(self) -> list[bytes]:
        """Complete commands that have come.

        Raises:
            ConnectionError: if the client is gone.
        """
        try:
            received = self.connection.recv(65536)
        except BlockingIOError:
            return []
        if not received:
            raise ConnectionError
        self.buffer += received
        found = [match.group(1) for match in COMMAND.finditer(self.buffer)]
        self.buffer = self.buffer[self.buffer.rfind(b">") + 1 :]
        return found


class SocketcandServer:
    """Serves a virtual robot until `stop` says so.

    Args:
        port: TCP port on 127.0.0.1; 0 takes a free one (see `port`).
        faults: what goes wrong on this bus.
    """

    def __init__(self, robot: RealTime, port: int = 0, faults: Faults | None = None) -> None:
        self.robot, self.faults = robot, faults or Faults()
        self.control = Control(robot, self.faults)
        self._listener = listen(port)
        # epoll waits whole milliseconds, and answers are due after 75 us.
        self._selector = selectors.SelectSelector()
        self._selector.register(self._listener, selectors.EVENT_READ)
        self._clients: list[_Client] = []
        # Who spoke last waits for an answer; all others are told before the server sleeps, since sending takes 15 us each time.
        self._asker: _Client | None = None
        self._due: list[tuple[int, int, Frame]] = []
        self._count = itertools.count()

    @property
    def port(self) -> int:
        """The port that clients connect to."""
        return int(self._listener.getsockname()[1])

    def serve(self, stop: Callable[[], bool]) -> None:
        """Answer clients, and let the plant move, until told to stop."""
        try:
            while not stop():
                self._turn()
        finally:
            for client in self._clients:
                client.connection.close()
            self._selector.close()
            self._listener.close()

    def _turn(self) -> None:
        wait = min(self._due[0][0] - time.monotonic_ns() - SPIN_NS, EVERY_NS) if self._due else EVERY_NS
        if wait > 0:
            for client in self._clients:
                client.send()
        for key, _ in self._selector.select(max(wait, 0) * 1e-9):
            if key.fileobj is self._listener:
                connection, _address = self._listener.accept()
                client = _Client(connection)
                self._clients.append(client)
                self._selector.register(connection, selectors.EVENT_READ, client)
            else:
                self._hear(key.data)
        self._send_due()
        self.robot.keep_up(time.monotonic_ns())

    def _hear(self, client: _Client) -> None:
        try:
            for command in client.commands():
                self._follow(client, command, self.robot.arrival(time.monotonic_ns()))
            # A host waits for the last answer to all that it asked, and nobody for the plant.
            self._send_due()
            client.send()
        except (ConnectionError, OSError):
            self._selector.unregister(client.connection)
            self._clients.remove(client)
            client.connection.close()

    def _follow(self, client: _Client, command: bytes, now: int) -> None:
        words = command.split()
        if words[:1] == [b"send"] and client.raw_since:
            frame = _frame_of(words[1:])
            if frame is not None:
                self._on_the_bus(client, frame, now)
        elif words[:1] in ([b"open"], [b"rawmode"]):
            client.say(b"< ok >")
            if words == [b"rawmode"]:
                client.raw_since = now
        elif words == [b"echo"]:
            client.say(b"< echo >")
        elif words[:1] == [b"misfit"]:
            client.say(follow(self.control, command, now))
        else:
            client.say(b"< error 1 unknown command >")

    def _on_the_bus(self, sender: _Client, frame: Frame, now: int) -> None:
        """A client's frame reaches the robot and all other clients."""
        self._asker = sender
        sender.raw_since = min(sender.raw_since, now - _SETTLE_NS)
        for timed in self.faults.to_robot(Timed(now, frame)):
            answers = self.robot.receive(timed.frame, now)
            for answer in answers:
                for changed in self.faults.to_host(answer):
                    heapq.heappush(self._due, (changed.time_ns, next(self._count), changed.frame))
        self._tell([c for c in self._clients if c is not sender], frame, now)

    def _send_due(self) -> None:
        now = time.monotonic_ns()
        while self._due and self._due[0][0] <= now:
            at, _, frame = heapq.heappop(self._due)
            self._tell(self._clients, frame, at)
        if self._asker is not None:
            self._asker.send()

    def _tell(self, clients: list[_Client], frame: Frame, time_ns: int) -> None:
        seconds, rest = divmod(time_ns, 1_000_000_000)
        text = f"< frame {frame.identifier:03X} {seconds}.{rest // 1000:06d} {frame.data.hex().upper()} >".encode()
        for client in clients:
            if client.raw_since and time.monotonic_ns() - client.raw_since >= _SETTLE_NS:
                client.say(text)


def _frame_of(words: list[bytes]) -> Frame | None:
    """The frame of `send ID DLC BYTE BYTE ...`; None if it is none of a classic bus."""
    try:
        identifier, size = int(words[0], 16), int(words[1], 16)
        data = bytes(int(word, 16) for word in words[2:])
    except (ValueError, IndexError):
        return None
    # Eight digits are an extended identifier, however small.
    is_standard = len(words[0]) < 8 and 0 <= identifier <= 0x7FF
    return Frame(identifier, data) if is_standard and size == len(data) <= 8 else None
