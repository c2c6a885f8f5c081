"""The first screen shows every proposed formula over the force that it explains."""

from typing import Any

from orchestrator.report.answer.answer import answer_of
from orchestrator.report.answer.markup import answer_html


def law(formula: str, slope: float) -> dict[str, Any]:
    x = [-1.0, 0.0, 1.0]
    curve = {
        "balance": "x",
        "unit": "N",
        "coordinate": "v",
        "coordinate_unit": "m/s",
        "x": x,
        "force": [-slope * each for each in x],
        "band": [0.1] * 3,
        "law": [-slope * each for each in x],
    }
    return {
        "formula": formula,
        "sentence": "drag",
        "site": "x",
        "parameters": {"k": {"value": slope, "unit": "N.s/m", "ci90": [slope, slope]}},
        "held_out_before": {"x": 1.0},
        "held_out_after": {"x": 0.1},
        "held_out_units": {"x": "mm"},
        "separated_by": "faster motion separates them",
        "curve": curve,
    }


def page(laws: list[dict[str, Any]]) -> str:
    document = {
        "schema": "misfit.diagnosis/1",
        "verdict": "unknown",
        "effects": [],
        "noise_floor": {"x": 0.1},
        "held_out": {
            "rmse_before": {"x": 1.0},
            "rmse_after": {"x": 1.0},
            "noise_floor": {"x": 0.1},
            "reducible_removed": 0.0,
        },
        "laws": laws,
    }
    return answer_html(answer_of(document), document)


def test_each_proposed_formula_has_its_curve_with_the_law_through_it() -> None:
    found = page([law("-k*v<", 2.0), law("-k*v^3", 3.0)])
    assert found.count("with the fitted law as a line") == 2
    assert "-k*v&lt;" in found
    assert "x 1 -&gt; 0.1 mm" in found
    assert "-k*v^3" in found
    assert "cannot tell it from -k*v^3" in found


def test_a_page_without_proposals_says_nothing_of_formulas() -> None:
    assert "formula" not in page([])
