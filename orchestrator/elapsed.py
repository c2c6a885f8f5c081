"""How far long work has gone, by what it says that it does, and about how long it still takes.

Counted work ("12 of 40") is as far as it says. Other work goes through stages; the share of the time that is over when one
begins was measured, on diagnoses of the arm, the pendulum and a model of the gallery. Work with fewer rounds ends sooner than that says.
"""

import math
import re
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import ProgressColumn

# Words that tell of a stage, and the share of the time that is over when it begins; the first table that knows all words is taken.
_SLOTS = {
    "reading": 0.0,
    "building": 0.01,
    "checking the record": 0.03,
    "comparing the model": 0.09,
    "compiling": 0.2,
    "testing what the model leaves": 0.22,
    "cutting the trials": 0.25,
    "screening": 0.3,
    "refitting": 0.37,
    "following": 0.5,
    "looking along": 0.55,
    "testing what": 0.7,
    "fitting in the metric": 0.75,
    "looking at what is left": 0.78,
    "looking at every balance": 0.8,
    "estimating": 0.81,
    "candidates at": 0.82,
    "laws with states": 0.85,
    "best so far": 0.9,
    "checking": 0.94,
    "opening the held-out": 0.95,
    "choosing the next experiment": 0.97,
}
_BALANCES = {
    "reading": 0.0,
    "building": 0.02,
    "checking the record": 0.05,
    "comparing the model": 0.1,
    "estimating": 0.15,
    "candidates at": 0.16,
    "laws with states": 0.3,
    "best so far": 0.7,
    "opening the held-out": 0.95,
}
_RUNS = {"reading": 0.0, "building": 0.1, "running": 0.4, "finding the missing force": 0.6}
_TABLES = (_BALANCES, _SLOTS, _RUNS)
_COUNTED = re.compile(r"\b(\d+) of (\d+)\b")
# Sooner than that, a guess of what is left says nothing.
_LEAST_S, _LEAST_SHARE = 3.0, 0.1


class Elapsed:
    """Follows one piece of work from its beginning."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._began = self._reached_at = clock()
        self._tables = list(_TABLES)
        self._reached, self._next = 0.0, 0.0
        self._counting, self._knows = "", False

    def said(self, message: str) -> None:
        """Note what the work says that it does now."""
        counted = _COUNTED.search(message)
        if counted and 0 < int(counted[1]) <= int(counted[2]):
            if message[: counted.start()] != self._counting:  # other things are counted now, from their own beginning
                self._counting, self._reached, self._next = message[: counted.start()], 0.0, 0.0
                self._began = self._reached_at
            self._reach(int(counted[1]) / int(counted[2]), (int(counted[1]) + 1) / int(counted[2]))
            return
        self._tables = [table for table in self._tables if _stage(table, message) is not None]
        if self._tables:
            shares = sorted(self._tables[0].values())
            found = _stage(self._tables[0], message) or 0.0
            self._reach(found, next((share for share in shares if share > found), 1.0))

    @property
    def share(self) -> float | None:
        """The share that is over, which never falls; within a stage it creeps towards the next. None if nothing is known."""
        if not self._knows:
            return None
        now, width = self._clock(), self._next - self._reached
        if width <= 0.0:
            return min(self._reached, 0.99)
        before = self._reached_at - self._began
        pace = before / self._reached if self._reached > 0.0 and before > 0.0 else 10.0
        return min(self._reached + width * -math.expm1(-(now - self._reached_at) / (pace * width)), 0.99)

    @property
    def words(self) -> str:
        """Such as `42 %, about 30 s left`; empty while nothing is known."""
        share, passed = self.share, self._clock() - self._began
        if share is None:
            return ""
        if passed < _LEAST_S or share < _LEAST_SHARE:
            return f"{100.0 * share:.0f} %"
        return f"{100.0 * share:.0f} %, about {_rounded(passed * (1.0 - share) / share)} left"

    def _reach(self, share: float, following: float) -> None:
        if share > self._reached or not self._knows:
            self._knows, self._reached, self._reached_at = True, max(share, self._reached), self._clock()
            self._next = max(min(following, 1.0), self._reached)


def in_words(message: str) -> str:
    """What is being done, with effects as words; names such as `alpha_1` stay.

    >>> in_words("refitting viscous_friction at joint1 + alpha_1")
    'refitting viscous friction at joint1 + alpha_1'
    """
    return re.sub(r"(?<=[a-z])_(?=[a-z])", " ", message)


def columns(gone: Elapsed) -> "tuple[ProgressColumn, ...]":
    """What a line on a terminal shows: that it lives, the time, how far it has gone, and what it does."""
    from rich.progress import ProgressColumn, SpinnerColumn, Task, TimeElapsedColumn
    from rich.table import Column
    from rich.text import Text

    class Gone(ProgressColumn):
        def render(self, task: Task) -> Text:
            return Text(gone.words)

    class Doing(ProgressColumn):
        """The one column that gives way where a line is too long; numbers stay whole."""

        def render(self, task: Task) -> Text:
            return Text(in_words(task.description), no_wrap=True, overflow="ellipsis")

    whole = Column(no_wrap=True)
    return SpinnerColumn(), TimeElapsedColumn(whole), Gone(whole.copy()), Doing()


def _stage(table: dict[str, float], message: str) -> float | None:
    """The share at which the stage begins that a message tells of; that with the most words in common counts."""
    fitting = [words for words in table if words in message]
    return table[max(fitting, key=len)] if fitting else None


def _rounded(seconds: float) -> str:
    if seconds < 55.0:
        return f"{max(5 * round(seconds / 5.0), 1)} s"
    return f"{max(round(seconds / 60.0), 1)} min"
