"""Child processes that run one FMU, shared by all who need runs of it."""

import multiprocessing
import queue
import threading
from pathlib import Path
from typing import Any

from fmus.errors import ComponentError
from orchestrator.blackbox.worker import ProbeRequest, RunRequest, serve

TIME_LIMIT_S = 300.0


class FmuProcesses:
    """As many children of one FMU as are asked for at a time; an FMU that crashes or hangs takes only its child along."""

    def __init__(self, path: Path, cosimulation: bool) -> None:
        self.path, self.cosimulation = path, cosimulation
        self._idle: queue.LifoQueue[_Child] = queue.LifoQueue()
        self._lock = threading.Lock()
        self._all: list[_Child] = []

    def ask(self, request: RunRequest | ProbeRequest) -> Any:
        """Answer of the FMU.

        Raises:
            ComponentError: if it fails, crashes or gives no answer in time; names the FMU.
        """
        try:
            child = self._idle.get_nowait()
        except queue.Empty:
            child = _Child(self.path, self.cosimulation)
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
    def __init__(self, path: Path, cosimulation: bool) -> None:
        self.name = path.name
        context = multiprocessing.get_context("spawn")
        self.connection, theirs = context.Pipe()
        self.process = context.Process(target=serve, args=(path, cosimulation, theirs), daemon=True)
        self.process.start()
        theirs.close()

    def ask(self, request: RunRequest | ProbeRequest) -> Any:
        try:
            self.connection.send(request)
            if not self.connection.poll(TIME_LIMIT_S):
                raise ComponentError(f"FMU {self.name} gave no answer for {TIME_LIMIT_S:.0f} s and was stopped")
            kind, answer = self.connection.recv()
        except (EOFError, ConnectionError):
            self.process.join()
            raise ComponentError(f"FMU {self.name} crashed its process (exit code {self.process.exitcode})") from None
        if kind == "error":
            raise ComponentError(f"FMU {self.name} failed: {answer}")
        return answer

    def close(self) -> None:
        self.connection.close()
        self.process.kill()
        self.process.join()
