"""A child process that answers calls, watched: its end, its silence or its hunger for memory become an error."""

import atexit
import ctypes
import mmap
import os
import pickle
import select
import signal
import subprocess
import tempfile
import threading
import time
import weakref
from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmus.children import child_environment, end_child, python_command, start_child
from fmus.errors import ComponentError, FmuError, MisfitError, ModelicaError
from orchestrator.cosim.progress import CALLS, ProgressWord
from orchestrator.cosim.system import ComponentSpec, System

# The word has a page of its own, the result buffer follows.
PAGE = mmap.PAGESIZE


class SharedMemory:
    """A page with the progress word, and a result buffer that is added when its size is known."""

    def __init__(self, handle: int | None = None) -> None:
        self.handle = _nameless() if handle is None else handle
        self._page = mmap.mmap(self.handle, PAGE)
        self.word = ProgressWord.from_buffer(self._page)
        if handle is None:
            self.word.component = -1
        self._rest: mmap.mmap | None = None

    def reset(self) -> None:
        """Set the word back to what it is before a run."""
        ctypes.memset(ctypes.addressof(self.word), 0, ctypes.sizeof(self.word))
        self.word.component = -1

    @property
    def page(self) -> mmap.mmap:
        """The memory of the word."""
        return self._page

    def buffer(self, rows: int, columns: int) -> NDArray[np.float64]:
        """The result buffer (rows, columns), the same memory in both processes."""
        size = PAGE + max(rows * columns * 8, 1)
        if os.fstat(self.handle).st_size < size:
            os.ftruncate(self.handle, size)
        self._rest = mmap.mmap(self.handle, size)
        return np.frombuffer(self._rest, dtype=float, count=rows * columns, offset=PAGE).reshape(rows, columns)


def _nameless() -> int:
    if hasattr(os, "memfd_create"):
        handle = os.memfd_create("misfit", os.MFD_CLOEXEC)
    else:
        with tempfile.TemporaryFile() as file:
            handle = os.dup(file.fileno())
    os.ftruncate(handle, PAGE)
    return handle


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
class ChildLimits:
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

    def __init__(self, task: str, labels: Sequence[str], limits: ChildLimits) -> None:
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

    def begin_again(self, labels: Sequence[str], limits: ChildLimits) -> None:
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


# Children that wait at a time, and runs after which one has done enough: what FMUs leak must not add up.
MOST_WAITING, MOST_RUNS = 4, 1000

_waiting: list[tuple[Hashable, Child]] = []
_lock = threading.Lock()


def key_of(system: System) -> Hashable | None:
    """What a child has loaded that has run a system; None for a system with parts that run a user's own Python."""
    from orchestrator.cosim.fmu import read_description

    if any(spec.kind != "fmu" for spec in system.components.values()):
        return None
    try:
        files = {Path(system.folder / spec.source) for spec in system.components.values()}
        return frozenset(read_description(file).digest for file in files)
    except MisfitError:  # the child says what is wrong with it
        return None


def take(key: Hashable | None) -> Child | None:
    """A child that waits for these FMUs, None if there is none."""
    with _lock:
        for place, (known, child) in enumerate(_waiting):
            if key is not None and known == key:
                del _waiting[place]
                return child
    return None


def put_back(key: Hashable | None, child: Child) -> None:
    """Let a child wait for the next run, or end it."""
    child.runs += 1
    if key is None or child.runs >= MOST_RUNS or child.resident_gib() > 0.5 * child.limits.memory_gib:
        child.close()
        return
    with _lock:
        _waiting.append((key, child))
        ended = _waiting[:-MOST_WAITING]
        del _waiting[:-MOST_WAITING]
    for _, each in ended:
        each.close()


def end_waiting() -> None:
    """End all children that wait."""
    with _lock:
        ended = [child for _, child in _waiting]
        _waiting.clear()
    for child in ended:
        child.close()


atexit.register(end_waiting)
