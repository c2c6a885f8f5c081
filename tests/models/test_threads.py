"""Threads shared by nested loops: order, errors, and who does what."""

from threading import Barrier, BrokenBarrierError, get_ident

import pytest

from orchestrator.models.threads import Threads, on_idle_threads, threads


def test_results_come_in_the_order_of_the_items_for_any_number_of_workers() -> None:
    items = list(range(20))
    for count in (1, 2, 5):
        assert Threads(count).do(lambda k: k * k, items) == [k * k for k in items]
    assert Threads(3).do(abs, []) == []


def test_one_worker_does_all_in_its_own_thread() -> None:
    assert set(Threads(1).do(lambda _: get_ident(), range(5))) == {get_ident()}


def test_all_workers_work_at_the_same_time() -> None:
    together = Barrier(3, timeout=60)
    assert Threads(3).do(lambda _: together.wait() >= 0, range(3)) == [True] * 3


def test_parts_of_the_last_item_are_done_by_whoever_waits_for_it() -> None:
    def met(barrier: Barrier) -> bool:
        try:
            return barrier.wait() >= 0
        except BrokenBarrierError:  # the other worker is not idle yet
            return False

    def long_fit(tries: int) -> bool:
        # Nobody gets past a barrier alone: sooner or later both workers are at the two parts.
        return any(all(on_idle_threads(met, [Barrier(2, timeout=1)] * 2)) for _ in range(tries))

    with threads(2) as workers:
        assert workers.do(long_fit, [0, 60]) == [False, True]
        assert workers.do(long_fit, [60, 0]) == [True, False]
        assert long_fit(60)


def test_a_thread_without_workers_does_its_parts_alone() -> None:
    assert set(on_idle_threads(lambda _: get_ident(), range(3))) == {get_ident()}


def test_the_error_of_the_first_item_that_fails_is_raised_when_all_are_done() -> None:
    done = []

    def fails(k: int) -> None:
        done.append(k)
        if k % 2:
            raise ValueError(k)

    for count in (1, 3):
        done.clear()
        with pytest.raises(ValueError, match="1"):
            Threads(count).do(fails, range(6))
        assert sorted(done) == list(range(6))
    assert Threads(2).do(abs, [-1]) == [1]
