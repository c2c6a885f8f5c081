"""Child processes that run one FMU, shared by all who need runs of it."""

import multiprocessing
import queue
import subprocess
import threading
import weakref
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from fmus.children import child_environment, end_child, exit_code, python_command, start_child
from fmus.errors import ComponentError
from orchestrator.blackbox.worker import PathRequest, ProbeRequest, RatesRequest, RunRequest, SlopesRequest

TIME_LIMIT_S = 300.0
Request = RunRequest | ProbeRequest | RatesRequest | PathRequest | SlopesRequest


class FmuProcesses:
    """As many children of one FMU as are asked for at a time; an FMU that crashes or hangs takes only its child along."""

    def __init__(self, path: Path, cosimulation: bool, join_forces: bool = False) -> None:
        self.path, self.cosimulation, self.join_forces = path, cosimulation, join_forces
        self._idle: queue.LifoQueue[_Child] = queue.LifoQueue()
        self._lock = threading.Lock()
        self._all: list[_Child] = []

    def ask(self, request: Request) -> Any:
        """Answer of the FMU.

        Raises:
            ComponentError: if it fails, crashes or gives no answer in time; names the FMU.
        """
        try:
            child = self._idle.get_nowait()
        except queue.Empty:
            child = _Child(self.path, self.cosimulation, self.join_forces)
            with self._lock:
                self._all.append(child)
        try:
            answer = child.ask(request)
        except ComponentError:
            child.close()
            with self._lock:
                self._all.remove(child)
            raise
        self._idle.put(child)
        return answer

    def close(self) -> None:
        """End all children."""
        with self._lock:
            for child in self._all:
                child.close()
            self._all.clear()
            self._idle = queue.LifoQueue()


class _Child:
    """One child; it is started as a program of its own, which the processes of a cluster may do too."""

    def __init__(self, path: Path, cosimulation: bool, join_forces: bool) -> None:
        self.name = path.name
        self._connection, theirs = multiprocessing.Pipe()
        arguments = [str(path.resolve()), str(int(cosimulation)), str(int(join_forces)), str(theirs.fileno())]
        self._process = start_child(
            python_command("orchestrator.blackbox.worker:main", *arguments),
            environment=child_environment(),
            pass_fds=[theirs.fileno()],
            stdin=subprocess.DEVNULL,
        )
        theirs.close()
        self.close = weakref.finalize(self, _end, self._process, self._connection)

    def ask(self, request: Request) -> Any:
        try:
            self._connection.send(request)
            if not self._connection.poll(TIME_LIMIT_S):
                raise ComponentError(f"FMU {self.name} gave no answer for {TIME_LIMIT_S:.0f} s and was stopped")
            kind, answer = self._connection.recv()
        except (EOFError, ConnectionError):
            code = exit_code(self._process)
            raise ComponentError(f"FMU {self.name} crashed its process (exit code {code})") from None
        if kind == "error":
            raise ComponentError(f"FMU {self.name} failed: {answer}")
        return answer


def _end(process: "subprocess.Popen[bytes]", connection: Connection) -> None:
    connection.close()
    end_child(process)
