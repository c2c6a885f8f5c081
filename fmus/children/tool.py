"""Programs of others, such as a C compiler, with limits of time and memory."""

import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from fmus.children.start import run_child


@dataclass(frozen=True)
class ToolResult:
    """How a program ended: its exit code, and what it said."""

    returncode: int
    stdout: str
    stderr: str


class ToolTimeout(Exception):
    """A program took too long and was killed; a compiler that unrolls an endless macro does."""


def run_tool(
    command: Sequence[str],
    *,
    folder: Path | None = None,
    environment: Mapping[str, str] | None = None,
    timeout_s: float | None = None,
    memory_gib: float | None = None,
) -> ToolResult:
    """Run a program to its end; it ends with this process.

    Args:
        command: the program and its arguments.
        folder: its working directory.
        environment: its environment variables; None for those of this process.
        timeout_s: s after which it is killed with all that it started.
        memory_gib: GiB of address space that each of its processes may take; not limited where the system cannot.

    Raises:
        ToolTimeout: after `timeout_s`.
        OSError: if there is no such program.
    """
    if memory_gib is not None and sys.platform != "win32":
        limited = f'ulimit -v {round(memory_gib * 2**20)} 2>/dev/null; exec "$@"'
        command = ["/bin/sh", "-c", limited, "sh", *command]
    try:
        done = run_child(command, environment=environment or os.environ, folder=folder, timeout_s=timeout_s)
    except subprocess.TimeoutExpired as error:
        raise ToolTimeout(f"took more than {timeout_s:g} s") from error
    return ToolResult(done.returncode, done.stdout.decode(errors="replace"), done.stderr.decode(errors="replace"))
