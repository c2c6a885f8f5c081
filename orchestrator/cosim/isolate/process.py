"""A child process that answers calls, watched: its end, its silence or its hunger for memory become an error."""

import os
import pickle
import select
import signal
import subprocess
import time
import weakref
from collections.abc import Sequence
from dataclasses import dataclass
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from fmus.children import child_environment, end_child, python_command, start_child
from fmus.errors import ComponentError, FmuError, MisfitError, ModelicaError
from orchestrator.cosim.isolate.memory import SharedMemory
from orchestrator.cosim.progress import CALLS
from orchestrator.cosim.system import ComponentSpec

ERRORS = {kind.__name__: kind for kind in (MisfitError, ModelicaError, FmuError, ComponentError)}
SIGNALS = {
    "SIGSEGV": "segmentation fault (a bad pointer, or the stack ran over)",
    "SIGABRT": "abort()",
    "SIGFPE": "division of an integer by zero",
    "SIGILL": "an instruction that this processor lacks",
    "SIGBUS": "access to memory that is not there",
    "SIGKILL": "killed from outside, as the system does when memory runs out",
}
# Loading may compile sources first.
LOADING_S = 600.0
LOOK_EVERY_S = 0.05


@dataclass(frozen=True)
class Limits:
    """What a child may use: `patience_s` s of silence in one call, `memory_gib` GiB of memory."""

    patience_s: float = 60.0
    memory_gib: float = 4.0


def label(spec: ComponentSpec) -> str:
    """What error messages call a component."""
    return f"FMU '{spec.name}'" if spec.kind == "fmu" else f"component '{spec.name}' ({spec.kind})"


class Child:
    """One child. `labels` say for people what the components are that the progress word counts.

    The child is a program of its own in a session of its own, so that Ctrl-C reaches only the host; it ends when the
    host does. What it prints is kept for error messages, as far as it is the last line.
    """

    # What a user sets to allow more, for messages.
    patience_setting, memory_setting = "--patience", "--memory"

    def __init__(self, task: str, labels: Sequence[str], limits: Limits) -> None:
        self.labels, self.limits = list(labels), limits
        self.runs = 0
        self.memory = SharedMemory()
        self._connection, theirs = Pipe()
        reading, writing = os.pipe()
        handles = (theirs.fileno(), self.memory.handle)
        self._process = start_child(
            python_command("orchestrator.cosim.isolate.child:main", task, *map(str, handles)),
            environment=child_environment(),
            pass_fds=handles,
            stdin=subprocess.DEVNULL,
            stdout=writing,
            stderr=writing,
        )
        os.close(writing)
        theirs.close()
        self._output = Connection(reading, writable=False)
        self._said = b""
        # One object for all waits: `multiprocessing.connection.wait` makes a new one each time, which takes longer than
        # a call.
        self._ready = select.poll()
        for source in (self._connection, self._output):
            self._ready.register(source.fileno(), select.POLLIN)
        self.close = weakref.finalize(self, _end, self._process, self._connection, self._output, self.memory.handle)

    def begin_again(self, labels: Sequence[str], limits: Limits) -> None:
        """Make ready for another simulation in the same process."""
        self.labels, self.limits, self._said = list(labels), limits, b""
        self.memory.reset()

    def resident_gib(self) -> float:
        """Memory that the child holds, in GiB."""
        return _resident_gib(self._process.pid)

    def send(self, *message: Any) -> None:
        """Send a message; a child that is gone is noticed by `receive`."""
        try:
            self._connection.send_bytes(pickle.dumps(message, pickle.HIGHEST_PROTOCOL))
        except (BrokenPipeError, ConnectionError):
            return

    def receive(self) -> tuple[Any, ...]:
        """The next message of the child.

        Raises:
            MisfitError: the error that the child reports, of the same class.
            ComponentError: if it ended, was silent for too long or took too much memory; names the component, the call
                and the simulated time.
        """
        calls, since = self.memory.word.calls, time.monotonic()
        while True:
            ready = [handle for handle, _ in self._ready.poll(1000 * LOOK_EVERY_S)]
            if self._output.fileno() in ready:
                self._listen()
            if self._connection.fileno() in ready:
                return self._message()
            if self.memory.word.calls != calls:
                calls, since = self.memory.word.calls, time.monotonic()
            self._check(time.monotonic() - since)

    def _message(self) -> tuple[Any, ...]:
        try:
            kind, *content = pickle.loads(self._connection.recv_bytes())
        except (EOFError, ConnectionError, OSError):
            raise self._failure(*self._cause()) from None
        if kind == "error":
            name, words = content
            raise ERRORS.get(name, ComponentError)(words)
        return (kind, *content)

    def _check(self, silent_s: float) -> None:
        loading = self.memory.word.component < 0 or CALLS[self.memory.word.call] == "load"
        patience = max(self.limits.patience_s, LOADING_S) if loading else self.limits.patience_s
        if silent_s > patience:
            raise self._failure(
                f"gave no answer for {patience:g} s", f"misfit stopped it; {self.patience_setting} allows more"
            )
        used = _resident_gib(self._process.pid)
        if used > self.limits.memory_gib:
            limit = f"the limit is {self.limits.memory_gib:g} GiB; {self.memory_setting} allows more"
            raise self._failure(f"took {used:.1f} GiB of memory", limit)

    def _listen(self) -> None:
        """Keep the end of what the child prints."""
        try:
            heard = os.read(self._output.fileno(), 65536)
        except OSError:
            heard = b""
        if not heard:
            self._ready.unregister(self._output.fileno())
        self._said = (self._said + heard)[-2000:]

    def _cause(self) -> tuple[str, str]:
        """How the process ended: what the component did, and the detail."""
        try:
            code = self._process.wait(5.0)
        except subprocess.TimeoutExpired:
            return "closed its process' connection to misfit", "its process was ended"
        while any(handle == self._output.fileno() for handle, _ in self._ready.poll(0)):
            self._listen()
        if code >= 0:
            return "ended its process", f"exit({code})"
        return "crashed", SIGNALS.get(signal.Signals(-code).name, signal.Signals(-code).name)

    def _failure(self, deed: str, detail: str) -> ComponentError:
        """The error, with who was called, and where in time."""
        word = self.memory.word
        time_s, last, call = word.time, word.last_good, CALLS[word.call]
        who = self.labels[word.component] if 0 <= word.component < len(self.labels) else "the simulation"
        self.close()
        where = f" in {call} at t = {time_s:.9g} s" if word.component >= 0 else ""
        good = f"; last good time {last:.9g} s" if call in ("set", "get", "step") else ""
        lines = self._said.decode(errors="replace").strip().splitlines()
        said = f"; it said: {lines[-1].strip()[:200]}" if lines else ""
        return ComponentError(f"{who} {deed}{where}: {detail}{good}{said}")


def _resident_gib(pid: int) -> float:
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    except (OSError, ValueError, IndexError):
        return 0.0
    return pages * os.sysconf("SC_PAGESIZE") / 2**30


def _end(process: "subprocess.Popen[bytes]", connection: Connection, output: Connection, handle: int) -> None:
    connection.close()
    end_child(process)
    output.close()
    os.close(handle)
