"""Progress of a case, with the names of the components that it counts, for whoever watches from another process."""

from collections.abc import Callable, Sequence
from typing import Any

from orchestrator.cosim.isolate.process import label
from orchestrator.cosim.progress import Progress
from orchestrator.cosim.system import System


def nobody(labels: Sequence[str]) -> None:
    """Tell nobody."""


class Watched(Progress):
    """Progress that announces what it is about to count; results stay in this process."""

    def __init__(self, memory: Any = None, announce: Callable[[Sequence[str]], None] = nobody) -> None:
        super().__init__(memory)
        self._announce = announce

    def begin(self, system: System) -> None:
        """Say that a system is about to be loaded."""
        word = self.word
        word.component, word.call, word.time, word.last_good, word.rows = -1, 0, 0.0, 0.0, 0
        self._announce([label(spec) for spec in system.components.values()])
