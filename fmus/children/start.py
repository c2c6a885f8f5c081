"""Start processes that end with this one, also when it is killed."""

import os
import signal
import subprocess
import sys
import weakref
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from fmus.children.lifeline import kill_when_closed

ENDING_S = 10.0


def start_child(
    command: Sequence[str], *, environment: Mapping[str, str], pass_fds: Sequence[int] = (), **options: Any
) -> "subprocess.Popen[Any]":
    """Start a process in a session of its own, so that Ctrl-C reaches only this one; it is killed when this process ends.

    It is killed, too, when the object that is returned is forgotten: keep it. Processes that the child starts in its group are
    killed with it.

    Args:
        command: the program and its arguments.
        environment: all of its environment variables.
        pass_fds: open files that it inherits.
        options: further ones of `subprocess.Popen`.
    """
    reading, writing = os.pipe()
    told = {} if sys.platform == "linux" else {"MISFIT_LIFELINE": str(reading)}
    try:
        process = subprocess.Popen(
            command,
            env={**environment, **told},
            pass_fds=(*pass_fds, reading),
            start_new_session=True,
            **options,
        )
    except BaseException:
        os.close(reading)
        os.close(writing)
        raise
    weakref.finalize(process, os.close, writing)
    kill_when_closed(reading, process.pid)
    os.close(reading)
    return process


def exit_code(process: "subprocess.Popen[Any]") -> int | None:
    """That of a child which has hung up and so is about to end; None if it does not."""
    with suppress(subprocess.TimeoutExpired):
        return process.wait(timeout=ENDING_S)
    return None


def end_child(process: "subprocess.Popen[Any]") -> None:
    """Kill a child with its group, and wait for its end, unless it hangs in the kernel."""
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, signal.SIGKILL)
    process.kill()
    with suppress(subprocess.TimeoutExpired):
        process.wait(timeout=ENDING_S)


def run_child(
    command: Sequence[str],
    *,
    environment: Mapping[str, str],
    folder: Path | None = None,
    given: bytes | None = None,
    timeout_s: float | None = None,
) -> "subprocess.CompletedProcess[bytes]":
    """Run a process to its end, as `subprocess.run` does; it ends with this one, with all processes of its group.

    Args:
        command: the program and its arguments.
        environment: all of its environment variables.
        folder: its working directory; None for that of this process.
        given: what it reads from its standard input.
        timeout_s: seconds after which it is killed.

    Raises:
        subprocess.TimeoutExpired: after `timeout_s`.
        OSError: if there is no such program.
    """
    process = start_child(
        command,
        environment=environment,
        cwd=folder,
        stdin=subprocess.DEVNULL if given is None else subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    with process:
        try:
            output, errors = process.communicate(given, timeout=timeout_s)
        except BaseException:
            end_child(process)
            raise
    return subprocess.CompletedProcess(list(command), process.returncode, output, errors)
