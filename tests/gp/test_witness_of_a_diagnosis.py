"""What a diagnosis hears from the learned functions of a record: which input what is missing goes with."""

from dataclasses import replace
from pathlib import Path

from orchestrator.gp.trials.functions import Verdict
from orchestrator.gp.trials.witness import document, sentences, witness_functions
from orchestrator.measurements import load_measurements
from orchestrator.model_argument import load_modelica
from orchestrator.models.symbolic import SymbolicModel

CASES = Path(__file__).parents[1] / "cases"


def test_a_weak_muscle_is_named_by_its_own_function() -> None:
    model = SymbolicModel("arm", load_modelica("arm").compile())
    found = witness_functions(model, load_measurements(CASES / "arm/case_007"))
    assert [(each.output, each.factor) for each in found if each.needed] == [("q1", "alpha_1")]
    (said,) = sentences(found)
    assert said.endswith("alpha_1 stands out by itself")
    assert sum(row["needed"] for row in document(found)) == 1


def test_a_model_whose_inputs_do_not_move_has_no_witness() -> None:
    model = SymbolicModel("pendulum", load_modelica("pendulum").compile())
    assert witness_functions(model, load_measurements(CASES / "pendulum")) == ()


def test_inputs_are_named_by_how_much_they_count_and_what_is_not_needed_is_not_said() -> None:
    one = Verdict("q1:a", "q1", "a", 0.5, 20.0, 10.0)
    said = sentences((one, replace(one, factor="b", size=2.0), replace(one, factor="c", gain=1.0)))
    assert [each.split(": ")[1] for each in said] == ["b, a count"]
