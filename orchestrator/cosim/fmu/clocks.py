"""The clocks that an FMU of FMI 3.0 declares, as the standard describes them (section 2.2.8)."""

import heapq
import math
import xml.etree.ElementTree as ET
import zipfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fmus.errors import MisfitError
from orchestrator.measurements.wording import nearest, shown


@dataclass(frozen=True)
class Clock:
    """A clock: `variability` is that of its interval (constant, fixed, calculated, tunable, changing, countdown, triggered).

    `interval` and `shift` are in s, None and 0 where the description does not say. Of two that tick at one instant, the
    one with the lower `priority` is served first.
    """

    name: str
    reference: int
    causality: str
    variability: str
    interval: float | None = None
    shift: float = 0.0
    priority: int = 0


def read_clocks(path: Path) -> tuple[Clock, ...]:
    """Clocks in the order of the description; FMPy does not read their intervals."""
    with zipfile.ZipFile(path) as archive, archive.open("modelDescription.xml") as stream:
        return tuple(map(_clock, ET.parse(stream).findall("ModelVariables/Clock")))


def _clock(element: ET.Element) -> Clock:
    resolution = float(element.get("resolution") or 1.0)
    interval = _time(element, "interval", resolution)
    return Clock(
        name=element.get("name", ""),
        reference=int(element.get("valueReference", "0")),
        causality=element.get("causality", "local"),
        variability=element.get("intervalVariability", ""),
        interval=interval,
        shift=_time(element, "shift", resolution) or 0.0,
        priority=int(element.get("priority") or 0),
    )


def _time(element: ET.Element, kind: str, resolution: float) -> float | None:
    decimal, counter = element.get(f"{kind}Decimal"), element.get(f"{kind}Counter")
    if decimal is not None:
        return float(decimal)
    return None if counter is None else float(counter) / resolution


PERIODIC = ("constant", "fixed", "calculated", "tunable", "changing")
_CHANGED = 2  # fmi3IntervalChanged


@dataclass(frozen=True, order=True)
class Tick:
    """A tick at `time` s; of two at one instant the one with the lower `priority` comes first."""

    time: float
    priority: int
    place: int
    number: int


class Agenda:
    """Ticks to come, in the order of time, then of priority.

    Args:
        inputs: the input clocks of the FMU.
        ticks: times in s at which clocks tick that somebody has to trigger, by name.
        interval: asks the FMU for the interval of a clock in s, and whether it is new (fmi3IntervalQualifier).

    Raises:
        MisfitError: if `ticks` names no clock that has to be triggered, or no times.
    """

    def __init__(
        self, inputs: Sequence[Clock], ticks: Mapping[str, Any] | None, interval: Callable[[Clock], tuple[float, int]]
    ) -> None:
        self.inputs = tuple(inputs)
        self._given = _checked(ticks or {}, self.inputs)
        self._interval = interval
        self._due: list[Tick] = []
        self._first = 0.0

    @property
    def next(self) -> float:
        """Time of the next tick in s, infinity if none is planned."""
        return self._due[0].time if self._due else math.inf

    def begin(self, first: float) -> None:
        """Plan the first ticks of a run that begins at `first` s."""
        self._first = first
        for place, clock in enumerate(self.inputs):
            if clock.variability in PERIODIC:
                self._plan(place, first + clock.shift, 0)
            for time in self._given.get(clock.name, ()):
                if time >= first:
                    self._plan(place, time, 0)

    def take(self, until: float) -> Tick | None:
        """The next tick that is due, taken off; `served` has to follow."""
        return heapq.heappop(self._due) if self.next <= until else None

    def served(self, tick: Tick) -> None:
        """Plan the tick after one of a periodic clock."""
        clock = self.inputs[tick.place]
        if clock.variability in PERIODIC:
            self._plan(tick.place, self._after(clock, tick), tick.number + 1)

    def count_down(self, time: float) -> None:
        """Ask the countdown clocks whether they were set, at `time` s, and plan their ticks."""
        for place, clock in enumerate(self.inputs):
            if clock.variability == "countdown":
                interval, qualifier = self._interval(clock)
                if qualifier == _CHANGED:
                    self._due = [each for each in self._due if each.place != place]
                    heapq.heapify(self._due)
                    self._plan(place, time + interval, 0)

    def kept(self) -> list[Tick]:
        """The ticks to come, to go back to with `back`."""
        return list(self._due)

    def back(self, kept: list[Tick]) -> None:
        """Go back to ticks that were kept."""
        self._due = list(kept)

    def _plan(self, place: int, time: float, number: int) -> None:
        heapq.heappush(self._due, Tick(time, self.inputs[place].priority, place, number))

    def _after(self, clock: Clock, tick: Tick) -> float:
        if clock.interval is not None and clock.variability in ("constant", "fixed"):
            return self._first + clock.shift + (tick.number + 1) * clock.interval
        interval, _ = self._interval(clock)
        if not (interval > 0.0 and math.isfinite(interval)):
            raise MisfitError(f"clock {clock.name!r} has the interval {interval:g} s; expected a positive time")
        return tick.time + interval


def _checked(ticks: Mapping[str, Any], inputs: Sequence[Clock]) -> dict[str, list[float]]:
    names = [clock.name for clock in inputs if clock.variability == "triggered"]
    found = {}
    for name, times in ticks.items():
        if name not in names:
            raise MisfitError(
                f"ticks of {name!r}: there is no input clock to be triggered of that name; {nearest(name, names)}"
            )
        numbers = isinstance(times, list) and all(isinstance(t, int | float) and not isinstance(t, bool) for t in times)
        if not numbers or not all(math.isfinite(t) for t in times):
            raise MisfitError(f"ticks of {name!r} = {shown(times)}; expected a list of times in s, such as [0, 0.5]")
        found[name] = sorted(map(float, times))
    return found
