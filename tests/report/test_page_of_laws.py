"""The first screen shows every proposed formula over the force that it explains."""

from typing import Any

from orchestrator.report.answer.answer import answer_of
from orchestrator.report.answer.formulas import formula_lines
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


def test_a_formula_in_place_of_a_named_effect_says_so_and_how_to_add_it() -> None:
    document = {
        "verdict": "named",
        "model": "Plant",
        "model_file": "my plant.mo:Plant",
        "effects": [{"id": "viscous_friction", "site": "x", "parameters": {}}],
        "held_out": {"noise_floor": {"x": 0.05}, "rmse_before": {"x": 1.0}, "rmse_after": {"x": 0.4}},
        "laws": [law("-k*v^3", 3.0) | {"card": "laws/cubic.toml", "seen": {"v": [-1.0, 2.0]}, "coordinates": ["v"], "coordinate_units": ["m/s"]}],
    }  # fmt: skip
    found = " ".join(formula_lines(document))
    assert "explains more than viscous friction at x, and takes its place" in found
    assert "to 2.00 times the noise (x 1 -> 0.1 mm); what the library names, to 8.00" in found
    assert "Seen for v from -1 to 2 m/s; beyond that it is an extrapolation" in found
    assert (
        answer_of(document).next_step == "Add the formula below: misfit add laws/cubic.toml --to 'my plant.mo:Plant'."
    )


def test_a_formula_beside_named_effects_says_what_it_is_added_to() -> None:
    beside = law("-k*v^3", 3.0) | {"beside": [{"id": "coulomb_friction", "site": "x", "parameters": {}}]}
    document = {"verdict": "named", "effects": beside["beside"], "laws": [beside], "held_out": {"rmse_after": {}}}
    assert formula_lines(document)[0] == "A formula explains what Coulomb friction at x leaves: drag."


def test_a_page_without_proposals_says_nothing_of_formulas() -> None:
    assert "formula" not in page([])
