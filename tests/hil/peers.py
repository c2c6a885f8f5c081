"""Other ends of a connection for tests: they say what they are told to say, and remember what they hear."""

import contextlib
import os
import socket
import threading
import tty
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from types import TracebackType
from typing import Any

OK = b"< ok >"
# No test waits longer for a peer.
PATIENCE_S = 20.0


class Server:
    """A TCP server for one client: greets, and answers each command with the next text; then only listens."""

    def __init__(self, answers: Sequence[bytes] = (OK, OK), greeting: bytes = b"< hi >") -> None:
        self._answers, self._greeting, self.heard = list(answers), greeting, b""
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._listener.settimeout(PATIENCE_S)
        self._connection: socket.socket | None = None
        self._news = threading.Condition()
        self._thread = threading.Thread(target=self._serve, daemon=True)

    @property
    def settings(self) -> dict[str, Any]:
        """What reaches it."""
        port = self._listener.getsockname()[1]
        return {"interface": "socketcand", "host": "127.0.0.1", "port": port, "channel": "can0"}

    def say(self, text: bytes) -> None:
        """Say something more."""
        with self._news:
            self._news.wait_for(lambda: self._connection is not None, PATIENCE_S)
            assert self._connection is not None
            self._connection.sendall(text)

    def hang_up(self) -> None:
        """Close the connection in good order."""
        assert self._connection is not None
        self._connection.shutdown(socket.SHUT_WR)

    def wait_for(self, text: bytes) -> bytes:
        """Everything that was heard, as soon as it holds a text."""
        with self._news:
            assert self._news.wait_for(lambda: text in self.heard, PATIENCE_S), self.heard
            return self.heard

    def _serve(self) -> None:
        try:
            connection, _ = self._listener.accept()
        except OSError:
            return
        with self._news:
            self._connection = connection
            connection.sendall(self._greeting)
            self._news.notify_all()
        while data := _received(connection):
            with self._news:
                self.heard += data
                for _ in range(data.count(b">")):
                    if self._answers:
                        connection.sendall(self._answers.pop(0))
                self._news.notify_all()

    def __enter__(self) -> "Server":
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with contextlib.suppress(OSError):
            self._listener.shutdown(socket.SHUT_RDWR)  # wakes a thread that still waits for a client
        self._listener.close()
        if self._connection is not None:
            self._connection.close()
        self._thread.join(PATIENCE_S)


def _received(connection: socket.socket) -> bytes:
    try:
        return connection.recv(65536)
    except OSError:
        return b""


@contextmanager
def terminal(answer: bytes | None = b"\r") -> Iterator[tuple[int, str]]:
    """A pseudo-terminal, its other end and its path; answers each of the first lines until `O` (open) came."""
    master, slave = os.openpty()
    tty.setraw(slave)

    def serve() -> None:
        heard = b""
        while b"O\r" not in heard:
            data = os.read(master, 4096)
            heard += data
            if answer is not None:
                os.write(master, answer * data.count(b"\r"))

    thread = threading.Thread(target=serve, daemon=True)
    thread.start()
    try:
        yield master, os.ttyname(slave)
    finally:
        thread.join(PATIENCE_S)
        os.close(slave)
        os.close(master)
