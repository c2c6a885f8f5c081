"""Cycles for tests of the safety core: an arm at rest that is armed and asked for little, and ways to disturb it."""

from dataclasses import replace
from typing import Any

from hil.record import replaced
from hil.safety.core import begin, step
from hil.safety.cycle import Outcome, Seen, State
from hil.safety.limiters import LIMITERS, Limiter
from hil.safety.limits import JointLimits, Limits, Zone
from hil.safety.rules import RULES, Rule

JOINT = JointLimits(torque=10.0, torque_rate=2000.0, speed=1.0, low=-1.0, high=1.0, margin=0.1, breakaway=3.0)
# The first joint's motor bears 5 N.m for ever, the second pinches where it is bent furthest.
FIRST = replace(JOINT, continuous=5.0)
SECOND = replace(JOINT, zones=(Zone(0.8, 1.2, 2.0),))
LIMITS = Limits(
    joints=(FIRST, SECOND), energy=0.5, frozen_s=0.04, effect_s=10.0, ramp_s=0.1, thermal_s=1.0, pinch_s=0.06
)
PERIOD = LIMITS.period_ns
PERIOD_S = PERIOD * 1e-9


class Arm:
    """Feeds cycles to the core; `seen` are the fields that differ from a calm cycle."""

    def __init__(
        self, limits: Limits = LIMITS, rules: tuple[Rule, ...] = RULES, limiters: tuple[Limiter, ...] = LIMITERS
    ) -> None:
        self.limits, self.rules, self.limiters = limits, rules, limiters
        self.positions = (0.0,) * len(limits.joints)
        self.state: State = begin(limits, 0, self.positions)
        self.outcomes: list[Outcome] = []

    @property
    def now(self) -> int:
        return self.state.time_ns

    def calm(self, **seen: Any) -> Seen:
        zeros = (0.0,) * len(self.limits.joints)
        wiggle = 1e-6 * (len(self.outcomes) % 2)  # a live encoder never says quite the same
        positions = tuple(q + wiggle for q in self.positions)
        basis = Seen(time_ns=self.now + self.limits.period_ns, positions=positions, asked=zeros, support=zeros)
        return replaced(basis, **seen)

    def cycle(self, **seen: Any) -> Outcome:
        self.state, outcome = step(self.limits, self.state, self.calm(**seen), rules=self.rules, limiters=self.limiters)
        self.outcomes.append(outcome)
        return outcome

    def cycles(self, count: int, **seen: Any) -> Outcome:
        for _ in range(count):
            outcome = self.cycle(**seen)
        return outcome

    def armed(self) -> "Arm":
        """Armed, and so long ago that the ramp is over."""
        self.cycle(arm=True)
        self.cycles(60)
        return self
