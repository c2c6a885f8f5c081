"""Pacing against a clock that the test moves."""

import pytest

from orchestrator.cosim.run import Pacer


class Clock:
    """Time that passes by sleeping, by looking (1 us), and by working."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        self.now += 1e-6
        return self.now

    def sleep(self, seconds: float) -> None:
        assert seconds >= 0
        self.now += seconds


def _paced(factor: float, work_s: list[float], step: float = 0.01) -> tuple[Pacer, Clock]:
    clock = Clock()
    pacer = Pacer(factor, clock, clock.sleep)
    pacer.begin(0.0)
    for k, work in enumerate(work_s, 1):
        clock.now += work
        pacer.reached(k * step, step)
    return pacer, clock


@pytest.mark.parametrize("factor", [0.5, 1.0, 10.0])
def test_a_quick_run_ends_when_the_clock_says_so(factor: float) -> None:
    pacer, clock = _paced(factor, [1e-4] * 100)
    assert clock.now - 100 == pytest.approx(1 / factor, abs=1e-5)
    report = pacer.report()
    assert (report.missed, report.largest, report.points) == (0, 0.0, 100)


def test_a_step_that_takes_too_long_is_late_and_the_run_catches_up() -> None:
    # The 10th step takes 35 ms of its 10: it is 25 ms late, the next 15 and 5 ms, then all is well.
    pacer, clock = _paced(1.0, [1e-6] * 9 + [0.035] + [1e-6] * 90)
    report = pacer.report()
    assert report.largest == pytest.approx(0.025, abs=1e-4)
    assert report.missed == 2
    assert report.p50 == 0.0
    assert clock.now - 100 == pytest.approx(1.0, abs=1e-4)


def test_the_report_is_in_microseconds() -> None:
    pacer, _ = _paced(1.0, [0.015])
    assert pacer.report().to_json()["lateness_us"]["max"] == pytest.approx(5000, abs=10)
