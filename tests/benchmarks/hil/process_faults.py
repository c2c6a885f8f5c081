"""Sessions in real time whose loop or watchdog is killed or frozen, and when the robot hears of no torque."""

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from hil.bus.gate import TORQUE_IDENTIFIERS, let_go
from hil.bus.wire import Wire, open_wire
from hil.codecs.frame import Frame
from hil.control.timing import real_time_priority
from hil.virtual.process import virtual_robot

# What is done to which process of a session.
WAYS = {
    "the session is frozen (SIGSTOP)": ("loop", signal.SIGSTOP),
    "the session is killed (SIGKILL)": ("loop", signal.SIGKILL),
    "the watchdog is frozen (SIGSTOP)": ("watchdog", signal.SIGSTOP),
    "the watchdog is killed (SIGKILL)": ("watchdog", signal.SIGKILL),
}
PATIENCE_S = 60.0
# Sessions that are tried until one runs long enough.
TRIES = 10
# Above the session's processes.
EAR = 95
_SESSION = """
import json, sys
from dataclasses import replace
from pathlib import Path
from hil.session.entry import Operator
from hil.session.session import run_session
from hil.settings import default_settings, virtual_settings
settings = virtual_settings(rate_hz=float(sys.argv[2]))
real = default_settings().limits  # a virtual robot's session bears more than a real one's
limits = replace(settings.limits, stall_s=real.stall_s, late_comply_s=real.late_comply_s)
settings = replace(settings, bus=json.loads(sys.argv[1]), limits=limits)
document = run_session(settings, 600.0, Operator(lambda: True, lambda robot: True), Path(sys.argv[3]))
print(json.dumps(document["faults"]))
"""


def process_times(way: str, rate_hz: float, trials: int) -> tuple[list[float], str]:
    """Times in ms from the signal until the robot heard no torque and idle, sorted; and what the user was told."""
    with real_time_priority(EAR):  # who measures must not be late itself
        found = [_fair(way, rate_hz) for _ in range(trials)]
    return sorted(time_ms for time_ms, _ in found), found[0][1]


def _fair(way: str, rate_hz: float) -> tuple[float, str]:
    """A trial whose session was still running when the signal came: on a busy machine one may have stopped before."""
    for _ in range(TRIES):
        if (found := _one(way, rate_hz)) is not None:
            return found
    raise RuntimeError(f"{TRIES} sessions at {rate_hz:g} Hz stopped by themselves before anything was done to them")


def _one(way: str, rate_hz: float) -> tuple[float, str] | None:
    target, number = WAYS[way]
    idle = let_go()[1]
    with virtual_robot() as bus, tempfile.TemporaryDirectory() as folder:
        ear = open_wire(bus, TORQUE_IDENTIFIERS)
        session = subprocess.Popen(
            [sys.executable, "-c", _SESSION, json.dumps(bus), str(rate_hz), str(Path(folder) / "session")],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        try:
            if not _wait_for_torques(ear, idle, session):
                return None
            process = session.pid if target == "loop" else _watchdog_of(session.pid)
            if any(timed.frame == idle for timed in ear.drain(10**6)):
                return None
            began = time.monotonic_ns()
            os.kill(process, number)
            heard = began + int(PATIENCE_S * 1e9)
            while (timed := ear.receive(1.0)) is not None:
                if timed.frame == idle:
                    heard = timed.time_ns
                    break
            if number is signal.SIGSTOP:
                time.sleep(0.2)
                os.kill(process, signal.SIGCONT)
            output, errors = session.communicate(timeout=PATIENCE_S)
        finally:
            session.kill()
            ear.close()
    told = ", ".join(json.loads(output)) if output else "nothing: the session is dead, the watchdog let the arm go"
    return (heard - began) * 1e-6, told or errors.strip()[-200:]


def _wait_for_torques(ear: Wire, idle: Frame, session: "subprocess.Popen[str]") -> bool:
    """Until the session has cycled for a second; whether it has not stopped by itself."""
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        timed = ear.receive(0.5)
        if timed is not None and timed.frame.identifier in TORQUE_IDENTIFIERS:
            calm = time.monotonic() + 1.0
            while time.monotonic() < calm:
                if (timed := ear.receive(0.1)) is not None and timed.frame == idle:
                    return False
            return True
        if session.poll() is not None:
            raise RuntimeError(f"the session ended: {session.communicate()[1]}")
    raise TimeoutError("the session did not begin to cycle")


def _watchdog_of(parent: int) -> int:
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            fields = (entry / "stat").read_text().rpartition(")")[2].split()
            words = (entry / "cmdline").read_bytes()
        except OSError:
            continue
        if int(fields[1]) == parent and b"hil.session.watchdog" in words:
            return int(entry.name)
    raise RuntimeError("the session has no watchdog")
