"""Every class of faults in every phase of a session, and what came of it: `python -m tests.hil.fault_matrix` prints it.

Time is virtual, so the table is the same on every machine.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from string import ascii_lowercase

import numpy as np

from fmus.errors import MisfitError
from hil.barrett.start_up import Robot, start_up
from hil.bus.gate import TORQUES
from hil.codecs.barrett.torques import unpack_torques
from hil.control.pilot import Decision, Pilot
from hil.robots import proficio
from hil.safety.cycle import Reaction
from hil.session.loop import Loop, Wishes
from tests.hil.bench import SETTINGS, Bench, ExactTimer
from tests.hil.fault_classes import CLASSES, FaultClass, Shaken, Trouble, recorder

# Times that a message tells, and letters for messages.
_FIGURES = re.compile(r"[0-9.]+ ms")
_LETTERS = [*ascii_lowercase, *(f"a{letter}" for letter in ascii_lowercase)]
PHASES = ("scan", "wake", "zero", "arm", "run", "stop")
CYCLES, FAULT_AT, WAIT = 400, 150, 120
# The arm is armed and let down in a tenth of a second, so that a session is short.
QUICK = replace(SETTINGS, limits=replace(SETTINGS.limits, ramp_s=0.1))


@dataclass
class Outcome:
    """What a fault led to.

    `reaction` is the worst one from the fault on, `cycles` how many it took to get there, `reason` what the user is
    told; `error` is the message with which the session ended, if it did; `largest` is the largest share of a joint's limit
    that was ever sent, `last` the torques of the last frame, `energised` whether any torque was sent before arming.
    """

    reaction: Reaction = Reaction.PASS
    cycles: int = 0
    reason: str = ""
    error: str = ""
    largest: float = 0.0
    last: tuple[int, ...] = (0, 0, 0, 0)
    energised: bool = False
    lost: int = 0

    def told(self) -> str:
        """What the user is told, without figures that differ from phase to phase."""
        return _FIGURES.sub("N ms", self.error or self.reason)

    def cell(self, told: dict[str, str]) -> str:
        """A cell of the table: what came of it, after so many cycles, and a letter for what the user is told."""
        if not self.error and self.reaction is Reaction.PASS:
            return "-"
        letter = told.setdefault(self.told(), _LETTERS[len(told)])
        if self.error:
            return f"ends ({letter})"
        return f"{self.reaction.name.lower()} {max(self.cycles, 1)} ({letter})"


@cache
def outcome_of(fault: FaultClass, phase: str) -> Outcome:
    """Run a session with the fault in that phase."""
    bench, found = Bench(settings=QUICK), Outcome()
    trouble = Trouble(bench, Shaken(QUICK.make_controller()), recorder())

    def begin() -> None:
        if not trouble.memory.get("begun"):
            trouble.memory["begun"] = True
            trouble.memory["cycling"] = phase in ("arm", "run", "stop")
            fault.start(trouble)

    try:
        robot = _started(bench, phase, begin)
        trouble.memory["cycling"] = True
        found.energised = bool(bench.torque_frames())
        bench.plant.angles = np.array([-0.3, 0.2, 1.5])
        bench.robot.advance(bench.bus.time_ns)
        pilot = Pilot(robot, bench.settings.limits, trouble.controller, gravity=False)
        _cycle(bench, pilot, phase, begin, found, trouble)
        found.lost = pilot.missing_answers
    except MisfitError as error:
        found.error = str(error).removeprefix("virtual robot: ")
    finally:
        trouble.undo.close()
        trouble.recorder.ring.remove()
    _torques(bench, found)
    bench.wire.close()
    return found


def _started(bench: Bench, phase: str, begin: Callable[[], None]) -> Robot:
    """Start up, with the fault before the scan, before the nodes wake, or before the arm is zeroed."""
    if phase == "scan":
        begin()

    def sleep(seconds: float) -> None:
        if phase == "wake":
            begin()
        bench.sleep(seconds)

    def at_home() -> bool:
        if phase == "zero":
            begin()
        return True

    return start_up(bench.wire, bench.settings.side, sleep, at_home)


def _cycle(bench: Bench, pilot: Pilot, phase: str, begin: Callable[[], None], found: Outcome, trouble: Trouble) -> None:
    count, began, refused = 0, 0, pilot.refused
    # What happens does not depend on how long the start-up took, which tests shorten.
    cycling_ns = bench.bus.time_ns

    def wishes() -> Wishes:
        nonlocal count, began
        count += 1
        over = count > CYCLES
        if (phase == "arm" and count == 1) or (phase == "run" and count == FAULT_AT) or (phase == "stop" and over):
            begin()
        if trouble.memory.get("begun") and not began:
            began = count
        return Wishes(arm=not pilot.is_armed and count < WAIT, over=over)

    def watch(start_ns: int, decision: Decision) -> None:
        reaction = decision.outcome.reaction
        nonlocal refused
        found.energised |= not pilot.is_armed and any(decision.outcome.torques or ())
        if pilot.cycle < WAIT:
            refused = pilot.refused
        since_ns = start_ns - cycling_ns
        bench.plant.outside = 0.1 * np.sin(1e-8 * since_ns * np.array([3.0, 4.0, 5.0]))  # somebody is there
        stopped = pilot.stopped
        if stopped is not None and stopped.rule in ("not_aborted", "not_ended"):
            return
        if began and pilot.is_armed and reaction > found.reaction:
            found.reaction, found.cycles = reaction, pilot.cycle - began
            trips = [trip for trip in decision.outcome.trips if trip.reaction == reaction]
            found.reason = str(stopped) if not trips else pilot.told(trips[0])

    Loop(bench.wire, pilot, ExactTimer(bench), trouble.recorder, watch=watch).run(wishes)
    if not pilot.is_armed:
        found.error = f"not armed: {pilot.told(refused) if refused else refused}"


def _torques(bench: Bench, found: Outcome) -> None:
    """What was on the bus."""
    limits = np.array([joint.torque for joint in bench.settings.limits.joints])
    for timed in bench.sent:
        if timed.frame.identifier == TORQUES:
            counts = unpack_torques(timed.frame.data)
            torques = proficio.joint_torques(np.array(counts[:3]) / proficio.Controller().torque_units)
            # A count of each motor is lost to rounding.
            slack = np.abs(proficio.JOINT_TO_MOTOR).sum(axis=0) / proficio.Controller().torque_units
            found.largest = max(found.largest, float(np.max((np.abs(torques) - slack) / limits)))
            found.last = counts


def table() -> str:
    """The matrix in Markdown, and below it what the letters stand for."""
    told: dict[str, str] = {}
    lines = ["| fault | " + " | ".join(PHASES) + " |", "|---" * (len(PHASES) + 1) + "|"]
    for fault in CLASSES:
        cells = [outcome_of(fault, phase).cell(told) for phase in PHASES]
        lines.append(f"| {fault.name} | " + " | ".join(cells) + " |")
    lines += ["", "| | what the user is told |", "|---|---|"]
    lines += [f"| {letter} | {words.replace('|', '/')} |" for words, letter in told.items()]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    print(table(), end="")
