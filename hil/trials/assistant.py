"""Between a session of trials and the people beside it: says what comes next, and passes their word on."""

import contextlib
import threading
from collections.abc import Callable, Iterator
from queue import SimpleQueue

from hil.control.pilot import Decision, Pilot
from hil.trials.controller import Trials
from hil.trials.phases import Phase

Told = tuple[int, int, Phase]


class Assistant:
    """Tells of each new phase from a thread of its own, so that a slow terminal does not hold the loop up.

    Args:
        tell: gets the number of the trial, how many there are, and the phase.
        at_once: gets the phase in the loop, before its next cycle, and must not take long.
    """

    def __init__(
        self, tell: Callable[[int, int, Phase], None], at_once: Callable[[Phase], None] = lambda phase: None
    ) -> None:
        self._tell, self._at_once, self._last = tell, at_once, (0, Phase.DONE)
        self._queue: SimpleQueue[Told | None] = SimpleQueue()

    def watch(self, pilot: Pilot, decision: Decision) -> None:
        """Notice a new phase; for the loop."""
        controller = pilot.controller
        if not isinstance(controller, Trials) or decision.observed.seconds < 0:
            return
        now = (controller.course.trial, controller.course.phase)
        if now != self._last:
            self._last = now
            self._at_once(now[1])
            self._queue.put((now[0], len(controller.course.protocol.trials), now[1]))

    @contextlib.contextmanager
    def at_work(self) -> Iterator[None]:
        """Tell while this lasts."""
        thread = threading.Thread(target=self._work, daemon=True)
        thread.start()
        try:
            yield
        finally:
            self._queue.put(None)
            thread.join(timeout=5)

    def _work(self) -> None:
        while (told := self._queue.get()) is not None:
            self._tell(*told)


def words_of(trial: int, count: int, phase: Phase, confirm: bool, held: bool = True) -> str:
    """What people are told; nothing of phases that need nobody."""
    if phase is Phase.ANNOUNCE:
        ask = "press Enter to stimulate, Ctrl-C to stop" if confirm else "stimulation follows"
        hold = "take hold of the arm and keep it still" if held else "keep clear of the arm"
        return f"trial {trial} of {count}: {hold}; {ask}"
    if phase is Phase.RETURN:
        return f"trial {trial} of {count}: over" + (", let go" if held else "")
    return "all trials are done" if phase is Phase.DONE else ""
