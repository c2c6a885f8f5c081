"""The child's side: `main` serves a simulation or a component until the host closes the connection."""

import pickle
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import count
from multiprocessing.connection import Connection
from pkgutil import resolve_name
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmus.errors import ComponentError, MisfitError
from orchestrator.cosim.isolate.process import SharedMemory
from orchestrator.cosim.progress import Progress
from orchestrator.results.column import Column


class Host:
    """The connection to the host, with the calls that a simulation makes back to it."""

    def __init__(self, connection: Connection, memory: SharedMemory) -> None:
        self.connection, self.memory = connection, memory
        self._shared: NDArray[np.float64] | None = None

    def send(self, *message: Any) -> None:
        self.connection.send_bytes(pickle.dumps(message, pickle.HIGHEST_PROTOCOL))

    def receive(self) -> Any:
        return pickle.loads(self.connection.recv_bytes())

    def buffer(self, rows: int, columns: int) -> NDArray[np.float64]:
        """A result buffer that the host reads too."""
        self._shared = self.memory.buffer(rows, columns)
        self.send("buffer", rows, columns)
        return self._shared

    def begin(self, columns: Sequence[Column], provenance: Mapping[str, Any]) -> None:
        self.send("begin", list(columns), dict(provenance))

    def rows(self, times: NDArray[np.float64], values: NDArray[np.float64]) -> None:
        """Hand rows over and wait until the host has them: the buffer may be reused when this returns."""
        if self._shared is not None and np.shares_memory(times, self._shared[:, 0]):
            offset = times.__array_interface__["data"][0] - self._shared.__array_interface__["data"][0]
            self.send("shared rows", offset // self._shared.strides[0], len(times))
        else:
            self.send("rows", np.array(times), np.array(values))
        self.receive()

    def finish(self, failure: str = "") -> None:
        """The host finishes its recorder itself."""

    def watch(self, time: float) -> None:
        self.send("watch", time)
        self.receive()


def main() -> None:
    """Entry of the child: what it serves, and the inherited connection and memory.

    What it serves is a simulation, a component, or `module:function`, which is called with the host.
    """
    task, pipe, memory = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    _leave_no_core()
    connection = Connection(pipe)
    host = Host(connection, SharedMemory(memory))
    ours = {"simulation": _serve_simulation, "component": _serve_component}
    serve = ours[task] if task in ours else resolve_name(task)
    try:
        serve(host)
    except EOFError:
        return


def _leave_no_core() -> None:
    """A crash is told in a line; its memory would fill the disk."""
    if sys.platform != "win32":
        import resource

        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _answer(host: Host, call: Callable[[], Any], state: Callable[[], Any] = lambda: None) -> None:
    try:
        answer = call()
    except MisfitError as error:
        host.send("error", type(error).__name__, str(error))
    except Exception as error:  # a mistake in a user's class, or here: one line for the user all the same
        words = " ".join(str(error).split())
        host.send("error", ComponentError.__name__, f"{type(error).__name__}: {words}")
    else:
        host.send("answer", answer, state())


def _serve_simulation(host: Host) -> None:
    """Serve one simulation after the other."""
    while True:
        _serve_one(host)


def _serve_one(host: Host) -> None:
    from orchestrator.cosim.isolate.simulation import State
    from orchestrator.cosim.simulation import Simulation

    system, options = host.receive()
    progress = Progress(host.memory.page, host.buffer)
    made: list[Simulation] = []

    def make() -> Any:
        made.append(Simulation(system, progress=progress, **options))
        return made[0].columns, made[0].provenance(), made[0].step_size

    def state() -> State | None:
        return State(made[0].time, made[0].ended, made[0].report) if made else None

    _answer(host, make, state)
    while True:
        name, arguments = host.receive()
        if name == "end":
            _answer(host, lambda: made.pop().close(), lambda: None)
            return
        if name == "run":
            until, recorded = arguments
            arguments = (until, host if recorded else None, host.watch)
        _answer(host, lambda: getattr(made[0], name)(*arguments), state)  # noqa: B023


def _serve_component(host: Host) -> None:
    from orchestrator.cosim.kinds import open_component

    spec, folder = host.receive()
    progress = Progress(host.memory.page)
    states: dict[int, Any] = {}
    numbers = count()
    progress.enter(0, "load", 0.0)
    made: list[Any] = []

    def make() -> dict[str, Any]:
        component = open_component(replace(spec, isolate=False), folder)
        made.append(component)
        names = ("ports", "feedthrough", "follows_inputs", "variable_step", "own_step", "can_save", "can_differentiate")
        return {name: getattr(component, name) for name in names}

    def call(name: str, arguments: tuple[Any, ...]) -> Any:
        component = made[0]
        time = arguments[0] if name in ("initialise", "step") else progress.word.time
        progress.enter(0, name if name != "derivative" else "get", time)
        if name == "save":  # states stay here, the host gets a number
            number = next(numbers)
            states[number] = component.save()
            return number
        if name == "restore":
            return component.restore(states[arguments[0]])
        answer = getattr(component, name)(*arguments)
        if name == "step":
            progress.word.last_good = progress.word.time = answer.time
        return answer

    _answer(host, make)
    while True:
        name, arguments, dropped = host.receive()
        for number in dropped:
            states.pop(number, None)
        _answer(host, lambda: call(name, arguments))  # noqa: B023
