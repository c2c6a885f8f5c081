"""When cycles begin: when they are due, or at once where something cannot wait for it."""

import time

from hil.control.timing import RealTimer
from hil.session.heartbeat import Heartbeat

LONG_NS = 10_000_000_000


def test_a_beat_comes_at_once_where_something_cannot_wait_for_it_and_only_once() -> None:
    asked: list[int] = []

    def sign(now_ns: int) -> bool:
        asked.append(now_ns)
        return len(asked) in (3, 4)

    timer = RealTimer(LONG_NS, sign)
    began = time.monotonic_ns()
    due, now = timer.wait()
    assert due == now < began + LONG_NS // 2
    assert len(asked) == 3
    timer.period_ns = 1  # the next cycle, long before its time, is not hurried again while the reason lasts
    timer._next = time.monotonic_ns() + 30_000_000
    due, now = timer.wait()
    assert now >= due and len(asked) > 4


def test_a_watchdog_that_falls_silent_between_two_cycles_of_10_s_is_noticed_in_its_time() -> None:
    heartbeat = Heartbeat.create()
    heartbeat.watch(time.monotonic_ns())
    timer = RealTimer(LONG_NS, heartbeat.beat_and_look)
    began = time.monotonic_ns()
    timer.wait()
    took = time.monotonic_ns() - began
    assert heartbeat.limit_ns < took < LONG_NS // 2
    assert heartbeat.last_ns > began
    heartbeat.remove()


def test_what_passed_before_the_first_cycle_counts_as_no_beat_missed() -> None:
    timer = RealTimer(1_000_000)
    timer._next -= 20_000_000
    timer.start()
    timer.wait()
    assert timer.missed == 0
