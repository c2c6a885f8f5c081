"""Nothing is named that makes held-out trials worse."""

import sys
from dataclasses import replace
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "report"))
from builders import COULOMB, PAYLOAD, diagnosis

from orchestrator.verdicts.gate import without_harm
from orchestrator.verdicts.result import Diagnosis


def _with_held_out(after: float) -> Diagnosis:
    found = diagnosis("named")
    held_out = replace(found.held_out, rmse_before={"q1": 0.01, "q2": 0.01}, rmse_after={"q1": after, "q2": after})
    return replace(found, held_out=held_out)


@pytest.mark.parametrize("after", [0.011, 0.5])
def test_a_set_that_makes_held_out_trials_worse_is_the_best_one_and_not_named(after: float) -> None:
    found = without_harm(_with_held_out(after))
    assert found.verdict == "unknown" and not found.effects and found.best == (COULOMB, PAYLOAD)
    assert len(found.steps) == 1 and found.held_out.rmse_after == found.held_out.rmse_before
    assert "held-out trials become" in found.warnings[0]


@pytest.mark.parametrize("after", [0.001, 0.0101])
def test_a_set_that_makes_them_no_worse_stays_named(after: float) -> None:
    assert without_harm(_with_held_out(after)).verdict == "named"
