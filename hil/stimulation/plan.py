"""Which postures a session of stimulation holds, how, and what was learned before it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from fmus.errors import MisfitError

MUSCLES = 6
Pair = tuple[float, float]


@dataclass(frozen=True)
class Rest:
    """A limb at rest: its angles (2,) in rad and the activations (6,) that held it there."""

    angles: Pair
    activations: tuple[float, ...]


@dataclass(frozen=True)
class Plan:
    """Postures (rad, shoulder and elbow) that are reached in `reach_s` and held for `hold_s`; the last `judged_s` count.

    `integral` 1/s is how fast the integrator takes over what feedback holds against (0: no integrator); `strength` (6,) are
    those of the emulated muscles, which the controller does not know; `learned` is what earlier rounds have shown.
    """

    postures: tuple[Pair, ...]
    reach_s: float = 2.0
    hold_s: float = 3.0
    judged_s: float = 0.5
    integral: float = 1.5
    strength: tuple[float, ...] = (1.0,) * MUSCLES
    learned: tuple[Rest, ...] = ()

    def __post_init__(self) -> None:
        """Refuse what cannot be held."""
        if not self.postures or any(len(each) != 2 for each in self.postures):
            raise MisfitError(
                "postures of a stimulation are pairs of angles in rad, shoulder and elbow; one or more were expected"
            )
        numbers = [self.reach_s, self.hold_s, self.judged_s, self.integral, *self.strength, *sum(self.postures, ())]
        if not all(map(math.isfinite, numbers)):
            raise MisfitError("a stimulation has a value that is no number")
        if min(self.reach_s, self.judged_s) <= 0 or self.hold_s < self.judged_s or self.integral < 0:
            raise MisfitError(
                f"reach_s = {self.reach_s:g}, hold_s = {self.hold_s:g}, judged_s = {self.judged_s:g} s, integral ="
                f" {self.integral:g} 1/s; positive times, of which the last is no longer than the hold, were expected"
            )
        if len(self.strength) != MUSCLES or not all(0.0 <= value <= 2.0 for value in self.strength):
            raise MisfitError(f"strength = {list(self.strength)}; {MUSCLES} numbers from 0 to 2 were expected")

    def after(self, rests: tuple[Rest, ...]) -> "Plan":
        """The plan of the next round, which knows what this one has shown."""
        return replace(self, learned=(*self.learned, *rests))


def plan_of_json(document: Mapping[str, Any]) -> Plan:
    """A plan of a recording."""
    learned = tuple(Rest(tuple(each["angles"]), tuple(each["activations"])) for each in document["learned"])
    postures = tuple((float(q1), float(q2)) for q1, q2 in document["postures"])
    return Plan(**{**document, "postures": postures, "strength": tuple(document["strength"]), "learned": learned})
