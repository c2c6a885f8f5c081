"""Scores of the benchmark: on answers whose judgement is plain."""

from typing import Any

import pytest

from tests.benchmarks.diagnosis.scoring.heat_map import map_cells, map_table
from tests.benchmarks.diagnosis.scoring.judge import judge
from tests.benchmarks.diagnosis.scoring.summary import summary
from tests.benchmarks.diagnosis.scoring.utility import utility
from tests.benchmarks.diagnosis.scoring.wilson import Share

NOISE = {"q1": 1e-3, "q2": 2e-3}


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
    row = judge("a", truth(family="N0"), {"failed": "no result within 300 s", "seconds": 300.0})
    scores = {score: found for score, _, found in summary([row])}

    assert scores["false alarm, nominal exactly (N0)"].startswith("1/1")
    assert scores["runs that failed"].startswith("1/1")


def test_failed_run_stays_in_the_share_of_what_the_tool_tried() -> None:
    rows = [
        judge("a", truth("viscous_friction"), answer("viscous_friction")),
        judge("b", truth("viscous_friction"), {"failed": "no result within 300 s", "seconds": 300.0}),
        judge("c", truth("backlash"), answer("viscous_friction")),
    ]
    scores = {score: found for score, _, found in summary(rows)}

    assert scores["single: name, where the tool tried the effect at all"].startswith("1/2")


def test_scores_of_a_family_count_its_own_cases_only() -> None:
    rows = [
        judge("a", truth("viscous_friction"), answer("viscous_friction")),
        judge("b", truth("viscous_friction"), answer("cogging")),
        judge("c", truth("viscous_friction", enr_each=[0.5]), answer("cogging")),
        judge("d", truth(family="N0"), answer(verdict="adequate")),
        judge("e", truth("unknown", family="O"), answer(verdict="unknown")),
        judge("f", truth("viscous_friction", wanted_enr=5.0, enr_each=[5.2]), answer("cogging")),
    ]
    scores = {score: found for score, _, found in summary(rows)}

    assert scores["single: name"].startswith("1/2")
    assert scores["false alarm, nominal exactly (N0)"].startswith("0/1")
    assert scores["outside the library: found"].startswith("1/1")
    assert scores["parameter error, median"] == "10.0 %"
    assert "| 5 | 0/1" in map_table(map_cells(rows))


@pytest.mark.parametrize(
    ("hits", "n", "low", "high"), [(10, 20, 0.299, 0.701), (0, 20, 0.0, 0.161), (81, 263, 0.255, 0.366)]
)
def test_interval_of_a_share_is_wilsons(hits: int, n: int, low: float, high: float) -> None:
    """Third row: Newcombe, Statistics in Medicine 17 (1998), table I, method 3."""
    assert Share(hits, n).interval == (pytest.approx(low, abs=1e-3), pytest.approx(high, abs=1e-3))
