"""A pool of child processes that call functions; a function and its arguments go there, and its result comes back."""

import pickle
import queue
import subprocess
import sys
import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from typing import Any, TypeVar

from fmus.children.start import child_environment, end_child, exit_code, python_command, start_child

Result = TypeVar("Result")


class BrokenWorker(Exception):
    """A child process ended in the middle of a call: it crashed, or was killed for lack of memory; `code` is its exit code."""

    def __init__(self, words: str, code: int | None = None) -> None:
        super().__init__(words)
        self.code = code


class SilentWorker(BrokenWorker):
    """A child process gave no answer in time and was killed."""


class Workers:
    """So many children, each begun when it is first needed; use it as a context manager.

    Functions must be importable by name, and arguments and results must be picklable. A child that breaks costs the call that
    it was in; the next call gets a new one.
    """

    def __init__(self, number: int = 1) -> None:
        self._threads = ThreadPoolExecutor(number, "workers")
        self._idle: queue.SimpleQueue[_Worker] = queue.SimpleQueue()
        self._all: set[_Worker] = set()
        self._lock = threading.Lock()
        self._closed = False

    def submit(self, function: Callable[..., Result], *arguments: Any) -> "Future[Result]":
        """Call a function in a child; the future raises what the function does, or `BrokenWorker`."""
        return self._threads.submit(self.call, function, *arguments)

    def close(self) -> None:
        """End all children, also in the middle of a call; what has not begun is not done."""
        with self._lock:
            self._closed = True
            for worker in self._all:
                worker.end()
        self._threads.shutdown(wait=True, cancel_futures=True)

    def __enter__(self) -> "Workers":
        return self

    def __exit__(self, *reason: object) -> None:
        self.close()

    def call(self, function: Callable[..., Result], *arguments: Any, timeout_s: float | None = None) -> Result:
        """Call a function in an idle child, or in a new one, whatever the number of children is.

        Args:
            function: importable by name.
            arguments: what it is called with.
            timeout_s: s after which the child is killed; None waits for ever.

        Raises:
            SilentWorker: after `timeout_s`.
            BrokenWorker: if the child ends before it answers.
            Exception: what the function raises.
        """
        worker = self._take()
        try:
            succeeded, result = worker.call(function, arguments, timeout_s)
        except BrokenWorker:
            with self._lock:
                self._all.discard(worker)
            worker.end()
            raise
        self._idle.put(worker)
        if not succeeded:
            raise result
        return result

    def _take(self) -> "_Worker":
        try:
            return self._idle.get_nowait()
        except queue.Empty:
            with self._lock:
                if self._closed:
                    raise BrokenWorker("the pool was closed") from None
                worker = _Worker()
                self._all.add(worker)
            return worker


class _Worker:
    """One child."""

    def __init__(self) -> None:
        self._connection, theirs = Pipe()
        self._process = start_child(
            python_command("fmus.children.workers:main", str(theirs.fileno())),
            environment=child_environment(),
            pass_fds=[theirs.fileno()],
            stdin=subprocess.DEVNULL,
        )
        theirs.close()

    def call(
        self, function: Callable[..., Any], arguments: tuple[Any, ...], timeout_s: float | None
    ) -> tuple[bool, Any]:
        """Whether the function returned, and what; else what it raised."""
        try:
            self._connection.send_bytes(pickle.dumps((function, arguments), pickle.HIGHEST_PROTOCOL))
            if timeout_s is not None and not self._connection.poll(timeout_s):
                raise SilentWorker(f"a worker process gave no answer for {timeout_s:g} s")
            return pickle.loads(self._connection.recv_bytes())
        except (EOFError, OSError) as error:
            code = exit_code(self._process)
            raise BrokenWorker(f"a worker process ended in the middle of its work (exit code {code})", code) from error

    def end(self) -> None:
        end_child(self._process)


def main() -> None:
    """Serve calls that come through the inherited connection."""
    connection = Connection(int(sys.argv[1]))
    while True:
        try:
            content = connection.recv_bytes()
        except EOFError:
            return
        connection.send_bytes(_answer(content))


def _answer(content: bytes) -> bytes:
    try:
        function, arguments = pickle.loads(content)
        return pickle.dumps((True, function(*arguments)), pickle.HIGHEST_PROTOCOL)
    except Exception as error:
        return _failure(error)


def _failure(error: Exception) -> bytes:
    answer: tuple[bool, Any] = (False, error)
    try:
        content = pickle.dumps(answer, pickle.HIGHEST_PROTOCOL)
        pickle.loads(content)  # some exceptions can be written, and not read
    except Exception:
        return pickle.dumps((False, RuntimeError(f"{type(error).__name__}: {error}")))
    return content
