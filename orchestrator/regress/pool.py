"""Cases on worker processes: each worker runs one after the other, and what breaks a worker costs one case."""

import queue
import time as clock
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed

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
        host.send("answer", outcome)


class Worker(Child):
    """A process that runs cases; it ends with the first one that breaks it."""

    patience_setting, memory_setting = "patience_s in [limits]", "memory_gib in [limits]"

    def __init__(self) -> None:
        super().__init__(TASK, [], ChildLimits())
        self._deadline = self._seconds = 0.0

    def run(self, case: Case, want: Want) -> Outcome:
        """Run a case.

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
                outcome: Outcome = content[0]
                return outcome

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
            worker = self._worker = self._worker or Worker()
            outcome = worker.run(case, self._want)
            held = worker.resident_gib()
        except MisfitError as error:
            self._end()
            took = clock.perf_counter() - began
            return Outcome(case.name, str(case.file), "error", str(error), "component", took_s=took)
        if held > 0.5 * case.limits.memory_gib:
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
    idle: queue.SimpleQueue[Lane] = queue.SimpleQueue()
    for lane in lanes:
        idle.put(lane)

    def work(place: int, case: Case) -> tuple[int, Outcome]:
        lane = idle.get()
        try:
            return place, lane.run(case)
        finally:
            idle.put(lane)

    with ThreadPoolExecutor(len(lanes), "regress") as threads:
        futures = [threads.submit(work, *numbered) for numbered in enumerate(cases)]
        try:
            for future in as_completed(futures):
                yield future.result()
        finally:
            threads.shutdown(wait=False, cancel_futures=True)
            for lane in lanes:
                lane.close()
