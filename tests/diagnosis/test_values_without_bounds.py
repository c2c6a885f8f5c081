"""Effects are found whatever their size: no limit of a class but where physics has one."""

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.evidence import LearningData, refit
from orchestrator.diagnosis.fit.extensible import find_candidates
from orchestrator.library.cards import effect_library
from orchestrator.models.smoothing import SmoothedTrial

TIME = np.arange(1000) * 0.004


@pytest.mark.parametrize(
    ("card", "value", "torque"),
    [("joint_scale", 0.3, 0.2), ("constant_force", 400.0, 900.0), ("rotor_inertia", 20.0, 900.0)],
)
def test_an_effect_of_any_size_is_found_from_the_first_guess_of_its_card(
    card: str, value: float, torque: float
) -> None:
    source, cards = find_modelica_model("drive"), [c for c in effect_library() if c.id == card]
    candidates = find_candidates(source, source.compile(), cards)[0]
    effects, noise = EffectSet(source, candidates, ("phi",)), np.array([1e-3])
    inputs = np.column_stack([torque * np.sin(4 * TIME) + 0.5 * torque * np.sin(11 * TIME), np.zeros(len(TIME))])
    true = effects.model.compiled.with_values(np.array([value]))
    angle = effects.model.compiled.run(TIME, inputs, true, np.zeros(2), substeps=64).outputs
    learning = LearningData((SmoothedTrial(TIME, inputs, angle, noise),), noise)

    found = refit(effects, learning, effects.first_guess())

    assert found.values == pytest.approx([value], rel=1e-3)
    assert not found.fit.at_bound.any()
