"""A session from the open bus to the finished recording."""

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

from fmus.errors import ComponentError
from hil.control.timing import real_time_priority
from hil.errors import BusError
from hil.session.entry import Operator, nothing, open_robot_session
from hil.session.recorded import ROBOT, finish_session
from hil.settings import Settings
from hil.stop.flag import StopFlag
from hil.stop.server import stop_button
from hil.virtual.direct_bus import DirectBus


class BrokenSession(BusError):
    """A bus that broke while a session was cycling, without anybody having stopped it; what was recorded is finished."""


def run_session(
    settings: Settings,
    seconds: float,
    operator: Operator,
    folder: Path | None,
    *,
    dry_run: bool = False,
    inside: DirectBus | None = None,
) -> dict[str, Any]:
    """Hold the arm, or what the settings' controller does, for a time.

    What was recorded until a bus broke is finished as well.

    Args:
        settings: bus, robot, limits and controller, as a bench file says them.
        seconds: how long the session lasts from arming on, s.
        operator: who confirms and is told.
        folder: where the recording goes; None for no recording.
        dry_run: do all but send torques.
        inside: a virtual robot in this process instead of the settings' bus.

    Returns:
        What `hil hold --json` says.

    Raises:
        MisfitError: if the bus, the robot or the settings do not fit.
        BrokenSession: if the bus breaks while nobody has stopped the session.
        ComponentError: if it breaks otherwise, or records are lost.
    """
    # The button outlives the loop: while files are written it says that the arm has been let go. So do the handlers of
    # signals: an impatient second Ctrl-C must not leave half of the files.
    with ExitStack() as until_written:
        stop = until_written.enter_context(stop_button())
        is_new = folder is not None and not (folder / ROBOT).exists()
        try:
            document = _cycles(settings, seconds, operator, folder, stop, until_written, dry_run, inside)
        except ComponentError as error:
            if folder is None or not (is_new and (folder / ROBOT).exists()):
                raise
            finish_session(folder, {**nothing(settings), "faults": [str(error)], "recording": str(folder)})
            was_running = isinstance(error, BusError) and not operator.abort.is_set() and not stop.is_pressed
            kind = BrokenSession if was_running else ComponentError
            raise kind(f"{error}; what was recorded until then is in {folder}") from error
        if folder is not None:
            finish_session(folder, document)
    return document


def _cycles(
    settings: Settings,
    seconds: float,
    operator: Operator,
    folder: Path | None,
    stop: StopFlag,
    until_written: ExitStack,
    dry_run: bool,
    inside: DirectBus | None,
) -> dict[str, Any]:
    """From the open bus to the last torque; what goes on until files are written is entered into that stack."""
    with open_robot_session(settings, operator, folder, stop, dry_run=dry_run, inside=inside) as opened:
        until_written.enter_context(_signals(operator.abort))
        with ExitStack() as in_haste:
            refused = in_haste.enter_context(real_time_priority()) if inside is None else []
            opened.run(seconds)
        return opened.result(refused)


@contextmanager
def _signals(abort: threading.Event) -> Iterator[None]:
    """Ctrl-C, a closed terminal and a polite kill let the arm down instead of dropping it; later ones wait for the files."""
    numbers = (signal.SIGINT, signal.SIGTERM, getattr(signal, "SIGHUP", signal.SIGTERM))

    def stop(number: int, frame: object) -> None:
        if abort.is_set():
            with suppress(OSError):  # a terminal that was closed
                os.write(2, b"the arm is being let go and the recording written; that takes a few seconds\n")
        abort.set()

    before = {number: signal.signal(number, stop) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
