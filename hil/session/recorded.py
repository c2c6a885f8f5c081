"""A session that has been recorded: replay it, and make the files that other tools read."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fmus.errors import MisfitError
from fmus.files import write_atomically
from hil.control.pilot import Pilot
from hil.recording.frames import FRAMES_BLF, write_frames
from hil.recording.replay import Replayed, replay
from hil.recording.signals import write_signals
from hil.robots.base import Robot
from hil.settings import Settings, settings_of_json

SETTINGS, ROBOT, SUMMARY = "settings.json", "robot.json", "summary.json"


def replay_session(folder: Path) -> Replayed:
    """Run a recording through the same decisions.

    Raises:
        MisfitError: if it is no recording.
    """
    found = Replayed()
    for found, _cycle, _decision in replay(folder, recorded_pilot(folder)):  # noqa: B007
        pass
    return found


def finish_session(folder: Path, summary: Mapping[str, Any] | None = None) -> None:
    """Write what is made from the frames of a recording: summary, signals, measurement set, frames for other CAN tools.

    A session does this at its end; for one that was killed, or whose machine died, it can be done later.

    Args:
        summary: what the session came to; one that is there already, or nothing, without it.

    Raises:
        MisfitError: if there is no recording, or none with cycles in it.
    """
    pilot, frame = recorded_pilot(folder), recorded_settings(folder).kind.frame
    if summary is None:
        summary = _kept_summary(folder / SUMMARY)
    else:
        write_atomically(folder / SUMMARY, (json.dumps(summary, indent=2) + "\n").encode())
    write_signals(folder, pilot, {"session": summary}, frame)
    write_frames(folder, folder / FRAMES_BLF)


def recorded_pilot(folder: Path) -> Pilot:
    """A pilot set up as that of a recording."""
    try:
        settings = recorded_settings(folder)
        known = json.loads((folder / ROBOT).read_text())
        robot = settings.kind.restore(known)
    except FileNotFoundError as error:
        raise MisfitError(f"{folder} holds no cycles to replay: {Path(error.filename).name} is missing") from error
    except (KeyError, TypeError, ValueError) as error:
        raise MisfitError(
            f"{folder}: {SETTINGS} or {ROBOT} is damaged ({error!r}); they must be as the session wrote them"
        ) from error
    return pilot_of(robot, settings)


def recorded_settings(folder: Path) -> Settings:
    """The settings of a recording's session."""
    return settings_of_json((folder / SETTINGS).read_text())


def pilot_of(robot: Robot, settings: Settings) -> Pilot:
    """The pilot of a session with these settings."""
    controller, proof = settings.make_controller(), settings.make_proof()
    axes = np.array(settings.force_axes)
    return Pilot(
        robot,
        settings.limits,
        controller,
        gravity=settings.gravity,
        proof=proof,
        force_axes=axes,
        waived=settings.waived,
    )


def _kept_summary(path: Path) -> Mapping[str, Any]:
    try:
        return dict(json.loads(path.read_text()))
    except (OSError, ValueError, TypeError):
        return {"schema": "misfit.hil/1", "faults": ["the session did not come to its end"]}
