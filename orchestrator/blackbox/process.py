"""Child processes that run one FMU, shared by all who need runs of it."""

import weakref
from pathlib import Path
from typing import Any

from fmus.children import BrokenWorker, SilentWorker, Workers
from fmus.errors import ComponentError
from orchestrator.blackbox.worker import PathRequest, ProbeRequest, RatesRequest, RunRequest, SlopesRequest, answer

SYSTEM_ENDINGS = (".toml", ".ssd", ".ssp")
TIME_LIMIT_S = 300.0
Request = RunRequest | ProbeRequest | RatesRequest | PathRequest | SlopesRequest


class FmuProcesses:
    """As many children of one FMU as are asked for at a time; an FMU that crashes or hangs takes only its child along."""

    def __init__(self, path: Path, cosimulation: bool, join_forces: bool = False) -> None:
        self.path, self.cosimulation, self.join_forces = path, cosimulation, join_forces
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
        try:
            succeeded, found = self._workers.call(answer, *fmu, request, timeout_s=TIME_LIMIT_S)
        except SilentWorker:
            raise ComponentError(
                f"FMU {self.path.name} gave no answer for {TIME_LIMIT_S:.0f} s and was stopped"
            ) from None
        except BrokenWorker as error:
            raise ComponentError(f"FMU {self.path.name} crashed its process (exit code {error.code})") from None
        if not succeeded:
            raise ComponentError(f"FMU {self.path.name} failed: {found}")
        return found

    def close(self) -> None:
        """End all children."""
        self._end()
        self._begin()
