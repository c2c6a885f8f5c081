"""One definition of each number: ten answers of real runs say nothing twice and nothing that contradicts itself."""

import json
import re
from pathlib import Path
from typing import Any

import pytest

from orchestrator.report.answer import answer_of
from orchestrator.report.answer.drawing import witness_svg
from orchestrator.report.answer.markup import answer_html
from orchestrator.report.answer.witness import Witness
from orchestrator.report.page import held_out_table
from orchestrator.verdicts.result import HeldOut

ANSWERS = Path(__file__).parents[1] / "answers"
CASES = sorted(path.stem for path in ANSWERS.glob("*.json"))


def document_of(case: str) -> dict[str, Any]:
    return dict(json.loads((ANSWERS / f"{case}.json").read_text()))


def test_there_are_ten_cases() -> None:
    assert len(CASES) >= 10


@pytest.mark.parametrize("case", CASES)
def test_what_the_effect_removes_has_one_figure_that_of_held_out_trials(case: str) -> None:
    document = document_of(case)
    answer = answer_of(document)
    page = re.sub(r"<svg.*?</svg>|<[^>]+>", " ", answer_html(answer, document), flags=re.S)

    assert page.count("of the avoidable error") == (1 if document["effects"] and "avoidable" in answer.detail else 0)
    assert not re.search(r"probabilit", page)
    named = next((rival for rival in answer.rivals if rival.named), None)
    assert named is None or "%" not in named.reason


@pytest.mark.parametrize(("removed", "words"), [(0.9837, "98 %"), (0.9999, "more than 99 %"), (1.0, "100 %")])
def test_a_report_says_the_removed_share_twice_and_in_the_same_words(removed: float, words: str) -> None:
    """The table behind the answer spoke of a reducible error, and rounded 99.99 % to 100 %."""
    document = document_of("arm")
    held_out = document["held_out"] | {"reducible_removed": removed}
    (table,) = held_out_table(HeldOut(**held_out), dict.fromkeys(held_out["noise_floor"], "rad"))

    assert f"{words} of the avoidable error" in table.caption
    assert f": {words} of the avoidable error." in answer_of(document | {"held_out": held_out}).detail


@pytest.mark.parametrize("case", CASES)
def test_the_named_set_stands_first_and_once_and_no_rival_has_better_odds(case: str) -> None:
    document = document_of(case)
    answer = answer_of(document)

    assert [rival.named for rival in answer.rivals[1:]] == [False] * len(answer.rivals[1:])
    assert len({rival.name for rival in answer.rivals}) == len(answer.rivals)
    if document["verdict"] == "named":
        assert answer.rivals[0].named
        assert all(rival.odds != "even" for rival in answer.rivals[1:])


@pytest.mark.parametrize("case", CASES)
def test_a_named_set_has_the_largest_probability_of_the_ranking(case: str) -> None:
    document = document_of(case)
    if document["verdict"] != "named":
        pytest.skip("names nothing")
    named = sorted(effect["id"] for effect in document["effects"])

    best = max(document["ranking"], key=lambda row: row["probability"])
    assert sorted(best["effects"]) == named
    total = sum(row["probability"] for row in document["ranking"]) + document.get("none_of_these", 0.0)
    assert total <= 1.0 + 1e-6


@pytest.mark.parametrize("case", CASES)
def test_much_that_is_left_is_said(case: str) -> None:
    document = document_of(case)
    answer = answer_of(document)
    bars = {bar.kind: bar.value for bar in answer.bars}

    if document["effects"] and bars.get("better", 0.0) > 2.0:
        assert answer.caution


@pytest.mark.parametrize("case", CASES)
def test_no_experiment_is_proposed_where_none_helps(case: str) -> None:
    said = answer_of(document_of(case)).next_step

    assert not ("tell" in said and "no experiment" in said.lower())


def test_no_answer_names_a_place_of_the_machine_it_ran_on() -> None:
    for case in CASES:
        assert not re.search(r'"(?:/[\w.-]+){2,}', (ANSWERS / f"{case}.json").read_text())


@pytest.mark.parametrize("case", CASES)
def test_no_row_that_fits_closer_is_given_odds_against_it_and_no_reason_speaks_of_nats(case: str) -> None:
    rivals = answer_of(document_of(case)).rivals

    assert all(not rival.odds for rival in rivals if rival.reason.startswith("fits closer"))
    assert not any("nats" in rival.reason or "BIC" in rival.reason for rival in rivals)


def test_a_wrong_value_is_corrected_and_not_added() -> None:
    document = json.loads((ANSWERS / "thermal.json").read_text())
    wrong = {
        "id": "parameter_error",
        "site": "C",
        "parameters": {"share": {"value": 0.05, "unit": "1", "ci90": [0.04, 0.06]}},
    }
    answer = answer_of(document | {"verdict": "named", "effects": [wrong]})
    assert "Correcting it takes the error" in answer.detail
    assert answer.added("House_1", 3.0, 1.0, None).detail.count("the error on held-out trials") == 1


def test_the_next_step_for_a_record_that_is_wrong_is_to_mend_it() -> None:
    """It said to record more motion, below a sentence that said what is wrong with the record there is."""
    found = {"proposal": "multiply theta by 0.0174533", "strong": True}
    answer = answer_of(document_of("cannot_tell") | {"data_checks": [found], "next_experiment": None})

    assert "first multiply theta by 0.0174533." in answer.headline
    assert answer.next_step == "Mend the record (multiply theta by 0.0174533), and diagnose again."


@pytest.mark.parametrize(("after", "said"), [(0.2, True), (0.9, False)])
def test_an_error_far_below_the_noise_floor_is_explained(after: float, said: bool) -> None:
    """A command of a controller counted as noise, and what was found took the error to 0.0005 times the noise."""
    document = document_of("arm")
    floor = document["held_out"]["noise_floor"]
    held_out = document["held_out"] | {"rmse_after": {name: after * value for name, value in floor.items()}}
    caution = answer_of(document | {"held_out": held_out}).caution

    assert ("The noise floor is too high here" in caution) == said


@pytest.mark.parametrize(("unit", "size"), [("1/s", 7.5e-5), ("1", 3e-4), ("degC", 2e5), ("N.m", 7.5e-5)])
def test_numbers_beside_an_axis_have_room_there_and_their_power_of_ten_stands_in_its_title(
    unit: str, size: float
) -> None:
    steps = (-1.0, 0.0, 1.0)
    picture = witness_svg(Witness("soc", unit, "I", "A", steps, tuple(size * x for x in steps), (), ()))

    beside = [float(text) for text in re.findall(r'text-anchor="end">([^<]+)<', picture)]
    assert max(len(f"{value:g}") for value in beside) <= 5
    title = re.search(r'class="a-title"[^>]*>([^<]+)<', picture)
    assert (
        title
        and title[1]
        == {
            "1/s": "Soc (10⁻⁶/s)",
            "1": "Soc (10⁻⁶)",
            "degC": "Soc (10³ degC)",
            "N.m": "Soc (µN·m)",
        }[unit]
    )
