"""What commands of the bench ask and say at a terminal, and the robot that their options mean."""

import contextlib
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fmus.errors import MisfitError
from orchestrator.cli.common import screen_paused

if TYPE_CHECKING:
    from hil.robots.base import Robot
    from hil.settings import Settings
    from hil.virtual.body import Body
    from hil.virtual.direct_bus import DirectBus


def robot_of(
    virtual: bool, bench: Path | None, rate_hz: float, stack: contextlib.ExitStack, kind: str = "proficio"
) -> "Settings":
    """Settings of the robot that the options mean; a virtual one is a process of its own that lives as long as the stack."""
    from dataclasses import replace

    from hil.virtual.process import virtual_robot

    settings = _settings(virtual, bench, rate_hz, kind)
    return replace(settings, bus=stack.enter_context(virtual_robot(settings.side, None, kind))) if virtual else settings


def robot_with_arm(
    virtual: bool, bench: Path | None, rate_hz: float, body: "Body", kind: str = "proficio"
) -> "tuple[Settings, DirectBus | None]":
    """Settings of the robot that the options mean, and a virtual one with an arm on it in this process, which proves itself.

    Its time is virtual: what a busy machine needs longer does not count.
    """
    from dataclasses import replace

    from hil.virtual.direct_bus import DirectBus
    from hil.virtual.made import Made

    settings = _settings(virtual, bench, rate_hz, kind)
    if not virtual:
        return settings, None
    inside = DirectBus(Made(settings.side, body=body, kind=kind).made(), time_ns=time.monotonic_ns())
    return replace(settings, proof=True, bus={"interface": "virtual time"}), inside


def _settings(virtual: bool, bench: Path | None, rate_hz: float, kind: str) -> "Settings":
    from hil.settings import read_settings, virtual_settings
    from hil.virtual.made import DRIVES, DRIVES_OPTIONS

    if virtual == (bench is not None):
        raise MisfitError("say either --virtual or --bench FILE: one of them tells which robot")
    if bench is not None:
        return read_settings(bench, rate_hz)
    return virtual_settings(rate_hz=rate_hz, robot=kind, options=DRIVES_OPTIONS if kind == DRIVES else None)


def gaps(document: Mapping[str, Any]) -> str:
    """A line on the longest times between cycles and torques, and on how long answers took."""
    if "largest_gap_ms" not in document:  # a session that broke off
        return ""
    gap, took = document["largest_gap_ms"], document["round_trip_us"]
    without = [f"without {name}, with halved limits\n" for name in document["without"]]
    return (
        f"longest gap {gap['cycles']} ms between cycles, {gap['torque_frames']} ms between torque frames, {gap['signs']} ms between"
        f" signs of the loop (limit {gap['limit']:g} ms); answers after {took['p50']} us (median), {took['max']} us (at most)\n"
        + "".join(without)
    )


# No slower rate than this is advised: at 25 Hz the safety module itself stopped a session of trials.
_SLOWEST_HZ = 50.0
# How a virtual robot fails whose process stood still; limits of time grow with the period.
_STALLED = ("positions_answered", "on_time", "watched", "force_bounded: the force sensor has not answered")


def stopped_by(document: Mapping[str, Any], virtual: bool) -> str:
    """Lines that say what went wrong in a session, if anything did; a virtual robot on a busy machine answers late."""
    from orchestrator.measurements.wording import counted

    lines = ""
    if slow := document.get("slow_cycles", 0):
        lines += f"the controller took more than half of the cycle {counted(slow, 'time')}; 6 ms of it in a row halve its torque, 30 ms stop the arm\n"
    lines += "".join(f"stopped by {fault}\n" for fault in document["faults"])
    if virtual and any(fault.startswith(_STALLED) for fault in document["faults"]):
        rate = float(document["rate_hz"])
        slower = f"; try --rate {min(100.0, rate / 2):g}" if rate >= 2 * _SLOWEST_HZ else ""
        lines += f"this machine is too busy for a virtual robot at {rate:g} Hz{slower}\n"
    return lines


def yes(robot: object = None) -> bool:
    """Nobody needs to be asked about a robot that is not there."""
    return True


def questions(inside: "DirectBus | None") -> "tuple[Callable[[], bool], Callable[[Robot], bool]]":
    """Whether the arm is zeroed and may be armed: people are asked, or a virtual robot of this process, whose arm is let come to
    rest first, as people would."""
    if inside is None:
        return ask_home, ask_arm
    return yes, lambda robot: inside.come_to_rest()


def ask_home() -> bool:
    _needs_somebody("the arm has not been zeroed; whether it stands where it is zeroed needs somebody at a terminal")
    with screen_paused():
        return click.confirm("The arm has not been zeroed. Is it on its stops?")


def ask_arm(robot: "Robot") -> bool:
    _needs_somebody("arming needs somebody at a terminal who confirms it")
    words = f"A real {robot.about} is on this bus. Type ARM to switch its torques on"
    with screen_paused():
        _forget_typed()
        return click.prompt(words, default="", show_default=False) == "ARM"


def _needs_somebody(words: str) -> None:
    if not sys.stdin.isatty():
        raise MisfitError(f"{words} (`misfit sweep` asks before each run with --workers 1)")


def _forget_typed() -> None:
    """What was typed before a question is no answer to it."""
    import termios  # not on Windows

    with contextlib.suppress(OSError, termios.error):
        termios.tcflush(sys.stdin.fileno(), termios.TCIFLUSH)
