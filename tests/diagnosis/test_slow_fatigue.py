"""Muscles that lose next to nothing of their strength while a record lasts tire all the same, if the encoders show it."""

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.evidence import LearningData, refit
from orchestrator.diagnosis.fit.extensible import find_candidates
from orchestrator.library.cards import effect_library
from orchestrator.models.smoothing import SmoothedTrial

FALLS = 1500.0  # s: a share of 2 s/FALLS = 0.0013 of the strength at full activation


def test_fatigue_over_much_longer_than_the_record_is_there_and_not_at_a_limit() -> None:
    source, cards = find_modelica_model("arm"), [c for c in effect_library() if c.id == "fatigue"]
    effects = EffectSet(source, find_candidates(source, source.compile(), cards)[0], ("q1", "q2"))
    time, noise, model = np.arange(500) * 0.004, np.full(2, 1e-6), effects.model
    inputs = np.zeros((len(time), len(model.inputs)))
    inputs[:, :6] = 0.3 + 0.2 * np.sin(np.outer(time, [2, 3, 4, 5, 6, 7]))
    start = np.array([v.start for v in model.system.states])
    right = model.compiled.with_values(np.array([FALLS, FALLS]))
    angles = model.compiled.run(time, inputs, right, start, substeps=4).outputs
    learning = LearningData((SmoothedTrial(time, inputs, angles, noise),), noise)

    found = refit(effects, learning, effects.first_guess())

    assert found.is_present()
    assert found.values[0] == pytest.approx(FALLS, rel=0.02)
