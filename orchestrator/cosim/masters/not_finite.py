"""Values that are out of range or no finite numbers: the error that they are, or what is done instead."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Any

from fmus.errors import ComponentError, MisfitError
from fmus.units import after_number
from orchestrator.cosim.component import FLOATS, INTEGERS
from orchestrator.cosim.wiring import OUTSIDE, Slot, Wiring
from orchestrator.measurements.wording import nearest, shown


def limits(slot: Slot) -> tuple[float, float] | None:
    """The declared range, or None for a type that has none."""
    port = slot.port
    if port.type not in FLOATS and port.type not in INTEGERS:
        return None
    low = -math.inf if port.minimum is None else port.minimum
    return low, math.inf if port.maximum is None else port.maximum


def fits(value: Any, low: float, high: float) -> bool:
    """Whether a number is finite and in [low, high]."""
    return low <= value <= high and -math.inf < value < math.inf


def outside(slot: Slot, element: int, value: Any, time: float, last_good: float) -> ComponentError:
    """The error for a value that does not fit.

    Args:
        slot: the port.
        element: number of the element, from 0.
        value: what it was.
        time: in s.
        last_good: last time at which all values fitted, in s.
    """
    port = slot.port
    name = f"{slot.component}.{port.elements[element]}"
    unit = after_number(port.unit)
    if not math.isfinite(value):
        wrong = f"{name} = {value}{unit} at t = {time:.9g} s is not a finite number"
    else:
        low, high = limits(slot) or (-math.inf, math.inf)
        wrong = f"{name} = {value:.9g}{unit} at t = {time:.9g} s is outside [{low:.9g}, {high:.9g}]{unit}"
    return ComponentError(f"{wrong}; last good state is t = {last_good:.9g} s")


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
