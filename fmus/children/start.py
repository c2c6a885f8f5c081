"""Start processes that end with this one, also when it is killed: isolated Python, and programs of others with limits of time and memory."""

import os
import signal
import subprocess
import sys
import threading
import weakref
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import fmus

_BOOT = Path(__file__).with_name("boot.py")
# The folder that holds the packages `fmus`, `orchestrator` and `hil`.
ROOT = Path(fmus.__file__).resolve().parents[1]


def python_command(program: str, *arguments: str) -> list[str]:
    """The command that runs a program in isolated Python; start it with `child_environment()`.

    Args:
        program: `MODULE:FUNCTION`, which is called without arguments, or `MODULE`, which is run as `python -m MODULE` would.
            A module whose classes travel between parent and child must be called: run, it would be there twice.
        arguments: what the program finds in `sys.argv`.
    """
    return [sys.executable, "-I", str(_BOOT), program, *arguments]


def child_environment(**more: str) -> dict[str, str]:
    """This process' environment, with the search path for a child and variables that come `more`."""
    path = os.pathsep.join(handed_over(sys.path, Path.cwd(), ROOT))
    return {**os.environ, "MISFIT_PATH": path, "MISFIT_PARENT": str(os.getpid()), **more}


def parent_process() -> int:
    """Number of the process that began this one; also where that ended before this one could ask for it.

    A child that still has work to do when its parent is gone compares it with `os.getppid()`.
    """
    return int(os.environ.get("MISFIT_PARENT", os.getppid()))


def handed_over(path: list[str], working: Path, root: Path) -> list[str]:
    """The search path that a child gets: misfit's own folder first, and never the working directory.

    Example:
        >>> handed_over(["", "/home/me", "/lib/python"], Path("/home/me"), Path("/site"))
        ['/site', '/lib/python']
    """
    rest = [str(Path(part).absolute()) for part in path if part and Path(part).resolve() != working.resolve()]
    return list(dict.fromkeys([str(root), *rest]))


# `F_SETSIG` of Linux (`fcntl.h`): the signal that tells the owner of a file that something happened there.
_F_SETSIG = 10


def kill_when_closed(reading: int, group: int) -> None:
    """Let the kernel kill a process group when the other end of its pipe is closed, whatever the group is doing then.

    Only Linux can; elsewhere a child that runs Python watches the pipe itself, see `end_with`.

    Args:
        reading: the end that the group inherited; this process may close it afterwards.
        group: number of the process group.
    """
    if sys.platform != "linux":
        return
    import fcntl

    try:
        fcntl.fcntl(reading, fcntl.F_SETOWN, -group)
    except ProcessLookupError:  # it has ended already
        return
    fcntl.fcntl(reading, _F_SETSIG, signal.SIGKILL)
    fcntl.fcntl(reading, fcntl.F_SETFL, fcntl.fcntl(reading, fcntl.F_GETFL) | os.O_ASYNC)


def end_with(reading: int) -> None:
    """End this process when the other end of the pipe is closed."""
    threading.Thread(target=_wait, args=(reading,), daemon=True, name="lifeline").start()


def _wait(reading: int) -> None:
    os.read(reading, 1)
    os._exit(1)


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
            command, env={**environment, **told}, pass_fds=(*pass_fds, reading), start_new_session=True, **options
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
