"""A command in a process of its own, with a limit of time, and what it used."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

_LOOK_S = 0.02


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
    """Run a command; what it says on either stream goes to `log`, its last 2000 characters into the result."""
    log.parent.mkdir(parents=True, exist_ok=True)
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    began, code = time.monotonic(), None
    with log.open("wb") as stream:
        child = subprocess.Popen(
            command, stdout=stream, stderr=subprocess.STDOUT, env=environment, start_new_session=True
        )
        pid, status, usage = os.wait4(child.pid, os.WNOHANG)
        while not pid and time.monotonic() - began < limit_s:
            time.sleep(_LOOK_S)
            pid, status, usage = os.wait4(child.pid, os.WNOHANG)
        if not pid:
            os.killpg(child.pid, signal.SIGKILL)  # its own session: nobody else is in it
            _, _, usage = os.wait4(child.pid, 0)
        else:
            code = os.waitstatus_to_exitcode(status)
        child.returncode = -signal.SIGKILL if code is None else code  # it has been waited for
    megabytes = usage.ru_maxrss / (2**20 if sys.platform == "darwin" else 2**10)
    said = log.read_bytes().decode(errors="replace").strip()[-2000:]
    return Ended(code, time.monotonic() - began, usage.ru_utime + usage.ru_stime, megabytes, said)
