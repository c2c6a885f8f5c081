"""How long a robot takes to answer: measured before it is armed, one question after the other on a quiet bus."""

import math

from hil.bus.wire import Wire
from hil.robots.answers import listen_ns
from hil.robots.base import Robot
from hil.safety.limits import Limits

# Questions that are put, and how long each is waited for.
QUESTIONS, PATIENCE_S = 20, 0.1


def measured(wire: Wire, robot: Robot, questions: int = QUESTIONS) -> list[float]:
    """Times in s from a question for all positions to the last answer, sorted; infinite where one did not come.

    Each question waits for all answers to the one before it, so that no answer can be taken for another's.
    """
    wire.drain()
    frames, awaited = robot.question()
    times = []
    for _ in range(questions):
        missing = set(awaited)
        began = wire.now()
        wire.send(*frames)
        while missing and wire.now() - began < PATIENCE_S * 1e9:
            timed = wire.receive(PATIENCE_S)
            if timed is None:
                break
            missing.discard(timed.frame.identifier)
        times.append(math.inf if missing else (wire.now() - began) * 1e-9)
    return sorted(times)


def too_slow(times: list[float], limits: Limits) -> str:
    """Why answers that take so long (s, sorted) are too slow for a session; "" if half of them come in time."""
    median, period = times[len(times) // 2], limits.period_ns * 1e-9
    wait = listen_ns(limits) * 1e-9
    if median <= wait:
        return ""
    took = f"take {median * 1e3:.3g} ms (median)" if math.isfinite(median) else f"do not come within {PATIENCE_S:g} s"
    return f"positions {took}, and a cycle of {period * 1e3:.3g} ms waits {wait * 1e3:.3g} ms; lower --rate or look for what delays them"
