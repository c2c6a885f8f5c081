"""A session whose bus broke can be taken up again, never by itself: the arm is looked at anew, and has to be armed once
more."""

import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from fmus.errors import MisfitError
from hil.barrett.kind import Proficio
from hil.bus.wire import open_wire
from hil.errors import BusError
from hil.robots.base import RobotKind
from hil.session.session import BrokenSession
from hil.session.watchdog import let_the_arm_go

# A bus that is not back is tried again after so long.
PAUSE_S = 0.2

Document = dict[str, Any]


def keep_on(
    run: Callable[[Path], Document],
    folder: Path,
    bus: Mapping[str, Any],
    patience_s: float,
    tell: Callable[[str], None],
    *,
    dry_run: bool = False,
    kind: RobotKind | None = None,
) -> Document:
    """Run a session, and where its bus breaks another one from the very beginning, as soon as the bus is back.

    Args:
        run: a session that records into a folder; whatever it asks before it arms is asked in each of them.
        folder: of the first one; the next ones record into folders beside it.
        patience_s: how long a bus is waited for.
        tell: told what happens, in lines.
        kind: of the robot; a Proficio without it.

    Returns:
        What the last session came to; `breaks` are those before it.

    Raises:
        BusError: if the bus does not come back in time, or breaks while a session starts up.
    """
    breaks: list[dict[str, str]] = []
    while True:
        here = folder if not breaks else _beside(folder)
        try:
            return {**run(here), "breaks": breaks}
        except BrokenSession as error:
            breaks.append({"recording": str(here), "fault": str(error)})
            tell(f"{error}\nwaiting up to {patience_s:g} s for the bus to come back; Ctrl-C ends that")
            wait_for_arm(bus, patience_s, dry_run=dry_run, kind=kind)
            tell("the bus is back; the session begins anew, and the arm has to be armed again")


def wait_for_arm(
    bus: Mapping[str, Any],
    patience_s: float,
    *,
    dry_run: bool = False,
    sleep: Callable[[float], None] = time.sleep,
    now: Callable[[], float] = time.monotonic,
    kind: RobotKind | None = None,
) -> None:
    """Wait until a bus that broke can be opened and all motors answer on it.

    Nobody knows what torque they made last: the first that they hear is no torque, and idle. Only where another host
    talks to them by now nothing is said; the start-up of a session refuses to go on there. Nothing is said in a dry run
    either.

    Args:
        bus: the settings of the bus, as in a bench file.
        patience_s: s after which it is given up.
        dry_run: say nothing on the bus.
        sleep: waits so many s.
        now: a monotonic clock, s.
        kind: the robot; by default the Proficio.

    Raises:
        BusError: if that takes too long.
    """
    deadline = now() + patience_s
    while missing := _missing(kind or Proficio(), bus, dry_run):
        if now() + PAUSE_S > deadline:
            raise BusError(f"the bus has not come back within {patience_s:g} s: {missing}")
        sleep(PAUSE_S)


def _missing(kind: RobotKind, bus: Mapping[str, Any], dry_run: bool) -> str:
    """What a session lacks on this bus, in words; "" if nothing does."""
    try:
        wire = open_wire(bus, kind.torque_identifiers)
    except MisfitError as error:
        return str(error)
    try:
        if kind.company(wire) is not None:
            return ""
        if not dry_run:
            let_the_arm_go(wire, kind.stop())
        return kind.missing(wire)
    except BusError as error:
        return str(error)
    finally:
        wire.close()


def _beside(folder: Path) -> Path:
    """A folder that is not there yet: `NAME-2`, `NAME-3`, ..."""
    number = 2
    while (found := folder.with_name(f"{folder.name}-{number}")).exists():
        number += 1
    return found
