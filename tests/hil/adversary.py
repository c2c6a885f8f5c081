"""An adversary of the safety core: random cycles, most of them nearly calm so that the arm stays armed, some of them absurd.

Whatever comes out is checked against the limits by a second implementation, which knows nothing of rules and limiters.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from hil.record import replaced
from hil.safety.core import begin, step
from hil.safety.cycle import Module, Outcome, Reaction, Seen, State
from hil.safety.limits import Limits
from tests.hil.cycles import LIMITS

EPISODE = 250
_ABSURD = (math.nan, math.inf, -math.inf, 1e300, -1e300, -0.0, 5e-324)
_PASSED = (0, -1, -LIMITS.period_ns, 1, 3 * LIMITS.period_ns, 20 * LIMITS.period_ns, 10**9, 10**15)
_MODULES = (None, Module.ESTOP, Module.IDLE)


@dataclass
class Found:
    """What came of some cycles: how many there were, in how many torque was on, and breaches in words."""

    cycles: int = 0
    energised: int = 0
    stopped: int = 0
    breaches: list[str] = field(default_factory=list)


def attack(seed: int, cycles: int, limits: Limits = LIMITS, until: str | None = None) -> Found:
    """Run episodes of an arm that is armed at the beginning of each, at most until a breach has certain words."""
    random, found = np.random.default_rng(seed), Found()
    while found.cycles < cycles and not (until and any(until in breach for breach in found.breaches)):
        _episode(random, limits, min(EPISODE, cycles - found.cycles), found)
    return found


def _episode(random: np.random.Generator, limits: Limits, cycles: int, found: Found) -> None:
    count = len(limits.joints)
    position = random.uniform(-0.9, 1.0, count)
    state = begin(limits, 0, tuple(position.tolist()))
    temper = 10.0 ** random.uniform(-3.5, -0.3)
    steps = random.normal(0.0, random.choice([1e-4, 5e-4, 2e-3]), (cycles, count)) + random.normal(0, 3e-4, count)
    asked = random.normal(0.0, random.choice([1.0, 6.0, 40.0]), (cycles, count)).tolist()
    support = random.normal(0.0, 2.0, (cycles, count)).tolist()
    where = np.clip(position + np.cumsum(steps, axis=0), -1.3, 1.3).tolist()
    odd = random.random(cycles) < temper
    for k in range(cycles):
        seen = Seen(state.time_ns + limits.period_ns, tuple(where[k]), tuple(asked[k]), tuple(support[k]), arm=k == 0)
        if odd[k]:
            seen = _absurd(random, seen, state)
        before = state
        state, outcome = step(limits, state, seen)
        found.cycles += 1
        found.energised += any(outcome.torques or ())
        found.stopped += state.stopped is not None
        found.breaches += breaches(limits, before, state, seen, outcome)


def _absurd(random: np.random.Generator, seen: Seen, state: State) -> Seen:
    """A cycle with one thing wrong."""
    return replaced(seen, **_CHANGES[random.integers(len(_CHANGES))](random, seen, state))


def _poisoned(random: np.random.Generator, values: tuple) -> tuple:
    changed = list(values)
    changed[random.integers(len(changed))] = _ABSURD[random.integers(len(_ABSURD))]
    return tuple(changed)


_CHANGES = (
    lambda r, s, t: {"asked": _poisoned(r, s.asked)},
    lambda r, s, t: {"support": _poisoned(r, s.support)},
    lambda r, s, t: {"positions": _poisoned(r, s.positions)},
    lambda r, s, t: {"positions": (None,) * int(r.integers(4))},
    lambda r, s, t: {"doubted": tuple((r.random(int(r.integers(1, 4))) < 0.5).tolist())},
    lambda r, s, t: {"positions": tuple(r.uniform(-2, 2, len(s.positions)).tolist())},
    lambda r, s, t: {"asked": s.asked[: int(r.integers(3))]},
    lambda r, s, t: {"support": (*s.support, 1.0)},
    lambda r, s, t: {"time_ns": t.time_ns + int(_PASSED[r.integers(len(_PASSED))])},
    lambda r, s, t: {"computing_ns": int(r.integers(0, 10**7))},
    lambda r, s, t: {"force": tuple(r.normal(0, 60, 3).tolist())},
    lambda r, s, t: {"force": _poisoned(r, (1.0, 2.0, 3.0))},
    lambda r, s, t: {"force_saturated": True, "force": (1.0, 2.0, 3.0)},
    lambda r, s, t: {"temperatures": _poisoned(r, (30.0, 70.0))},
    lambda r, s, t: {"unmodelled": _poisoned(r, (0.0, 0.0))},
    lambda r, s, t: {"force_missing_ns": int(r.integers(10**9)), "force": (1.0, 2.0, 3.0)},
    lambda r, s, t: {"module": _MODULES[r.integers(len(_MODULES))]},
    lambda r, s, t: {str(r.choice(["foreign_torque", "abort", "end", "arm"])): True},
    lambda r, s, t: {str(r.choice(["warning", "fault"])): "velocity"},
    lambda r, s, t: {str(r.choice(["recording", "watched"])): False},
)


def breaches(limits: Limits, before: State, after: State, seen: Seen, outcome: Outcome) -> list[str]:
    """What an outcome does that no limit allows, in words."""
    if outcome.torques is None:
        return [] if outcome.reaction is Reaction.SILENCE else ["silent without an emergency stop"]
    found = []
    if outcome.reaction >= Reaction.RELEASE and any(outcome.torques):
        found.append(f"torque after {outcome.reaction.name}")
    if after.armed_ns is None and any(outcome.torques):
        found.append("torque before arming")
    anew = after.armed_ns != before.armed_ns
    if before.stopped is not None and not anew and outcome.reaction < before.stopped.reaction:
        found.append(f"{outcome.reaction.name} after {before.stopped}")
    for k, (joint, t, last) in enumerate(zip(limits.joints, outcome.torques, before.torques, strict=True)):
        last = 0.0 if anew else last
        speed, position = after.motion.speeds[k], after.motion.positions[k]
        if not math.isfinite(t) or abs(t) > joint.torque:
            found.append(f"joint {k + 1}: {t} N.m, limit {joint.torque}")
            continue
        grown = abs(t) - abs(last) if t * last >= 0 else abs(t)
        if grown > joint.torque_rate * limits.period_ns * 1e-9 * (1 + 1e-9):
            found.append(f"joint {k + 1}: {last} to {t} N.m in a cycle")
        if t * speed > limits.power / len(limits.joints) * (1 + 1e-9):
            found.append(f"joint {k + 1}: {t * speed} W")
        if abs(speed) > joint.speed and t * speed > 0:
            found.append(f"joint {k + 1}: driven on at {speed} rad/s")
        if (position > joint.high and t > 0) or (position < joint.low and t < 0):
            found.append(f"joint {k + 1}: pushed outwards at {position} rad")
        for zone in joint.zones:
            if zone.low <= position <= zone.high and abs(t) > zone.torque:
                found.append(f"joint {k + 1}: {t} N.m in a zone of {zone.torque}")
    return found
