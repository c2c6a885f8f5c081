"""Whether data tell an effect from its absence, by a parameter that is not zero when the effect is absent."""

from typing import Any, cast

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from orchestrator.diagnosis.candidates import EffectSet, find_candidates
from orchestrator.diagnosis.cards import effect_library
from orchestrator.diagnosis.evidence import Refit
from orchestrator.models.estimation import Fit


@pytest.mark.parametrize(("scale", "std", "present"), [(0.9991, 1e-6, True), (0.9991, 1e-3, False), (1.0, 0.0, False)])
def test_an_encoder_scaled_by_a_thousandth_is_present_if_its_error_is_smaller_than_that(
    scale: float, std: float, present: bool
) -> None:
    base = find_modelica_model("double-pendulum")
    cards = [card for card in effect_library() if card.id == "joint_scale"]
    candidate = find_candidates(base, base.compile(), cards)[0][0]
    effects = EffectSet(base, [candidate], ("q1", "q2"))
    found = Fit(np.array([scale]), np.array([std]), (), 1.0, np.array([False]), 1000)

    assert Refit(effects, cast(Any, None), (), found, 1).is_present() is present
