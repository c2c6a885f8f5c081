"""Surprising values of parameters are believed only where nothing is left that they could stand for."""

from types import SimpleNamespace
from typing import Any

import pytest

from orchestrator.greybox import decide
from orchestrator.greybox.thresholds import Thresholds


@pytest.mark.parametrize(
    ("complete", "ahead", "chosen"), [(True, 25.0, "far"), (False, 25.0, "near"), (True, 2.0, "near")]
)
def test_a_value_far_off_is_chosen_if_it_is_likelier_beyond_doubt_and_leaves_nothing(
    complete: bool, ahead: float, chosen: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    near: Any = SimpleNamespace(name="near", candidates=("E",), counted=1, loss=ahead, surprise=0.4)
    far: Any = SimpleNamespace(name="far", candidates=("k0",), counted=1, loss=0.0, surprise=9.0)
    monkeypatch.setattr(decide, "surprise", lambda found: found.surprise)
    judge: Any = SimpleNamespace(
        limits=Thresholds(),
        defeats=lambda one, other: False,
        beyond_doubt=lambda better, other: other.loss - better.loss > 10.0,
        best_ratio=lambda one, other: 0.9,
    )
    found: Any = decide._with_plausible_values([far, near], judge, lambda found: complete)
    assert found.name == chosen
