"""What a run does about values that are not finite numbers: stop, hold the last finite one, or go on and say so."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Any

from fmus.errors import MisfitError
from orchestrator.cosim.component import FLOATS
from orchestrator.cosim.wiring import OUTSIDE, Slot, Wiring
from orchestrator.measurements.wording import nearest, shown

STOP, HOLD, WARN = POLICIES = ("stop", "hold", "warn")


@dataclass
class Noted:
    """Readings of one value that were not finite: how many, and the times of the first and the last in s."""

    policy: str
    first: float
    last: float
    count: int = 1

    def __str__(self) -> str:
        times = f"from t = {self.first:.9g} s to {self.last:.9g} s" if self.count > 1 else f"at t = {self.first:.9g} s"
        what = "its last finite value was used instead" if self.policy == HOLD else "it was passed on as it was"
        readings = f"in {self.count} readings " if self.count > 1 else ""
        return f"not a finite number {readings}{times}; {what}"


class NotFinite:
    """The policy of each value by its place among those of the system, and what happened.

    `noted` goes by the names of variables. An input that takes its value from an output with the policy `warn` takes
    whatever comes.
    """

    def __init__(self, wiring: Wiring, wanted: Mapping[str, str]) -> None:
        self.policies: dict[int, str] = {}
        self.noted: dict[str, Noted] = {}
        self._last: dict[int, float] = {}
        slots = [
            s for s in wiring.slots if s.component != OUTSIDE and s.port.causality == "output" and s.port.type in FLOATS
        ]
        places = {
            f"{slot.component}.{name}": slot.first + k for slot in slots for k, name in enumerate(slot.port.elements)
        }
        for pattern, policy in wanted.items():
            self._apply(pattern, policy, places)
        lenient = {place for place, policy in self.policies.items() if policy == WARN}
        for link in wiring.links:
            for source, target in zip(link.sources, link.targets, strict=True):
                if source in lenient and link.target.component != OUTSIDE:
                    self.policies[target] = WARN

    def _apply(self, pattern: str, policy: str, places: Mapping[str, int]) -> None:
        if policy not in POLICIES:
            raise MisfitError(f"nan: {pattern} = {shown(policy)}; expected {', '.join(POLICIES)}")
        found = [place for name, place in places.items() if fnmatchcase(name, pattern.replace("[", "[[]"))]
        if not found:
            raise MisfitError(f"nan: {pattern} matches no output of real numbers; {nearest(pattern, places)}")
        self.policies.update(dict.fromkeys(found, policy))

    def concerns(self, slot: Slot) -> bool:
        """Whether any value of a port has a policy other than to stop."""
        return any(self.policies.get(slot.first + k, STOP) != STOP for k in range(slot.port.size))

    def taken(self, slot: Slot, values: list[Any], time: float) -> None:
        """Note the values of a port that was read, and put the last finite ones in place of those to be held."""
        for k in range(slot.port.size):
            place = slot.first + k
            policy = self.policies.get(place, STOP)
            if policy == STOP:
                continue
            if math.isfinite(values[place]):
                self._last[place] = values[place]
            elif policy == WARN or place in self._last:
                self._note(f"{slot.component}.{slot.port.elements[k]}", policy, time)
                values[place] = self._last[place] if policy == HOLD else values[place]

    def passes(self, place: int, value: Any) -> bool:
        """Whether a value that is out of bounds may stay."""
        return self.policies.get(place) == WARN and not math.isfinite(value)

    def _note(self, name: str, policy: str, time: float) -> None:
        noted = self.noted.get(name)
        if noted is None:
            self.noted[name] = Noted(policy, time, time)
        else:
            noted.count, noted.last = noted.count + 1, time
