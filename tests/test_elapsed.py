"""How far long work has gone, and about how long it still takes, by a clock of the test."""

import pytest
from rich.console import Console
from rich.progress import Progress

from orchestrator.elapsed import Elapsed, columns


class Work:
    """Work that says something at times in s."""

    def __init__(self) -> None:
        self.now = 0.0
        self.gone = Elapsed(lambda: self.now)

    def says(self, seconds: float, message: str) -> "Work":
        self.now = seconds
        self.gone.said(message)
        return self


def test_counted_work_is_as_far_as_it_says() -> None:
    work = Work().says(0.0, "checking 1 of 40: a passed").says(20.0, "checking 20 of 40: b passed")
    assert work.gone.words == "50 % of this step, about 20 s left of it"
    work.says(39.0, "checking 40 of 40: c passed")
    assert work.gone.share is not None and work.gone.share < 1.0


def test_what_is_counted_anew_begins_at_its_own_beginning() -> None:
    work = Work().says(0.0, "trials: 1 of 2").says(10.0, "trials: 2 of 2").says(20.0, "draws: 1 of 4")
    assert work.gone.share == pytest.approx(0.25)
    work.says(30.0, "draws: 4 of 4").says(31.0, "draws: 1 of 4")
    assert work.gone.share == pytest.approx(0.25)


def test_a_search_that_counts_nothing_promises_no_time() -> None:
    work = (
        Work()
        .says(0.0, "reading x")
        .says(10.0, "75 candidates at 11 places")
        .says(70.0, "best so far: nothing missing")
    )
    assert work.gone.share is None and work.gone.words == ""


@pytest.mark.parametrize(
    ("seconds", "words"), [(2.0, ""), (30.0, ", about 30 s left of it"), (300.0, ", about 5 min left of it")]
)
def test_times_are_rounded_and_told_only_after_a_while(seconds: float, words: str) -> None:
    assert Work().says(0.0, "case 1 of 10").says(seconds, "case 5 of 10").gone.words == f"50 % of this step{words}"


def test_a_line_of_80_columns_keeps_its_numbers_whole_and_shortens_what_is_done() -> None:
    now = 0.0
    gone = Elapsed(lambda: now)
    gone.said("counted: 1 of 20")
    now = 9.0
    gone.said("counted: 19 of 20")
    bar = Progress(*columns(gone), console=Console(width=80, force_terminal=True))
    bar.add_task("refitting " + "viscous_friction at joint1 + " * 4)
    with bar.console.capture() as captured:
        bar.console.print(bar)

    lines = [line for line in captured.get().splitlines() if line.strip()]
    assert len(lines) == 1, lines
    assert "95 % of this step, about 1 s left of it" in lines[0] and "…" in lines[0]
