"""What the bench view says of a session, in whole sentences; a tone tells how urgent each is."""

import shlex
import time
from typing import NamedTuple

from hil.bench_view.advice import ADVICE, REACTIONS, advice
from hil.bench_view.watched import STUCK_S, Life, Watched
from hil.safety.cycle import Reaction
from hil.trials.phases import Phase
from hil.view.glance import Broken, Glance

# An end that somebody wanted is no fault.
WANTED = ("not_aborted", "not_ended")


class Said(NamedTuple):
    """A headline, what to know or do about it, and its tone: good, calm, warning or bad."""

    headline: str
    more: str
    tone: str


class Fault(NamedTuple):
    """A broken rule as people read it: `when` by the clock and since the session began."""

    when: str
    happened: str
    words: str
    became: str
    do: str


def state(seen: Watched) -> Said:
    """How the session is."""
    if seen.life is Life.KILLED:
        return Said(
            "The session was killed.",
            f"Its watchdog has let the arm go: no torque, motors idle. Recorded up to the last 10 ms; {_next(seen)}",
            "bad",
        )
    if seen.life is Life.WRITING:
        return Said("The session has ended.", "Its recording is being written ...", "calm")
    if seen.life is Life.ENDED:
        return _ended(seen)
    glance = seen.glance
    if glance is None:
        return Said("The session is about to begin.", "No cycle has been run yet.", "calm")
    if seen.silent_s > STUCK_S:
        return Said(
            f"The session is stuck: no new cycle for {seen.silent_s:.0f} s.",
            "Its watchdog has let the arm go after 30 ms: no torque, motors idle. Look at the session's terminal; end it there.",
            "bad",
        )
    return _running(seen, glance)


def _running(seen: Watched, glance: Glance) -> Said:
    dry = " Dry run: no torque is sent." if seen.about.get("dry_run") else ""
    if glance.stage == 0:
        why = plain(glance.reason) if glance.reason else "It waits for somebody to press Activate on the pendant."
        return Said("Not armed: no torque.", why + dry, "calm")
    if glance.stage == 2:
        return Said(f"Stopped. {plain(glance.reason)}", f"{_became(glance.reaction)}{dry}", "bad")
    if glance.reaction == Reaction.REDUCE:
        worst = max(glance.broken, key=lambda broken: broken.last_ns, default=None)
        why = plain(f"{worst.rule}: {worst.words}") if worst is not None else ""
        return Said("Armed, with half the torque.", why + dry, "warning")
    return Said("Armed, all is well.", f"Torques pass the safety core.{dry}", "good")


def _ended(seen: Watched) -> Said:
    result = seen.result() or {}
    faults = result.get("faults", [])
    if not faults:
        return Said("The session has ended as planned.", _next(seen), "good")
    rule, _, words = str(faults[0]).partition(": ")
    do = advice(rule, words).do if rule in ADVICE else ""
    tone = "calm" if rule in WANTED else "bad"
    return Said(f"The session has ended. {plain(str(faults[0]))}", f"{do} {_next(seen)}".strip(), tone)


def _next(seen: Watched) -> str:
    if seen.folder is None:
        return "Nothing was recorded."
    folder = shlex.quote(str(seen.folder))
    further = f" and `misfit compare arm {folder}`" if any(seen.folder.glob("trial_*.parquet")) else ""
    return f"The recording is in {seen.folder}. To go on: `misfit hil replay {folder}`{further}."


def plain(reason: str) -> str:
    """A reason of the safety core, `rule: words`, in plain words with the figures behind."""
    rule, _, words = reason.partition(": ")
    if rule not in ADVICE:
        return reason
    happened = advice(rule, words).happened
    return happened if rule in WANTED else f"{happened.removesuffix('.')} ({words})."


def _became(reaction: int) -> str:
    words = REACTIONS[Reaction(reaction)]
    return words[0].upper() + words[1:] + "."


def faults(seen: Watched) -> list[Fault]:
    """All that went wrong while the arm was armed, the gravest first, as others may have followed from it; ends that were wanted are none."""
    if seen.glance is None:
        return []
    found = [broken for broken in seen.glance.broken if broken.rule not in WANTED]
    return [
        _fault(seen, seen.glance, broken) for broken in sorted(found, key=lambda each: (-each.reaction, each.first_ns))
    ]


def _fault(seen: Watched, glance: Glance, broken: Broken) -> Fault:
    clock = time.strftime("%H:%M:%S", time.localtime((broken.first_ns + float(seen.about.get("clock_ns", 0))) * 1e-9))
    first, last = ((at - glance.began_ns) * 1e-9 for at in (broken.first_ns, broken.last_ns))
    cycles = "1 cycle" if broken.cycles == 1 else f"{broken.cycles} cycles"
    span = f"at {first:.2f} s" if last - first < 0.005 else f"from {first:.2f} to {last:.2f} s"
    happened, do = advice(broken.rule, broken.words)
    words = f"{broken.words} ({broken.rule})"
    return Fault(f"{clock}, {span}, {cycles}", happened, words, _became(broken.reaction), do)


def doing(seen: Watched) -> str:
    """Where a session of trials, or of postures held by stimulation, stands; nothing for others."""
    if (posture := seen.signal("posture")) is not None and "postures" in seen.about:
        most = seen.about["postures"]
        if posture > most:
            return "All postures have been held."
        return f"Posture {posture:.0f} of {most}." if posture else f"The robot brings the arm to posture 1 of {most}."
    number, phase = seen.signal("trial"), seen.signal("phase")
    if number is None or phase is None or "trials" not in seen.about:
        return ""
    if not number:
        return f"{seen.about['trials']} trials are to come."
    return f"Trial {number:.0f} of {seen.about['trials']}: {PHASES[Phase(int(phase))]}"


PHASES = {
    Phase.MOVE: "the robot moves the arm to its posture.",
    Phase.SETTLE: "the arm comes to rest.",
    Phase.ANNOUNCE: "take hold of the arm and keep it still; the stimulation is announced.",
    Phase.STIMULATE: "the muscles are stimulated; hold against them.",
    Phase.RETURN: "over, let go; the robot moves the arm back.",
    Phase.DONE: "all trials are done.",
}
