"""The verdict's figures."""

import pytest

from orchestrator.diagnosis.verdict import decide, reducible_removed


@pytest.mark.parametrize(
    ("before", "after", "named", "verdict"),
    [
        (1.0, 1.0, 0, "adequate"),
        (1.4, 1.4, 0, "adequate"),
        (7.0, 7.0, 0, "unknown"),  # far from the floor and nothing in the library helps
        (16.0, 1.2, 1, "named"),
        (9000.0, 1400.0, 2, "named"),  # most of the error is gone, though the floor is far
        (25.0, 18.0, 1, "unknown"),  # an effect that explains a third is not the missing one
    ],
)
def test_verdict_follows_from_held_out_errors(before: float, after: float, named: int, verdict: str) -> None:
    assert decide(before, after, named) == verdict


def test_removing_everything_above_the_floor_counts_as_one() -> None:
    assert reducible_removed(16.0, 1.0) == pytest.approx(1.0)
    assert reducible_removed(16.0, 16.0) == 0.0
