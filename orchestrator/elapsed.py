"""How far long work has gone, by what it says that it does, and about how long it still takes.

Counted work ("12 of 40") is as far as it says. A search does not know how many rounds it will need, so a share is one of the
present step: shares of whole searches, measured on others, were wrong by a factor of ten.
"""

import itertools
import re
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import ProgressColumn

_COUNTED = re.compile(r"\b(\d+) of (\d+)\b")
# Sooner than that, a guess of what is left says nothing.
_LEAST_S, _LEAST_SHARE = 3.0, 0.1


class Elapsed:
    """Follows one piece of work from its beginning."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._began = self._reached_at = clock()
        self._done, self._all = 0, 0
        self._counting = ""

    def said(self, message: str) -> None:
        """Note what the work says that it does now."""
        counted = _COUNTED.search(message)
        if not counted or not 0 < int(counted[1]) <= int(counted[2]):
            self._counting, self._all, self._reached_at = "", 0, self._clock()
            return
        # other things are counted now, from their own beginning
        if message[: counted.start()] != self._counting or counted[1] == "1":
            self._counting, self._began, self._done = message[: counted.start()], self._reached_at, 0
        if int(counted[1]) > self._done or int(counted[2]) != self._all:
            self._done, self._all, self._reached_at = int(counted[1]), int(counted[2]), self._clock()

    @property
    def share(self) -> float | None:
        """The share that is over, which is never all of it; None if nothing is counted."""
        return min(self._done / self._all, 0.99) if self._all else None

    @property
    def words(self) -> str:
        """Such as `42 % of this step, about 30 s left of it`; empty while nothing is counted."""
        share, passed = self.share, self._clock() - self._began
        if share is None:
            return ""
        if passed < _LEAST_S or share < _LEAST_SHARE:
            return f"{100.0 * share:.0f} % of this step"
        return f"{100.0 * share:.0f} % of this step, about {_rounded(passed * (1.0 - share) / share)} left of it"


def counting(say: Callable[[str], None], doing: str, total: int) -> Callable[[str], None]:
    """Say of each of so many things that it is being done now, from whichever thread does it.

    >>> trying = counting(print, "trying", 2)
    >>> trying("drift"), trying("backlash")
    trying 1 of 2: drift
    trying 2 of 2: backlash
    (None, None)
    """
    numbers = itertools.count(1)
    return lambda what: say(f"{doing} {next(numbers)} of {total}: {what}" if total > 1 else f"{doing} {what}")


def in_words(message: str) -> str:
    """What is being done, with effects as words; names such as `alpha_1` and of files stay.

    >>> in_words("refitting viscous_friction at joint1 + alpha_1"), in_words("reading runs/two_rooms")
    ('refitting viscous friction at joint1 + alpha_1', 'reading runs/two_rooms')
    """
    return " ".join(w if "/" in w else re.sub(r"(?<=[a-z])_(?=[a-z])", " ", w) for w in message.split(" "))


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


def _rounded(seconds: float) -> str:
    if seconds < 55.0:
        return f"{max(5 * round(seconds / 5.0), 1)} s"
    return f"{max(round(seconds / 60.0), 1)} min"
