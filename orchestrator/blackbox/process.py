"""Child processes that run one FMU, shared by all who need runs of it."""

import math
import time
import weakref
from pathlib import Path
from typing import Any

from fmus.children import BrokenWorker, SilentWorker, Workers
from fmus.errors import ComponentError
from orchestrator.blackbox.worker import PathRequest, ProbeRequest, RatesRequest, RunRequest, SlopesRequest, answer

SYSTEM_ENDINGS = (".toml", ".ssd", ".ssp")
TIME_LIMIT_S = 300.0
# An FMU whose solver does not come to an end with some input is stopped after so many times what its quickest run took for as many
# steps, but not before this time.
PATIENCE, LEAST_LIMIT_S = 50.0, 10.0
Request = RunRequest | ProbeRequest | RatesRequest | PathRequest | SlopesRequest


class FmuProcesses:
    """As many children of one FMU as are asked for at a time; an FMU that crashes or hangs takes only its child along."""

    def __init__(self, path: Path, cosimulation: bool, join_forces: bool = False) -> None:
        self.path, self.cosimulation, self.join_forces = path, cosimulation, join_forces
        self._step_s = math.inf
        self._begin()

    def _begin(self) -> None:
        self._workers = Workers()
        # Also when nobody asks any more.
        self._end = weakref.finalize(self, self._workers.close)

    def ask(self, request: Request) -> Any:
        """Answer of the FMU.

        Raises:
            ComponentError: if it fails, crashes or gives no answer in time; names the FMU.
        """
        fmu = self.path.resolve(), self.cosimulation, self.join_forces
        steps = len(request.time) * request.substeps * len(request.variants) if isinstance(request, RunRequest) else 0
        expected = self._step_s * steps if steps else math.inf
        limit, began = min(max(PATIENCE * expected, LEAST_LIMIT_S), TIME_LIMIT_S), time.monotonic()
        try:
            succeeded, found = self._workers.call(answer, *fmu, request, timeout_s=limit)
        except SilentWorker:
            raise ComponentError(f"FMU {self.path.name} gave no answer for {limit:.0f} s and was stopped") from None
        except BrokenWorker as error:
            raise ComponentError(f"FMU {self.path.name} crashed its process (exit code {error.code})") from None
        if not succeeded:
            raise ComponentError(f"FMU {self.path.name} failed: {found}")
        if steps:
            self._step_s = min(self._step_s, (time.monotonic() - began) / steps)
        return found

    def close(self) -> None:
        """End all children."""
        self._end()
        self._begin()
