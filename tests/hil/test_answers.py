"""Old answers do not pass as new ones: at most one, and it is found out by the next; what delays them is told."""

from dataclasses import replace

import pytest

from hil.codecs.barrett.identifiers import Group, Node, answer_of
from hil.codecs.frame import Frame, Timed
from hil.control.pilot import Decision
from hil.robots.answers import Answers
from hil.safety.cycle import Reaction
from hil.session.loop import Loop, Wishes
from hil.session.round_trip import measured, too_slow
from hil.settings import default_settings
from tests.hil.bench import Bench, ExactTimer

POSITIONS = {answer_of(k, Group.POSITIONS) for k in (1, 2, 3)}


def matched(answers: Answers, cycle: int, times_ns: list[int], *, is_asked: bool = True, data: str = "") -> int | None:
    """A cycle of 2 us that waits 1 us for the answers that come at these times; `data` has a letter for each."""
    start_ns = 2000 * cycle
    for k, at in enumerate(times_ns):
        answers.hear(Timed(at, Frame(1, data[k : k + 1].encode())), start_ns, start_ns + 1000)
    return answers.match(cycle, start_ns, start_ns + 1000, is_asked=is_asked)


def test_an_answer_is_that_of_the_oldest_open_question() -> None:
    answers = Answers()
    assert matched(answers, 0, [100]) == 100
    assert matched(answers, 1, []) is None
    assert answers.would_be_quiet(2, 0) and not answers.would_be_quiet(2, 1)  # one that has come since closes it
    assert matched(answers, 2, [4050], is_asked=False) is None  # in the quiet cycle, 2 us late
    assert (answers.missing, answers.late) == (1, 1)
    assert not answers.would_be_quiet(3, 0)


def test_a_question_whose_answer_was_lost_is_given_up_after_one_quiet_cycle() -> None:
    answers = Answers()
    assert matched(answers, 0, []) is None
    assert answers.would_be_quiet(1, 0)
    assert not answers.would_be_quiet(2, 0)
    assert (answers.missing, answers.late) == (1, 0)


def test_after_a_question_that_was_given_up_an_answer_is_doubtful_until_the_next_one_comes_in_time() -> None:
    answers = Answers()
    assert matched(answers, 0, []) is None
    assert matched(answers, 2, [4100]) == 100  # 4100 ns after the question before it, perhaps
    assert answers.is_doubtful
    assert matched(answers, 3, [6100]) == 100
    assert not answers.is_doubtful


def test_a_doubtful_answer_without_one_after_it_leaves_two_on_their_way() -> None:
    answers = Answers()
    matched(answers, 0, [])
    matched(answers, 2, [4100])
    assert matched(answers, 3, []) is None
    assert answers.would_be_quiet(4, 0)
    matched(answers, 4, [8050], is_asked=False)  # that of the question at 4000
    assert answers.would_be_quiet(4, 0)
    matched(answers, 4, [8060], is_asked=False)
    assert not answers.would_be_quiet(4, 0)


def test_a_second_answer_in_time_that_says_something_else_contradicts_the_first() -> None:
    answers = Answers()
    for data, times_ns, is_contradicted in (
        ("aa", [1, 2], False),
        ("ab", [1, 2], True),
        ("ab", [1, 1001], False),
        ("a", [1], False),
    ):
        assert matched(answers, 0, times_ns, data=data) == 1
        assert (answers.data, answers.is_contradicted) == (b"a", is_contradicted)


def test_one_lost_answer_is_made_good_by_the_next_two_and_stops_nothing() -> None:
    reactions, owed = [], []
    bench = Bench()
    pilot = bench.pilot()

    def lose(cycle: int) -> None:
        if cycle == 60:
            bench.faults.towards_host.append(_once(answer_of(2, Group.POSITIONS)))

    decide = pilot.decide

    def decided(given):  # type: ignore[no-untyped-def]
        decision = decide(given)
        reactions.append(decision.outcome.reaction)
        owed.append(max(pilot.state.motion.owed, default=0) if pilot.state is not None else 0)
        return decision

    pilot.decide = decided  # type: ignore[method-assign]
    assert not bench.run(pilot, 100, lose).faults
    assert max(reactions[50:95]) is Reaction.REDUCE
    assert [time for time in owed if time] == [6_000_000] and owed[-1] == 0


def _once(identifier: int):  # type: ignore[no-untyped-def]
    left = [1]

    def lose(timed: Timed) -> list[Timed]:
        if timed.frame.identifier != identifier or not left:
            return [timed]
        left.clear()
        return []

    return lose


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

    summary = Loop(bench.wire, pilot, ExactTimer(bench), watch=watch).run(wishes)
    bench.wire.close()
    return (tripped - began) * 1e-6 if tripped else -1.0, summary.faults


@pytest.mark.parametrize("rate_hz", [100.0, 500.0, 1000.0])
@pytest.mark.parametrize("periods", [0.6, 0.9, 0.975, 1.0, 1.1, 1.3, 1.49, 1.5, 2.05, 2.3, 2.9, 3.2, 4.4, 5.0])
def test_answers_that_keep_coming_late_stop_the_arm_whatever_their_delay(rate_hz: float, periods: float) -> None:
    tripped, faults = delayed(rate_hz, periods)
    # One position that is too old may be believed, until the question after it stays without an answer.
    assert 0 < tripped <= max(7.0, 4.5e3 / rate_hz), tripped
    assert faults and faults[0].startswith("positions_answered"), faults


@pytest.mark.parametrize(("rate_hz", "steps"), [(100.0, 5), (500.0, 25)])
def test_forces_that_grow_old_step_by_step_stop_the_arm_before_their_limit_of_age(rate_hz: float, steps: int) -> None:
    # Two periods more every tenth answer: each of them comes at a time at which one is awaited.
    settings = replace(default_settings(rate_hz=rate_hz), gravity=False)
    bench, period, late, count = Bench(settings=settings), settings.limits.period_ns, [0], [0]
    pilot = bench.pilot()

    def older(timed: Timed) -> list[Timed]:
        if timed.frame.identifier != answer_of(Node.FORCE_SENSOR, Group.FORCE):
            return [timed]
        count[0] += 1
        late[0] += 2 * period * (count[0] > 60 and count[0] % 10 == 0 and pilot.stopped is None)
        return [Timed(timed.time_ns + late[0], timed.frame)]

    bench.faults.towards_host.append(older)
    faults = bench.run(pilot, 60 + 30 * steps).faults
    assert faults and faults[0].startswith("force_bounded: the force sensor has not answered"), faults
    # Nobody believes a force that is older than its limit, and what is noticed names no more than one step beyond it.
    assert late[0] <= settings.limits.force_missing_s * 1e9 + 2 * period


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
