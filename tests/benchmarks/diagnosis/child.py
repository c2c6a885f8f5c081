"""A command in a process of its own, with a limit of time, and what it used."""

import math
import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from threading import Thread

_LOOK_S = 0.02
_SLOWEST = 4
_running: set[int] = set()


@dataclass(frozen=True)
class Ended:
    """How a command ended: `code` is None if it was stopped for its time, negative for a signal.

    `cpu_s` is processor time of the process and of the children that it waited for, `peak_mb` the most resident memory
    of any one of them.
    """

    code: int | None
    wall_s: float
    cpu_s: float
    peak_mb: float
    said: str


def run_child(command: Sequence[str], limit_s: float, log: Path) -> Ended:
    """Run a command; what it says on either stream goes to `log`, its last 2000 characters into the result.

    The limit is one of processor time, so that it means the same on a busy machine, and `_SLOWEST` times that by the clock.
    """
    log.parent.mkdir(parents=True, exist_ok=True)
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    began, code = time.monotonic(), None
    limited = ["sh", "-c", f'ulimit -S -t {math.ceil(limit_s)}; exec "$@"', "sh", *command]
    with log.open("wb") as stream:
        child = subprocess.Popen(
            limited, stdout=stream, stderr=subprocess.STDOUT, env=environment, start_new_session=True
        )
        _running.add(child.pid)
        pid, status, usage = os.wait4(child.pid, os.WNOHANG)
        while not pid and time.monotonic() - began < _SLOWEST * limit_s:
            time.sleep(_LOOK_S)
            pid, status, usage = os.wait4(child.pid, os.WNOHANG)
        if not pid:
            os.killpg(child.pid, signal.SIGKILL)  # its own session: nobody else is in it
            _, _, usage = os.wait4(child.pid, 0)
        else:
            code = os.waitstatus_to_exitcode(status)
            code = None if code == -signal.SIGXCPU else code
        _running.discard(child.pid)
        child.returncode = -signal.SIGKILL if code is None else code  # it has been waited for
    megabytes = usage.ru_maxrss / (2**20 if sys.platform == "darwin" else 2**10)
    said = log.read_bytes().decode(errors="replace").strip()[-2000:]
    return Ended(code, time.monotonic() - began, usage.ru_utime + usage.ru_stime, megabytes, said)


def end_with_parent() -> None:
    """Watch, in a thread, for the end of this process's parent; then stop all commands and this process, too.

    A process pool's worker would wait for ever for work from a parent that was killed.
    """
    parent = os.getppid()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the parent, whose end is enough

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(1.0)
        for pid in list(_running):
            os.killpg(pid, signal.SIGKILL)
        os._exit(1)

    Thread(target=watch, daemon=True).start()
