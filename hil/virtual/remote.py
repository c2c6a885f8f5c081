"""Speak to a virtual robot that runs in another process: see `control`."""

import socket
from types import TracebackType

from fmus.errors import MisfitError

PATIENCE_S = 5.0


class Remote:
    """A connection beside the bus, open within a `with` block."""

    def __init__(self, port: int, host: str = "127.0.0.1") -> None:
        """Connect.

        Raises:
            MisfitError: if no virtual robot is there.
        """
        try:
            self._socket = socket.create_connection((host, port), PATIENCE_S)
            greeting = self._socket.recv(64)
        except OSError as error:
            raise MisfitError(
                f"no virtual robot at {host}, port {port}: {error}; start one: misfit hil robot"
            ) from error
        if greeting != b"< hi >":
            raise MisfitError(f"what listens at {host}, port {port} is no virtual robot; name the port of one")

    def tell(self, words: str) -> None:
        """Say something and wait for the answer.

        Raises:
            MisfitError: if it was not understood, or nobody answers.
        """
        try:
            self._socket.sendall(f"< misfit {words} >".encode("ascii"))
            answer = self._socket.recv(64)
        except (OSError, UnicodeEncodeError) as error:
            raise MisfitError(f"the virtual robot does not answer to {words!r}: {error}") from error
        if answer != b"< ok >":
            raise MisfitError(f"the virtual robot does not understand {words!r}; what it does is in docs/bench.md")

    def __enter__(self) -> "Remote":
        """Itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the connection."""
        self._socket.close()
