"""Whether data tell an effect from its absence, by a parameter that is not zero when the effect is absent."""

from typing import Any, cast

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.evidence import Refit
from orchestrator.diagnosis.fit.extensible import find_candidates
from orchestrator.library.cards import effect_library
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


@pytest.mark.parametrize(
    ("correlation", "std", "present"),
    [
        # Of two errors with variance s^2 and correlation r the sum has the variance 2 s^2 (1 + r).
        (-0.9999, 1.0, True),
        (0.0, 1.0, False),
        (-0.9999, 100.0, False),
    ],
)
def test_friction_that_two_joints_share_is_present_if_its_sum_is_known(
    correlation: float, std: float, present: bool
) -> None:
    """Joints that turn at one speed tell the sum of their friction, 0.6, and not how it is divided."""
    base = find_modelica_model("two-mass")
    cards = [card for card in effect_library() if card.id == "viscous_friction"]
    effects = EffectSet(base, find_candidates(base, base.compile(), cards)[0], ("phiMotor", "phiLoad"))
    values, together = np.array([0.5, 0.1]), np.array([[1.0, correlation], [correlation, 1.0]])
    found = Fit(values, np.full(2, std), (), 1.0, np.zeros(2, bool), 1000, correlation=together)

    assert Refit(effects, cast(Any, None), (), found, 1).is_present() is present
