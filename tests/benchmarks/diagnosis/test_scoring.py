"""Scores of the benchmark: on answers whose judgement is plain."""

from typing import Any

import pytest

from tests.benchmarks.diagnosis.scoring.calibration import calibration_error
from tests.benchmarks.diagnosis.scoring.confusion import answers, confusion_table
from tests.benchmarks.diagnosis.scoring.heat_map import map_cells, map_table
from tests.benchmarks.diagnosis.scoring.judge import judge, judge_again
from tests.benchmarks.diagnosis.scoring.summary import summary
from tests.benchmarks.diagnosis.scoring.targets import Band, Score, Target
from tests.benchmarks.diagnosis.scoring.utility import utility
from tests.benchmarks.diagnosis.scoring.wilson import Share

NOISE = {"q1": 1e-3, "q2": 2e-3}


def row_of(
    name: str, true: dict[str, Any], said: dict[str, Any], again: dict[str, Any] | None = None
) -> dict[str, Any]:
    row = judge(name, true, said)
    return row | judge_again(true, row, again)


def texts(rows: list[dict[str, Any]]) -> dict[str, str]:
    return {score.name: score.text for _, scores in summary(rows) for score in scores}


def truth(*effects: str, family: str = "S", **more: Any) -> dict[str, Any]:
    entry = {
        "family": family,
        "model": "arm",
        "effects": list(effects) or ["none"],
        "sites": ["joint1"] * len(effects),
        "kind": "",
        "parameters": [{"effect": e, "site": "joint1", "b[1]": 0.1} for e in effects],
        "noise_level": "mid",
        "enr_each": [3.0] * len(effects),
        "enr_left": None,
        "wanted_enr": None,
        "record_seconds": 10.0,
        "noise": NOISE,
        "true_model_rmse_heldout": NOISE,
    }
    return {**entry, **more}


def answer(*effects: str, verdict: str = "named", **more: Any) -> dict[str, Any]:
    estimate = {"b[1]": {"value": 0.11, "unit": "N.m.s/rad", "ci90": [0.09, 0.12]}}
    found = {
        "verdict": verdict,
        "effects": [{"id": e, "site": "joint1+joint2", "parameters": estimate} for e in effects],
        "confusable": [],
        "ranking": [{"effects": list(effects), "probability": 0.9}] if effects else [],
        "held_out": {
            "rmse_before": {name: 10 * value for name, value in NOISE.items()},
            "rmse_after": {name: 2 * value for name, value in NOISE.items()},
        },
        "seconds": 1.0,
    }
    return {**found, **more}


def test_right_name_counts_everywhere() -> None:
    row = judge("a", truth("viscous_friction"), answer("viscous_friction"))

    assert (row["exact"], row["exact_site"], row["class"], row["top3"]) == (True, True, True, True)
    assert row["parameters"] == [(pytest.approx(0.1), True)]
    assert row["over_true"] == pytest.approx(2.0)
    assert row["removed"] == pytest.approx(8 / 9)


def test_declared_group_counts_as_class_but_not_as_name() -> None:
    said = answer("coulomb_friction", confusable=[["coulomb_friction", "viscous_friction"]])

    row = judge("a", truth("viscous_friction"), said)

    assert (row["exact"], row["class"]) == (False, True)


def test_group_of_four_or_an_effect_too_many_is_wrong_at_class_level() -> None:
    wide = answer("hysteresis", confusable=[["hysteresis", "viscous_friction", "cogging", "tremor"]])

    assert not judge("a", truth("viscous_friction"), wide)["class"]
    assert not judge("a", truth("viscous_friction"), answer("viscous_friction", "tremor"))["class"]


def test_effect_at_the_wrong_joint_is_not_right_with_its_site() -> None:
    row = judge("a", truth("viscous_friction", sites=["muscle3"]), answer("viscous_friction"))

    assert (row["exact"], row["exact_site"]) == (True, False)


def test_effects_under_a_verdict_that_names_none_do_not_count() -> None:
    row = judge("a", truth("viscous_friction"), answer("viscous_friction", verdict="unknown"))

    assert (row["said"], row["exact"], row["verdict"]) == ([], False, "unknown")


def test_wrong_name_is_worth_less_than_none_and_a_class_less_than_the_name() -> None:
    true = truth("viscous_friction")
    answers = [
        answer("viscous_friction"),
        answer("coulomb_friction", confusable=[["coulomb_friction", "viscous_friction"]]),
        answer(verdict="cannot_tell"),
        answer(verdict="adequate"),
        answer("tremor"),
    ]

    assert [utility(judge("a", true, said)) for said in answers] == [1.0, 0.5, 0.3, 0.0, -0.5]


def test_run_that_failed_is_wrong_and_is_an_alarm() -> None:
    row = row_of("a", truth(family="N0"), {"failed": "no result within 300 s", "seconds": 300.0})
    scores = texts([row])

    assert scores["false alarm, nominal exactly (N0)"].startswith("1/1")
    assert scores["runs that failed or took too long"].startswith("1/1")


def test_failed_run_stays_in_the_share_of_what_the_tool_tried() -> None:
    rows = [
        row_of("a", truth("viscous_friction"), answer("viscous_friction")),
        row_of("b", truth("viscous_friction"), {"failed": "no result within 300 s", "seconds": 300.0}),
        row_of("c", truth("backlash"), answer("viscous_friction")),
    ]
    scores = texts(rows)

    assert scores["name, where the model has a place for the effect"].startswith("1/2")


def test_scores_of_a_family_count_its_own_cases_only() -> None:
    rows = [
        row_of("a", truth("viscous_friction"), answer("viscous_friction")),
        row_of("b", truth("viscous_friction"), answer("cogging")),
        row_of("c", truth("viscous_friction", enr_each=[0.5]), answer("cogging")),
        row_of("d", truth(family="N0"), answer(verdict="adequate")),
        row_of("e", truth("unknown", family="O", enr_left=2.0), answer(verdict="unknown")),
        row_of("f", truth("viscous_friction", wanted_enr=5.0, enr_each=[5.2]), answer("cogging")),
    ]
    scores = texts(rows)

    assert scores["name"].startswith("1/2")
    assert scores["false alarm, nominal exactly (N0)"].startswith("0/1")
    assert scores["found (unknown, or its law named)"].startswith("1/1")
    assert scores["parameter error, median"].startswith("10.0 %")
    assert "| 5 | 0/1" in map_table(map_cells(rows))


def test_answer_left_open_is_resolved_by_the_right_name_only() -> None:
    true, unsure = truth("viscous_friction"), answer(verdict="cannot_tell")
    seconds = [answer("viscous_friction"), answer("viscous_friction", verdict="ambiguous"), answer("tremor"), None]

    rows = [row_of(str(k), true, unsure, again) for k, again in enumerate(seconds)]
    sure = row_of("4", true, answer("viscous_friction"), answer("viscous_friction"))

    assert [row["resolved"] for row in rows] == [True, False, False, False]
    assert texts([*rows, sure])["answers left open that one recommended run resolves"].startswith("1/4")


def test_run_that_the_diagnosis_gives_no_chance_is_not_counted_among_its_recommendations() -> None:
    true = truth("leak")
    hopeless = answer("leak", verdict="ambiguous", next_experiment={"probability_to_separate": 0.5})
    hopeful = answer("leak", verdict="ambiguous", next_experiment={"probability_to_separate": 0.98})

    found = texts([row_of("a", true, hopeless, hopeless), row_of("b", true, hopeful, answer("leak"))])

    assert found["answers left open that one recommended run resolves"].startswith("1/1")
    assert found["answers left open of which it says that no run tells them apart"].startswith("1/2")
    assert found["all answers left open: resolved by one run"].startswith("1/2")


def test_nothing_missing_is_resolved_by_adequate() -> None:
    row = row_of("a", truth(family="N1"), answer(verdict="cannot_tell"), answer(verdict="adequate"))

    assert row["resolved"]


def test_effect_of_no_library_is_resolved_by_unknown_and_by_nothing_else() -> None:
    outside, unsure = truth("unknown", family="O"), answer("tremor", verdict="ambiguous")
    seconds = [answer(verdict="unknown"), answer("tremor"), answer(verdict="adequate")]

    rows = [row_of(str(k), outside, unsure, again) for k, again in enumerate(seconds)]

    assert [row["resolved"] for row in rows] == [True, False, False]


def test_effect_of_no_slot_is_found_by_the_name_of_its_law_and_by_no_other() -> None:
    outside = truth("unknown", family="O", kind="cubic_spring", enr_left=2.0, parameters=[])
    rows = [row_of(name, outside, answer(name)) for name in ("cubic_stiffness", "tremor")]

    assert texts(rows)["found (unknown, or its law named)"].startswith("1/2")
    assert texts(rows)["taken for another effect"].startswith("1/2")
    assert [utility(row) for row in rows] == [1.0, -0.5]


def test_confident_answers_that_are_half_right_are_badly_calibrated() -> None:
    true, said = truth("viscous_friction"), answer("viscous_friction")
    rows = [row_of(str(k), true, said if k % 2 else answer("tremor")) for k in range(40)]

    assert calibration_error(rows) == pytest.approx(0.9 - 0.5)


def test_probability_left_for_effects_of_no_library_is_right_when_they_are_as_frequent() -> None:
    said = answer("tremor")
    rows = [row_of(str(k), truth("tremor"), said) for k in range(18)]
    rows += [row_of(f"outside {k}", truth("unknown", family="O", kind="magnet", enr_left=2.0), said) for k in range(2)]

    assert calibration_error(rows) == pytest.approx(0.0)
    assert texts(rows)["the same without effects of no library"] == "-"
    assert texts(rows + rows)["the same without effects of no library"] == "0.1"


def test_confusion_counts_every_case_once_under_its_truth() -> None:
    rows = [
        row_of("a", truth("backlash"), answer("hysteresis")),
        row_of("b", truth("backlash"), answer("backlash", "tremor")),
        row_of("c", truth("backlash", enr_each=[0.3]), answer("tremor")),
        row_of("d", truth(family="N2"), {"failed": "no result within 300 s"}),
        row_of("e", truth("unknown", family="O", kind="overflow", enr_left=0.5), answer(verdict="unknown")),
    ]

    found = answers(rows, 1.5)

    assert found == {
        "backlash": {"hysteresis": 1, "several": 1},
        "(nothing)": {"failed": 1},
        "(outside: overflow)": {"unknown": 1},
    }
    assert "| backlash | hysteresis 1, several 1 | 2 |" in confusion_table(found)


@pytest.mark.parametrize(
    ("target", "hits", "n", "reached"),
    [
        (Target(0.85, 0.93), 10, 10, "aim met, not certain"),
        (Target(0.85, 0.93), 1000, 1000, "aim met"),
        (Target(0.85, 0.93), 880, 1000, "met"),
        (Target(0.85, 0.93), 5, 1000, "missed"),
        (Target(0.05, 0.03, less=True), 1, 10, "missed, not certain"),
        (Target(0.05, 0.03, less=True), 0, 1000, "aim met"),
        (Band((0.8, 0.97), (0.87, 0.93)), 900, 1000, "aim met"),
        (Band((0.8, 0.97), (0.87, 0.93)), 1000, 1000, "missed"),
        (Band((0.8, 0.97), (0.87, 0.93)), 3, 3, "missed, not certain"),
    ],
)
def test_score_says_whether_its_target_is_reached_and_whether_that_is_certain(
    target: Target | Band, hits: int, n: int, reached: str
) -> None:
    assert Score.share("any", Share(hits, n), target).reached == reached


@pytest.mark.parametrize(
    ("hits", "n", "low", "high"), [(10, 20, 0.299, 0.701), (0, 20, 0.0, 0.161), (81, 263, 0.255, 0.366)]
)
def test_interval_of_a_share_is_wilsons(hits: int, n: int, low: float, high: float) -> None:
    """Third row: Newcombe, Statistics in Medicine 17 (1998), table I, method 3."""
    assert Share(hits, n).interval == (pytest.approx(low, abs=1e-3), pytest.approx(high, abs=1e-3))


def test_interval_holds_its_share_for_any_counts() -> None:
    for n in range(1, 200):
        for hits in {0, 1, n - 1, n}:
            low, high = Share(hits, n).interval
            assert 0.0 <= low <= hits / n <= high <= 1.0
