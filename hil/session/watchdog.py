"""The watchdog, a process of its own: `python -m hil.session.watchdog HEARTBEAT SETTINGS LIMIT_NS FRAMES [dry]`.

If the loop has given no sign for too long (it hangs, was stopped or killed), or has ended by an error, it sends zero
torques and switches the motors to idle, on a connection to the bus of its own, and tells the loop, which then stops for
good. So it does when that connection breaks, or one of two: a bus that still works hears it.
"""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from fmus.children import child_environment, parent_process, python_command
from fmus.errors import ComponentError, MisfitError
from hil.bus.gate import let_go
from hil.bus.wire import Wire, open_wire
from hil.codecs.frame import Frame, parse_frame
from hil.control.timing import real_time_priority
from hil.errors import BusError
from hil.processes import NOT_NEEDED
from hil.session.heartbeat import LIMIT_NS, Heartbeat

POLL_S = 0.001
# Of a bus that is full it hears so many frames in each look: it must not miss the loop because of it.
HEARD = 64
# Above the loop's priority: it must run when the loop does not let go of the processor.
PRIORITY = 90
# A watchdog that is told of the end is waited for so long.
PATIENCE_S = 10.0
# Zero torques are repeated, in case that one is lost.
REPEATS = 5


def watch(
    heartbeat: Heartbeat, settings: Mapping[str, Any], limit_ns: int, frames: Sequence[Frame], *, dry_run: bool = False
) -> None:
    """Watch until the session ends, or the loop is dead, and then stop the robot.

    A loop that was never alive is not watched: it has sent no torque. In a dry run there is none to take back either.

    Args:
        heartbeat: memory into which the loop writes each cycle.
        settings: of the bus.
        limit_ns: ns without a sign of life after which the loop is dead.
        frames: what stops the robot.
        dry_run: send nothing.

    Raises:
        BusError: if the arm had to be let go, and the bus did not take it.
    """
    said = () if dry_run else frames  # a dry run leaves the motors to whoever commands them
    wire = open_wire(settings, frozenset(), beside=True)
    wire.listen_to(())
    parent, hears = parent_process(), True
    heartbeat.watch(time.monotonic_ns())
    print("watching", flush=True)
    try:
        while not heartbeat.is_finished:
            heartbeat.watch(time.monotonic_ns())
            last, orphaned = heartbeat.last_ns, os.getppid() != parent
            silent = orphaned or time.monotonic_ns() - last > limit_ns
            if last and not heartbeat.tripped_ns and (silent or not hears):
                heartbeat.trip(time.monotonic_ns())
                let_the_arm_go(wire, said)
            if orphaned:
                return
            hears = hears and _hears(wire)
            time.sleep(POLL_S)
        if heartbeat.is_abandoned and heartbeat.last_ns and not heartbeat.tripped_ns:
            let_the_arm_go(wire, said)
    finally:
        wire.close()
        if os.getppid() != parent:  # nobody else is left to do it
            heartbeat.remove()


def _hears(wire: Wire) -> bool:
    """Whether a wire still brings what is said; what it was is of no interest."""
    try:
        wire.drain(HEARD)
    except BusError:
        return False
    return True


def let_the_arm_go(wire: Wire, frames: Sequence[Frame]) -> None:
    """Say no torque, and idle, so often that it is heard; all of it even where some is not taken.

    Raises:
        BusError: if the bus does not take it.
    """
    failure: BusError | None = None
    for _ in range(REPEATS):
        for frame in frames:
            try:
                wire.send_decided(frame)
            except BusError as error:
                failure = error
        time.sleep(POLL_S)
    if failure is not None:
        raise failure


@contextmanager
def watchdog(
    settings: Mapping[str, Any],
    limit_s: float = LIMIT_NS * 1e-9,
    *,
    dry_run: bool = False,
    frames: Sequence[Frame] | None = None,
) -> Iterator[Heartbeat]:
    """Run one beside a session; yields the heartbeat that the loop must keep beating. It lets the arm go if that ends by an error.

    Args:
        limit_s: after so long without a sign of the other, loop and watchdog each let the arm go.
        frames: what stops the robot; those of Barrett's without them.

    Raises:
        ComponentError: if it does not come up.
    """
    heartbeat = Heartbeat.create()
    heartbeat.limit_ns = round(limit_s * 1e9)
    process = subprocess.Popen(
        [
            *python_command("hil.session.watchdog", str(heartbeat.path), json.dumps(dict(settings))),
            str(heartbeat.limit_ns),
            ",".join(map(str, let_go() if frames is None else frames)),
            *(["dry"] if dry_run else []),
        ],
        env=child_environment(MISFIT_WITHOUT=NOT_NEEDED),
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        assert process.stdout is not None
        said = process.stdout.readline().strip()
        if said != "watching":
            raise ComponentError(f"the watchdog cannot reach the bus, without it no session is begun: {said}")
        heartbeat.watchdog = process
        yield heartbeat
        heartbeat.finish()
    except BaseException:
        heartbeat.abandon()
        raise
    finally:
        _ended(process)
        heartbeat.remove()


def _ended(process: subprocess.Popen[str]) -> None:
    """Wait for the watchdog to end; one that does not, on a machine that is too slow or since it was stopped, is ended."""
    try:
        process.communicate(timeout=PATIENCE_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with real_time_priority(PRIORITY):
        try:
            stop = [parse_frame(word) for word in sys.argv[4].split(",")]
            watch(
                Heartbeat(Path(sys.argv[1])),
                json.loads(sys.argv[2]),
                int(sys.argv[3]),
                stop,
                dry_run="dry" in sys.argv[5:],
            )
        except MisfitError as error:  # for the session to say
            print(error, flush=True)
