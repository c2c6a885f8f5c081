"""One call for a whole run, with its result in memory."""

from pathlib import Path
from typing import Any

from orchestrator.cosim.load import load_system
from orchestrator.cosim.run import RunOptions, run_system
from orchestrator.cosim.system import System
from orchestrator.results.recorder import MemoryRecorder
from orchestrator.results.result import Result


def simulate(model: System | str | Path, **options: Any) -> Result:
    """Run a system from beginning to end; all outputs are recorded unless `record` says otherwise.

    Args:
        model: a system, or whatever `load_system` takes.
        options: fields of `RunOptions`, such as `stop` and `step` in s.

    Raises:
        MisfitError: if the system cannot be run, or nothing says for how long.
        ComponentError: if a component fails; to keep the rows until then, use `run_system` with a recorder.
    """
    system = model if isinstance(model, System) else load_system(model)
    recorder = MemoryRecorder()
    run_system(system, recorder, RunOptions(**options))
    return recorder.result()
