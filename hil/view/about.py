"""What a session tells of itself once: where it records, its limits, its controller's signals, where its stop button is."""

import os
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hil.control.abilities import Showing
from hil.control.pilot import Pilot
from hil.emulation.planar import Placement
from hil.robots.chain import Drawn
from hil.settings import Settings


def about(settings: Settings, pilot: Pilot, folder: Path | None, stop: Path, dry_run: bool) -> Mapping[str, Any]:
    """All of it, as JSON takes it.

    `clock_ns` is what the wall clock is ahead of the monotonic one; `chain` are the robot's links if they are known, `arm` is there while an arm is emulated.

    Args:
        settings: of the session.
        pilot: who asks for torques.
        folder: of the recording, if there is one.
        stop: the file that ends the session.
        dry_run: whether nothing is said on the bus.
    """
    controller = pilot.controller
    found: dict[str, Any] = {
        "recording": str(folder.resolve()) if folder is not None else None,
        "controller": _controller(settings),
        "side": settings.side,
        "bus": _bus(settings),
        "name": session_name(settings, os.getpid()),
        "dry_run": dry_run,
        "without": list(settings.waived),
        "stop": str(stop),
        "process": os.getpid(),
        "clock_ns": time.time_ns() - time.monotonic_ns(),
        "joints": [
            {"torque": joint.torque, "speed": joint.speed, "low": joint.low, "high": joint.high}
            for joint in settings.limits.joints
        ],
        "force": settings.limits.force,
        "signals": [signal.name for signal in controller.signals] if isinstance(controller, Showing) else [],
    }
    if isinstance(settings.kind, Drawn):
        found["chain"] = settings.kind.chain
    if settings.protocol is not None:
        found["trials"] = len(settings.protocol.trials)
    if settings.stimulation is not None:
        found["postures"] = len(settings.stimulation.postures)
    if settings.protocol is not None or settings.stimulation is not None:
        found["arm"] = _arm(settings)
    return found


def _controller(settings: Settings) -> str:
    if settings.protocol is not None:
        return "trials"
    return "stimulation" if settings.stimulation is not None else settings.controller


def session_name(settings: Settings, process: int) -> str:
    """Which session and robot it is, as a stop button and pages call it."""
    return f"session {process} with the {settings.kind.name} ({settings.side}, {_bus(settings)})"


def _bus(settings: Settings) -> str:
    """Where the robot is; a server on this machine may have a real one behind it as well as a virtual one."""
    bus = settings.bus
    server = f"at {bus['host']}:{bus.get('port', '')}" if "host" in bus else ""
    return " ".join(filter(None, (str(bus.get("interface", "")), str(bus.get("channel", "")), server)))


def _arm(settings: Settings) -> dict[str, Any]:
    """The emulated arm: ranges of its angles (rad) that the robot's limits leave, lengths of links and moment arms (m)."""
    from hil.emulation.anatomy import anatomy

    placement = Placement(settings.side, settings.shoulder)
    joints = settings.limits.joints
    ends = [placement.angles(np.array(end)) for end in zip(*((joint.low, joint.high) for joint in joints), strict=True)]
    return {
        "shoulder": settings.shoulder,
        "low": np.minimum(*ends).tolist(),
        "high": np.maximum(*ends).tolist(),
        "length": anatomy().length.tolist(),
        "moment_arms": anatomy().arms.tolist(),
    }
