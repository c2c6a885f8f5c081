"""Child processes: Python that never imports from the working directory, and no process that outlives the one that began it."""

from fmus.children.start import (
    child_environment,
    end_child,
    exit_code,
    parent_process,
    python_command,
    run_child,
    run_tool,
    start_child,
)
from fmus.children.workers import BrokenWorker, SilentWorker, Workers

__all__ = [
    "BrokenWorker",
    "SilentWorker",
    "Workers",
    "child_environment",
    "end_child",
    "exit_code",
    "parent_process",
    "python_command",
    "run_child",
    "run_tool",
    "start_child",
]
