"""Cases on worker processes: each worker runs one after the other, and what breaks a worker costs one case."""

import os
import queue
import threading
import time as clock
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed

from fmus.errors import MisfitError
from orchestrator.cosim.isolate.child import Host
from orchestrator.cosim.isolate.process import LOADING_S, Child, ChildLimits
from orchestrator.cosim.kinds.code import told
from orchestrator.regress.case import Case
from orchestrator.regress.execute import Want, execute
from orchestrator.regress.outcome import Outcome
from orchestrator.regress.recording import Watched

TASK = f"{__name__}:serve"


def serve(host: Host) -> None:
    """Run cases until the host closes the connection."""
    progress = Watched(host.memory.page, lambda labels: host.send("labels", labels))
    while True:
        case, want = host.receive()
        try:
            outcome = execute(case, progress, want)
        except MemoryError:
            host.send("error", "ComponentError", f"{case.name}: no memory is left")
            continue
        except Exception as error:  # a mistake here, or in a user's component: one line for the user all the same
            host.send("error", "ComponentError", f"{case.name}: {told(error)}")
            continue
        progress.leave()
        host.send("answer", outcome, resident_bytes())


def resident_bytes() -> int:
    """Memory that this process holds."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGESIZE")


_GIB = 2**30


class Worker(Child):
    """A process that runs cases; it ends with the first one that breaks it."""

    patience_setting, memory_setting = "patience_s in [limits]", "memory_gib in [limits]"

    def __init__(self) -> None:
        super().__init__(TASK, [], ChildLimits())
        self._deadline = self._seconds = 0.0

    def run(self, case: Case, want: Want) -> tuple[Outcome, int]:
        """Run a case: its outcome, and the bytes that the process holds then.

        Raises:
            MisfitError: if the process broke, was silent for too long or took too much; it is gone then.
        """
        limits = case.limits
        self.labels = []
        self.limits = ChildLimits(limits.patience_s, limits.memory_gib)
        # A model that is Modelica may have to be built first, which is no matter of the case.
        spare = LOADING_S if case.is_built else 0.0
        self._seconds, self._deadline = limits.seconds, clock.monotonic() + limits.seconds + spare
        self.send(case, want)
        while True:
            kind, *content = self.receive()
            if kind == "labels":
                self.labels = content[0]
            else:
                return content[0], content[1]

    def _check(self, silent_s: float) -> None:
        super()._check(silent_s)
        if clock.monotonic() > self._deadline:
            raise self._failure(f"took more than {self._seconds:g} s", "seconds in [limits] allows more")


class Lane:
    """A place for one worker at a time, which is made when it is needed; `close` ends it at any time.

    `want` says what the outcomes hold beside the verdict.
    """

    def __init__(self, want: Want = "verdict") -> None:
        self._want = want
        self._worker: Worker | None = None
        self._closed = False

    def run(self, case: Case) -> Outcome:
        """Run a case, again as often as it may when it does not pass."""
        attempts: list[Outcome] = []
        while True:
            # Another try begins in a new process, so that nothing is left of the first.
            if attempts:
                self._end()
            outcome = self._attempt(case).after(attempts)
            if outcome.verdict == "passed" or outcome.flaky or len(attempts) >= case.limits.retries or self._closed:
                return outcome
            attempts.append(outcome)

    def _attempt(self, case: Case) -> Outcome:
        began = clock.perf_counter()
        try:
            if self._worker is None:
                self._worker = Worker()
            outcome, held = self._worker.run(case, self._want)
        except MisfitError as error:
            self._end()
            took = clock.perf_counter() - began
            return Outcome(case.name, str(case.file), "error", str(error), "component", took_s=took)
        if held > 0.5 * case.limits.memory_gib * _GIB:
            self._end()  # what libraries leave behind must not count against the next case
        return outcome

    def close(self) -> None:
        """End the worker, also while it runs."""
        self._closed = True
        self._end()

    def _end(self) -> None:
        worker, self._worker = self._worker, None
        if worker is not None:
            worker.close()


def run_cases(
    cases: Sequence[Case],
    workers: int = 1,
    tell: Callable[[Outcome], None] = lambda outcome: None,
    want: Want = "verdict",
) -> list[Outcome]:
    """Run cases on so many processes; outcomes in the order of the cases.

    Args:
        tell: is called with each outcome as it comes.
        want: what the outcomes hold beside the verdict.
    """
    build_models(cases)
    found: dict[int, Outcome] = {}
    lanes = [Lane(want) for _ in range(max(1, min(workers, len(cases))))]
    for place, outcome in _as_they_come(cases, lanes):
        found[place] = outcome
        tell(outcome)
    return [found[place] for place in range(len(cases))]


def build_models(cases: Sequence[Case]) -> None:
    """Build the models that are Modelica, each once; what fails at that is told by the case itself."""
    from orchestrator.cosim.built import built_fmu

    for folder, model in dict.fromkeys((case.folder, case.model) for case in cases if case.is_built):
        try:
            built_fmu(model, folder)
        except MisfitError:
            continue


def _as_they_come(cases: Sequence[Case], lanes: Sequence[Lane]) -> Iterator[tuple[int, Outcome]]:
    waiting: queue.SimpleQueue[tuple[int, Case]] = queue.SimpleQueue()
    for numbered in enumerate(cases):
        waiting.put(numbered)
    done: queue.SimpleQueue[tuple[int, Outcome] | None] = queue.SimpleQueue()
    stop = threading.Event()
    try:
        with ThreadPoolExecutor(len(lanes), "regress") as threads:
            futures = [threads.submit(_work, lane, waiting, done, stop) for lane in lanes]
            try:
                yield from _taken(done, futures)
            except BaseException:
                stop.set()
                for lane in lanes:
                    lane.close()
                raise
    finally:
        for lane in lanes:
            lane.close()


def _taken(
    done: "queue.SimpleQueue[tuple[int, Outcome] | None]", futures: Sequence["Future[None]"]
) -> Iterator[tuple[int, Outcome]]:
    left = len(futures)
    while left:
        taken = done.get()
        if taken is None:
            left -= 1
        else:
            yield taken
    for future in as_completed(futures):
        future.result()


def _work(
    lane: Lane,
    waiting: "queue.SimpleQueue[tuple[int, Case]]",
    done: "queue.SimpleQueue[tuple[int, Outcome] | None]",
    stop: threading.Event,
) -> None:
    """Take cases until there are none."""
    try:
        while not stop.is_set():
            try:
                place, case = waiting.get_nowait()
            except queue.Empty:
                return
            done.put((place, lane.run(case)))
    finally:
        lane.close()
        done.put(None)
