"""The whole chain on measured data: from Modelica source to a named effect and a fallen error."""

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from orchestrator.diagnose import diagnose
from orchestrator.library.cards import effect_library
from orchestrator.measurements import load_measurements
from orchestrator.verdicts.result import Diagnosis
from tests.thinned import thinned

CASES = Path(__file__).parents[1] / "cases"
ANSWERS: dict[str, Any] = json.loads((CASES / "arm" / "answers.json").read_text())["cases"]
NAMEABLE = [case for case, truth in ANSWERS.items() if truth["effects"] not in (["none"], ["unknown"])]


@cache
def run(model: str, data: Path) -> Diagnosis:
    return diagnose(find_modelica_model(model), load_measurements(data))


def over_signals(rmse: Any) -> float:
    return float(np.sqrt(np.mean(np.square(list(rmse.values())))))


# Parameters of the effects, and what they are called in the answers.
CALLED = {
    "case_003": {"mass": "mass"},
    "case_004": {"T": "delay"},
    "case_007": {"factor[1]": "fmax_factor"},
    "case_008": {"tauUp": "tau_act", "tauDown": "tau_deact"},
    "case_009": {"tauC[1]": "tau_c1", "tauC[2]": "tau_c2"},
}


@pytest.mark.parametrize("case", NAMEABLE)
def test_hidden_effects_of_the_arm_are_named_sized_within_three_percent_and_the_error_falls(case: str) -> None:
    check_arm(run("arm", CASES / "arm" / case), case)


def test_a_payload_is_named_and_sized_by_two_trials_at_half_the_rate(tmp_path: Path) -> None:
    learning = ["trial_01.csv", "trial_02.csv"]
    folder = thinned(CASES / "arm" / "case_003", tmp_path, 2, learning, ["trial_05.csv"])

    check_arm(run("arm", folder), "case_003")


def check_arm(found: Diagnosis, case: str) -> None:
    truth = ANSWERS[case]
    assert found.verdict == "named"
    assert sorted(effect.id for effect in found.effects) == sorted(truth["effects"])
    before, after = over_signals(found.held_out.rmse_before), over_signals(found.held_out.rmse_after)
    assert after < before / 10 or after < 1.5 * truth["true_model_rmse_heldout_rad"]
    assert sorted(found.ranking[0].effects) == sorted(truth["effects"])
    # The named effects say what inputs the missing torque goes with; a weaker witness beside them would contradict them.
    assert not any(finding.startswith("what is missing at") for finding in found.findings)
    for name, true_name in CALLED.get(case, {}).items():
        true = truth["parameters"][0][true_name]
        assert found.effects[0].parameters[name].value == pytest.approx(true, rel=0.03)


def test_nothing_is_named_when_nothing_is_missing() -> None:
    found = run("arm", CASES / "arm" / "case_006")

    assert (found.verdict, found.effects, len(found.steps)) == ("adequate", (), 1)


def test_effect_that_no_given_card_explains_is_called_unknown() -> None:
    without_cogging = [card for card in effect_library() if card.id != "cogging"]

    found = diagnose(find_modelica_model("arm"), load_measurements(CASES / "arm" / "case_002"), cards=without_cogging)

    assert (found.verdict, found.effects) == ("unknown", ())
    assert any("--tolerance" in warning for warning in found.warnings)  # parameters may be another machine's


def test_real_muscle_lacks_activation_dynamics_and_a_delay() -> None:
    found = run("rat-muscle", CASES / "rat_muscle")

    assert found.verdict == "named"
    assert {effect.id for effect in found.effects} == {"activation_dynamics", "stimulation_delay"}
    assert found.held_out.rmse_after["force"] < found.held_out.rmse_before["force"] / 4


def test_same_input_gives_the_same_result() -> None:
    first = run("arm", CASES / "arm" / "case_003").to_json()
    run.cache_clear()
    second = run("arm", CASES / "arm" / "case_003").to_json()

    assert {**first, "seconds": 0} == {**second, "seconds": 0}
