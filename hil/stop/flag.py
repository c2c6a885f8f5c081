"""What the stop button and the loop share: whether somebody has pressed, and whether the loop has seen it."""

import mmap
import os
import secrets
import tempfile
import time
from pathlib import Path

from fmus.errors import MisfitError
from hil.processes import of_living, shared_folder

PREFIX = "misfit-stop-"
# Places of eight-byte numbers: times are monotonic ns, 0 before they come; behind them the token, and what it stops in
# words.
_PRESSED, _SEEN, _PORT, _ALIVE, _OVER = range(5)
_TOKEN, _WORDS, _SIZE = 64, 128, 512


class StopFlag:
    """One file in shared memory, open to this user alone.

    The button's server writes that it was pressed, the loop looks at that in every cycle and writes that it has seen it;
    neither waits for the other. Who may read the file knows the button's address, and so may press it.
    """

    def __init__(self, path: Path, *, read_only: bool = False) -> None:
        """Open one.

        Raises:
            MisfitError: if it is none.
        """
        self.path = path
        try:
            with path.open("rb" if read_only else "r+b") as file:
                access = mmap.ACCESS_READ if read_only else mmap.ACCESS_WRITE
                self._memory = mmap.mmap(file.fileno(), _SIZE, access=access)
        except (OSError, ValueError) as error:
            raise MisfitError(f"{path} is no stop button: {error}; its session may have ended") from error
        self._numbers = memoryview(self._memory)[:_TOKEN].cast("q")
        self.token = bytes(self._memory[_TOKEN:_WORDS]).rstrip(b"\0").decode("ascii", "replace")

    @staticmethod
    def create() -> "StopFlag":
        """A new one with a new token, in shared memory where there is any; those of killed sessions are cleared away."""
        folder = shared_folder()
        list(of_living(folder, PREFIX))
        handle, name = tempfile.mkstemp(prefix=f"{PREFIX}{os.getpid()}-", dir=folder)
        with os.fdopen(handle, "wb") as file:
            file.write(bytes(_TOKEN) + secrets.token_urlsafe(32).encode().ljust(_SIZE - _TOKEN, b"\0"))
        return StopFlag(Path(name))

    def press(self) -> None:
        """Stop the robot; the first press counts."""
        if not self._numbers[_PRESSED]:
            self._numbers[_PRESSED] = time.monotonic_ns()

    @property
    def is_pressed(self) -> bool:
        """Whether somebody wants the robot to stop."""
        return self._numbers[_PRESSED] != 0

    def saw(self) -> None:
        """Say that the loop stops the arm because of it."""
        if not self._numbers[_SEEN]:
            self._numbers[_SEEN] = time.monotonic_ns()

    @property
    def seen_after_ms(self) -> float | None:
        """How long the loop took to see it; None if it has not."""
        seen = self._numbers[_SEEN]
        return (seen - self._numbers[_PRESSED]) * 1e-6 if seen else None

    @property
    def unseen_s(self) -> float:
        """How long ago it was pressed without the loop having seen it; 0 if there is nothing to be seen."""
        pressed = self._numbers[_PRESSED]
        return (time.monotonic_ns() - pressed) * 1e-9 if pressed and not self._numbers[_SEEN] else 0.0

    def stops(self, words: str) -> None:
        """Say which session and robot it stops."""
        data = words.encode()[: _SIZE - _WORDS]
        self._memory[_WORDS : _WORDS + len(data)] = data

    @property
    def words(self) -> str:
        """Which session and robot it stops; "" before that is known."""
        return bytes(self._memory[_WORDS:]).rstrip(b"\0").decode("utf-8", "replace")

    def listen(self, port: int) -> None:
        """Say where the button's server listens."""
        self._numbers[_PORT] = port

    @property
    def port(self) -> int:
        """Where it listens on this machine; 0 if it does not yet."""
        return self._numbers[_PORT]

    def live(self) -> None:
        """Say that the button's server lives."""
        self._numbers[_ALIVE] = time.monotonic_ns()

    @property
    def silent_s(self) -> float:
        """How long its server has not said that it lives; infinite before the first time."""
        alive = self._numbers[_ALIVE]
        return (time.monotonic_ns() - alive) * 1e-9 if alive else float("inf")

    def finish(self) -> None:
        """Say that the arm has been let go: there is nothing to stop any more."""
        self._numbers[_OVER] = 1

    @property
    def is_over(self) -> bool:
        """Whether it has."""
        return self._numbers[_OVER] == 1

    def address(self, host: str) -> str:
        """URL of the button's page on a name of this machine."""
        return f"http://{host}:{self.port}/{self.token}/"

    def close(self) -> None:
        """Give the memory back; the file stays for others."""
        self._numbers.release()
        self._memory.close()

    def remove(self) -> None:
        """Give the memory back, and the file."""
        self.close()
        self.path.unlink(missing_ok=True)
