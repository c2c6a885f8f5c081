"""The picture of the falling error tells the ledger, and nothing else."""

import xml.etree.ElementTree as ET
from dataclasses import replace

import pytest
from view_builders import version

from orchestrator.studio.views.steps_drawing import STYLE, decades, drawing, height_of, steps_of, summary
from orchestrator.verdicts.result import NamedEffect

FRICTION, LOAD = NamedEffect("coulomb_friction", "joint1", {}), NamedEffect("payload", "wrist", {})
LEDGER = [version(0, 41.0), version(1, 12.0, effects=(FRICTION,)), version(2, 1.05, effects=(FRICTION, LOAD))]


def bars(picture: str) -> list[ET.Element]:
    return [each for each in ET.fromstring(picture).iter() if each.tag.endswith("rect")]


def test_a_step_names_what_was_added_to_the_one_before() -> None:
    assert [step.added for step in steps_of(LEDGER)] == ["as given", "Coulomb friction at joint1", "payload at wrist"]


def test_the_summary_tells_first_and_last_error() -> None:
    text = "The error on held-out trials fell from 41.0 to 1.05 times the noise floor in 2 steps."
    assert summary(steps_of(LEDGER)) == text
    assert "learning trials" in summary(steps_of([version(0, None)]))
    assert "went from" in summary(steps_of(LEDGER[::-1]))


def test_equal_ratios_are_equal_heights() -> None:
    heights = [height_of(value, (-1, 2)) for value in (0.1, 1.0, 10.0, 100.0)]

    assert heights[0] == 0.0
    assert {round(b - a, 9) for a, b in zip(heights, heights[1:], strict=False)} == {round(heights[3] / 3, 9)}


def test_bars_are_as_high_as_their_errors() -> None:
    steps = steps_of(LEDGER)
    tall = [float(bar.attrib["height"]) for bar in bars(drawing(steps))]
    expected = [height_of(value, decades(steps)) for step in steps for value in (step.learning, step.held_out or 0)]

    assert tall == pytest.approx(expected, abs=0.06)


def test_a_new_bar_begins_at_the_height_of_the_version_before_and_old_ones_rest() -> None:
    steps = steps_of(LEDGER)
    drawn = bars(drawing(steps, already_shown=2))
    tall = [float(bar.attrib["height"]) for bar in drawn]

    assert ["class" in bar.attrib for bar in drawn] == [False] * 4 + [True] * 2
    start = float(drawn[5].attrib["style"].split("--from: ")[1].split(";")[0])
    # Heights are written to a tenth of a pixel, and the lower one is scaled up.
    assert start * tall[5] == pytest.approx(tall[3], abs=0.05 + 0.05 * start)
    assert not any("class" in bar.attrib for bar in bars(drawing(steps)))


def test_who_prefers_less_motion_sees_none() -> None:
    assert "prefers-reduced-motion: reduce" in STYLE and "animation: none" in STYLE


@pytest.mark.parametrize("error", [float("inf"), 0.0])
def test_an_error_without_place_on_a_log_axis_is_written_instead_of_drawn(error: float) -> None:
    steps = steps_of([version(0, error), version(1, 2.0)])

    assert len(bars(drawing(steps))) == 2
    assert decades(steps) == (-1, 1)


def test_names_of_users_are_text_and_not_markup() -> None:
    entry = replace(LEDGER[0], effects=(NamedEffect("<b>", "&", {}),), version=1)

    assert "&lt;b&gt; at &amp;" in drawing(steps_of([entry]))


def test_an_empty_ledger_draws_an_axis_and_says_so() -> None:
    assert bars(drawing(())) == []
    assert summary(()) == "No version has been recorded yet."


def test_numbers_of_two_bars_beside_each_other_do_not_touch() -> None:
    """`0.776` and `0.767` ran into each other; a letter takes 8 of the picture's units at most."""
    assert all(float(bar.attrib["width"]) >= 5 * 8 for bar in bars(drawing(steps_of(LEDGER))))
