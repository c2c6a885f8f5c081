"""A shaft so soft that it twists by a radian is an elastic joint as well, and is found from where stiff ones are."""

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.evidence import LearningData, refit
from orchestrator.diagnosis.fit.extensible import find_candidates
from orchestrator.library.cards import effect_library
from orchestrator.models.smoothing import SmoothedTrial

STIFFNESS, DAMPING, SHARE = 0.1, 0.02, 0.6  # N.m/rad, N.m.s/rad, 1: anti-resonance at 0.6 Hz


def test_a_soft_shaft_is_found_from_the_first_guess_of_its_card() -> None:
    source, cards = find_modelica_model("drive"), [c for c in effect_library() if c.id == "joint_elasticity"]
    effects = EffectSet(source, find_candidates(source, source.compile(), cards)[0], ("phi",))
    time, noise = np.arange(1000) * 0.004, np.array([1e-3])
    torque = 0.2 * np.sin(4 * time) + 0.1 * np.sin(11 * time)
    inputs = np.column_stack([torque, np.zeros(len(time))])
    true = effects.model.compiled.with_values(np.array([STIFFNESS, DAMPING, SHARE]))
    angle = effects.model.compiled.run(time, inputs, true, np.zeros(4)).outputs
    learning = LearningData((SmoothedTrial(time, inputs, angle, noise),), noise)

    found = refit(effects, learning, effects.first_guess())

    assert found.values == pytest.approx([STIFFNESS, DAMPING, SHARE], rel=1e-2)
    assert not found.fit.at_bound.any()
