"""The watchdog, a process of its own: `python -m hil.session.watchdog HEART SETTINGS [dry]`.

If the loop has not begun a cycle for too long (it hangs, was stopped or killed), or has ended by an error, it sends zero torques
and switches the motors to idle, on a connection to the bus of its own, and tells the loop, which then stops for good. So it does
when that connection breaks, or one of two: a bus that still works hears it.
"""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from fmus.children import child_environment, parent_process, python_command
from fmus.errors import ComponentError, MisfitError
from hil.bus.gate import TORQUE_IDENTIFIERS, let_go
from hil.bus.wire import Wire, open_wire
from hil.errors import BusError
from hil.session.heart import Heart
from hil.session.timing import real_time_priority

# On a machine without a real-time kernel gaps of 28 ms were measured in a loop that was well.
LIMIT_NS = 30_000_000
POLL_S = 0.001
# Above the loop's priority: it must run when the loop does not let go of the processor.
PRIORITY = 90
# Zero torques are repeated, in case that one is lost.
REPEATS = 5


def watch(heart: Heart, settings: Mapping[str, Any], limit_ns: int = LIMIT_NS, *, dry_run: bool = False) -> None:
    """Watch until the session ends, or the loop is dead.

    A loop that was never alive is not watched: it has sent no torque. In a dry run there is none to take back either.

    Raises:
        BusError: if the arm had to be let go, and the bus did not take it.
    """
    let_it_go = _stay_silent if dry_run else let_the_arm_go
    wire = open_wire(settings, TORQUE_IDENTIFIERS, beside=True)
    parent, hears = parent_process(), True
    print("watching", flush=True)
    try:
        while not heart.is_finished:
            last, orphaned = heart.last_ns, os.getppid() != parent
            silent = orphaned or time.monotonic_ns() - last > limit_ns
            if last and not heart.tripped_ns and (silent or not hears):
                heart.trip(time.monotonic_ns())
                let_it_go(wire)
            if orphaned:
                return
            hears = hears and _hears(wire)
            time.sleep(POLL_S)
        if heart.is_abandoned and heart.last_ns and not heart.tripped_ns:
            let_it_go(wire)
    finally:
        wire.close()
        if os.getppid() != parent:  # nobody else is left to do it
            heart.remove()


def _hears(wire: Wire) -> bool:
    """Whether a wire still brings what is said; what it was is of no interest."""
    try:
        wire.drain()
    except BusError:
        return False
    return True


def let_the_arm_go(wire: Wire) -> None:
    """Say no torque, and idle, so often that it is heard; all of it even where some is not taken.

    Raises:
        BusError: if the bus does not take it.
    """
    failure: BusError | None = None
    for _ in range(REPEATS):
        for frame in let_go():
            try:
                wire.send_decided(frame)
            except BusError as error:
                failure = error
        time.sleep(POLL_S)
    if failure is not None:
        raise failure


def _stay_silent(wire: Wire) -> None:
    """A dry run leaves the motors to whoever commands them."""


@contextmanager
def watchdog(settings: Mapping[str, Any], *, dry_run: bool = False) -> Iterator[Heart]:
    """Run one beside a session; yields the heart that the loop must keep beating. It lets the arm go if that ends by an error.

    Raises:
        ComponentError: if it does not come up.
    """
    heart = Heart.create()
    process = subprocess.Popen(
        [
            *python_command("hil.session.watchdog", str(heart.path), json.dumps(dict(settings))),
            *(["dry"] if dry_run else []),
        ],
        env=child_environment(),
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        assert process.stdout is not None
        said = process.stdout.readline().strip()
        if said != "watching":
            raise ComponentError(f"the watchdog cannot reach the bus, without it no session is begun: {said}")
        heart.watchdog = process
        yield heart
        heart.finish()
    except BaseException:
        heart.abandon()
        raise
    finally:
        process.communicate(timeout=10)
        heart.remove()


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with real_time_priority(PRIORITY):
        try:
            watch(Heart(Path(sys.argv[1])), json.loads(sys.argv[2]), dry_run="dry" in sys.argv[3:])
        except MisfitError as error:  # for the session to say
            print(error, flush=True)
