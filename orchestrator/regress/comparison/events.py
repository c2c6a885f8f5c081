"""Events by count and time: jumps of a signal, or its crossings of a level."""

import math
from dataclasses import dataclass, replace
from typing import ClassVar, Literal, get_args

import numpy as np

from fmus.errors import MisfitError
from orchestrator.regress.comparison.distance import jump_times
from orchestrator.regress.comparison.prepare import alone, prepare
from orchestrator.regress.comparison.signal import (
    ROUNDING,
    TIME_ROUNDING,
    Signal,
    SignalVerdict,
    Tolerance,
    at_least,
    numbers,
    quantity,
    rounded_up,
    seconds,
)

Direction = Literal["any", "rising", "falling"]


@dataclass(frozen=True)
class Events:
    """As many events as expected, in order, each within the tolerance's `time_shift_s` of its expected time.

    Without `times` or `count` the reference says what is expected. How far the value is off does not count here.

    Args:
        count: how many events; their times are free unless `times` says them.
        times: s, when they happen.
        level: in the signal's unit; events are crossings of it. None takes jumps larger than `absolute`.
        direction: which crossings or jumps count.
    """

    count: int | None = None
    times: tuple[float, ...] | None = None
    level: float | None = None
    direction: Direction = "any"
    tolerance: Tolerance = Tolerance()
    kind: ClassVar[str] = "events"

    def __post_init__(self) -> None:
        at_least(0, count=self.count)
        numbers(level=self.level, **{f"times[{k + 1}]": time for k, time in enumerate(self.times or ())})
        if self.direction not in get_args(Direction):
            raise MisfitError(f"direction = {self.direction!r}, expected one of {', '.join(get_args(Direction))}")
        if self.times is not None and self.count not in (None, len(self.times)):
            raise MisfitError(f"count = {self.count} with {len(self.times)} times; leave one of them out")

    @property
    def needs_reference(self) -> bool:
        """Whether `judge` fails without a reference."""
        return self.count is None and self.times is None

    def judge(self, signal: Signal, reference: Signal | None) -> SignalVerdict:
        """Return the verdict; damaged data are a failed verdict with a reason."""
        if self.needs_reference:
            pair = prepare(self.kind, signal, reference, self.tolerance)
            if isinstance(pair, SignalVerdict):
                return pair
            return self._judge(pair.result, self._events(pair.reference))
        result = alone(self.kind, signal, self.tolerance)
        if isinstance(result, SignalVerdict):
            return result
        return self._judge(result, None if self.times is None else np.sort(np.array(self.times, dtype=float)))

    def _events(self, signal: Signal) -> np.ndarray:
        if self.level is not None:
            return crossings(signal, self.level, self.direction)
        return jump_times(signal, self.tolerance.absolute or 0.0, self.direction)

    def _judge(self, result: Signal, due: np.ndarray | None) -> SignalVerdict:
        found = self._events(result)
        expected = self.count if due is None else len(due)
        what = "jumps" if self.level is None else f"crossings of {quantity(self.level, result.unit)}"
        if self.direction != "any":
            what = f"{self.direction} {what}"
        verdict = SignalVerdict(result.name, True, "", self.kind, result.unit)
        if len(found) != expected:
            return replace(verdict, passed=False, reason=_count_text(what, found, expected or 0, due))
        if due is None or not len(due):
            return replace(verdict, reason=f"has {len(found)} {what}, as expected")
        return self._judge_times(verdict, what, found, due, float(np.abs(result.time[[0, -1]]).max()))

    def _judge_times(
        self, verdict: SignalVerdict, what: str, found: np.ndarray, due: np.ndarray, latest: float
    ) -> SignalVerdict:
        shifts = found - due
        worst = int(np.argmax(np.abs(shifts)))
        shift, limit = float(shifts[worst]), self.tolerance.time_shift_s
        passed = abs(shift) <= limit * (1 + ROUNDING) + latest * TIME_ROUNDING
        needed = abs(shift) if passed else rounded_up(abs(shift))
        side = "late" if shift > 0 else "early"
        reason = f"has {len(found)} {what}, the worst {seconds(abs(shift))} {side} at {seconds(due[worst])}, tolerance {seconds(limit)}"
        return replace(
            verdict,
            passed=passed,
            reason=reason if passed else f"{reason}; would pass with time_shift_s = {needed:g}",
            tolerance=seconds(limit),
            worst_time=float(due[worst]),
            exceed=abs(shift) / limit if limit else (0.0 if passed else math.inf),
            would_have_passed=needed,
            would_have_passed_time_shift_s=needed,
            event_shift_s=shift,
            points_outside=int(np.count_nonzero(np.abs(shifts) > limit)),
        )


def _count_text(what: str, found: np.ndarray, expected: int, due: np.ndarray | None) -> str:
    text = f"has {len(found)} {what}, expected {expected}"
    if due is None:
        return text
    both = min(len(found), len(due))
    longer, name = (found, "result") if len(found) > len(due) else (due, "reference")
    # The first pair farther apart than the next one would be is where one of the two has an event more.
    gaps = np.abs(found[:both] - due[:both])
    slipped = np.flatnonzero(gaps > np.abs(longer[1 : both + 1] - (due if longer is found else found)[:both]))
    odd = int(slipped[0]) if len(slipped) else both
    return f"{text}; the first without a partner is in the {name} at {seconds(longer[odd])}"


def crossings(signal: Signal, level: float, direction: Direction = "any") -> np.ndarray:
    """Return when a signal crosses a level, s, rising: from below to it or above, or from there to below it.

    Args:
        signal: the signal.
        level: in its unit.
        direction: "any", "rising" or "falling".

    Example:
        >>> crossings(Signal("h", [0.0, 1.0, 2.0], [0.0, 4.0, 0.0]), 1.0)
        array([0.25, 1.75])
    """
    above = signal.values >= level
    k = np.flatnonzero(above[1:] != above[:-1])
    if direction != "any":
        k = k[above[k + 1] == (direction == "rising")]
    if signal.interpolation == "hold":
        return signal.time[k + 1]
    share = (level - signal.values[k]) / (signal.values[k + 1] - signal.values[k])
    return signal.time[k] + share * (signal.time[k + 1] - signal.time[k])
