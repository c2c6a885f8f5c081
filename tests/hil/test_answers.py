"""Old answers never pass as new ones, however late they are; what delays them is told."""

from dataclasses import replace

import pytest

from hil.codecs.barrett.identifiers import Group, answer_of
from hil.codecs.frame import Timed
from hil.control.pilot import Decision
from hil.robots.answers import Answers
from hil.safety.cycle import Reaction
from hil.session.loop import Loop, Wishes
from hil.session.round_trip import measured, too_slow
from hil.settings import default_settings
from tests.hil.bench import Beats, Bench

POSITIONS = {answer_of(k, Group.POSITIONS) for k in (1, 2, 3)}


def test_an_answer_is_that_of_the_oldest_open_question() -> None:
    answers = Answers()
    answers.asked(0, 0)
    assert answers.match([100], 1000, is_asked=True) == 100
    answers.asked(1, 2000)
    assert answers.match([], 3000, is_asked=True) is None
    assert answers.would_be_quiet(2, 0) and not answers.would_be_quiet(2, 1)  # one that has come since closes it
    assert answers.match([4050], 5000, is_asked=False) is None  # in the quiet cycle, 2 us late
    assert (answers.missing, answers.late) == (1, 1)
    assert not answers.would_be_quiet(3, 0)


def test_a_question_whose_answer_was_lost_is_given_up_after_one_quiet_cycle() -> None:
    answers = Answers()
    answers.asked(0, 0)
    assert answers.match([], 1000, is_asked=True) is None
    assert answers.would_be_quiet(1, 0)
    assert not answers.would_be_quiet(2, 0)
    assert (answers.missing, answers.late) == (1, 0)


def delayed(rate_hz: float, periods: float) -> tuple[float, list[str]]:
    """All answers come late from some moment on: ms until the arm gives way, and the faults."""
    settings = replace(default_settings(rate_hz=rate_hz), gravity=False)
    bench = Bench(settings=settings)
    pilot, period = bench.pilot(), settings.limits.period_ns
    late = [0]
    bench.faults.towards_host.append(
        lambda timed: [Timed(timed.time_ns + late[0], timed.frame)] if timed.frame.identifier in POSITIONS else [timed]
    )
    began, tripped = 0, 0
    count = 0

    def wishes() -> Wishes:
        nonlocal count, began
        count += 1
        if count == 60:
            late[0], began = int(periods * period), bench.bus.time_ns
        return Wishes(arm=not pilot.is_armed and count < 40, over=count > 60 + max(40, int(0.1 * rate_hz)))

    def watch(start_ns: int, decision: Decision) -> None:
        nonlocal tripped
        if not tripped and began and decision.outcome.reaction >= Reaction.COMPLY:
            tripped = start_ns

    summary = Loop(bench.wire, pilot, Beats(bench), watch=watch).run(wishes)
    bench.wire.close()
    return (tripped - began) * 1e-6 if tripped else -1.0, summary.faults


@pytest.mark.parametrize("rate_hz", [100.0, 500.0, 1000.0])
@pytest.mark.parametrize("periods", [0.6, 0.9, 0.975, 1.0, 1.1, 1.3, 1.49, 1.5, 2.05, 2.3, 2.9, 3.2, 4.4, 5.0])
def test_answers_that_keep_coming_late_stop_the_arm_whatever_their_delay(rate_hz: float, periods: float) -> None:
    tripped, faults = delayed(rate_hz, periods)
    assert 0 < tripped <= max(60.0, 12e3 / rate_hz), tripped
    assert faults and faults[0].startswith("positions_answered"), faults


@pytest.mark.parametrize("periods", [0.0, 0.1, 0.3])
def test_answers_within_the_time_that_is_waited_for_them_are_no_fault(periods: float) -> None:
    assert delayed(500.0, periods)[1] in ([], ["not_ended: the session has ended"])


def test_a_robot_that_answers_too_slowly_is_told_before_it_is_armed() -> None:
    bench = Bench()
    robot = bench.started()
    limits = bench.settings.limits
    times = measured(bench.wire, robot)
    assert times[-1] < 1e-3
    assert too_slow(times, limits) == ""
    bench.faults.towards_host.append(lambda timed: [Timed(timed.time_ns + 1_950_000, timed.frame)])
    assert "positions take 2.18 ms (median), and a cycle of 2 ms waits 1 ms" in too_slow(
        measured(bench.wire, robot), limits
    )
    bench.faults.towards_host.append(lambda timed: [])
    assert "do not come within 0.1 s" in too_slow(measured(bench.wire, robot), limits)
