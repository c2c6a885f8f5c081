"""When cycles begin: at their beat, or at once where something cannot wait for it."""

import time

from hil.control.timing import Metronome
from hil.session.heart import Heart

LONG_NS = 10_000_000_000


def test_a_beat_comes_at_once_where_something_cannot_wait_for_it_and_only_once() -> None:
    asked: list[int] = []

    def sign(now_ns: int) -> bool:
        asked.append(now_ns)
        return len(asked) in (3, 4)

    beats = Metronome(LONG_NS, sign)
    began = time.monotonic_ns()
    beat, now = beats.wait()
    assert beat == now < began + LONG_NS // 2
    assert len(asked) == 3
    beats.period_ns = 1  # the next beat, long before its time, is not hurried again while the reason lasts
    beats._next = time.monotonic_ns() + 30_000_000
    beat, now = beats.wait()
    assert now >= beat and len(asked) > 4


def test_a_watchdog_that_falls_silent_between_two_cycles_of_10_s_is_noticed_in_its_time() -> None:
    heart = Heart.create()
    heart.watch(time.monotonic_ns())
    beats = Metronome(LONG_NS, heart.beat_and_look)
    began = time.monotonic_ns()
    beats.wait()
    took = time.monotonic_ns() - began
    assert heart.limit_ns < took < LONG_NS // 2
    assert heart.last_ns > began
    heart.remove()


def test_what_passed_before_the_first_cycle_counts_as_no_beat_missed() -> None:
    beats = Metronome(1_000_000)
    beats._next -= 20_000_000
    beats.start()
    beats.wait()
    assert beats.missed == 0
