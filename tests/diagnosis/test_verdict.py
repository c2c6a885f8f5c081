"""The verdict's figures."""

import pytest

from orchestrator.diagnosis.verdict import decide, reducible_removed


@pytest.mark.parametrize(
    ("before", "after", "named", "structured", "verdict"),
    [
        (1.0, 1.0, 0, False, "adequate"),
        (1.4, 1.4, 0, False, "adequate"),  # whoever says that a floor is right says that this is noise
        (1.4, 1.4, 0, True, "unknown"),  # little, but not noise, and nothing in the library helps
        (16.0, 1.2, 1, False, "named"),
        (9000.0, 1400.0, 2, True, "named"),  # most of the error is gone, though the floor is far
        (25.0, 18.0, 1, True, "unknown"),  # an effect that explains a third is not the missing one
    ],
)
def test_verdict_follows_from_held_out_errors_and_what_is_left(
    before: float, after: float, named: int, structured: bool, verdict: str
) -> None:
    assert decide(before, after, named, structured=structured) == verdict


def test_rivals_make_a_named_effect_ambiguous_and_blind_sites_withhold_adequate() -> None:
    assert decide(16.0, 1.0, 1, structured=False, ambiguous=True) == "ambiguous"
    assert decide(1.0, 1.0, 0, structured=False, blind=["muscle4"]) == "cannot_tell"
    assert decide(16.0, 1.0, 1, structured=False, blind=["muscle4"]) == "named"


def test_removing_everything_above_the_floor_counts_as_one() -> None:
    assert reducible_removed(16.0, 1.0) == pytest.approx(1.0)
    assert reducible_removed(16.0, 16.0) == 0.0
