"""Which of several first values a fit begins from: the first of the least, however early a look at one ends, and the next if an
effect stays absent."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fmus.catalogue import find_modelica_model
from orchestrator.diagnosis.fit import evidence
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.evidence import LearningData, refit
from orchestrator.diagnosis.fit.extensible import find_candidates
from orchestrator.library.cards import effect_library
from orchestrator.models.smoothing import SmoothedTrial


@given(st.lists(st.sampled_from([1.0, 2.0, 2.5, np.inf]), min_size=1, max_size=6))
def test_a_start_is_the_first_of_the_least_misfit(misfits: list[float]) -> None:
    begun: list[Any] = [(np.array([k]), None) for k in range(len(misfits))]

    def look(model: object, learning: object, guess: np.ndarray, earlier: object, limit: float) -> float:
        whole = misfits[int(guess[0])]
        return whole if whole < limit else np.inf  # as a look does that ends once it reaches the limit

    nothing: Any = None
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(evidence, "_rough_misfit", look)
        chosen, _ = evidence._likeliest(nothing, nothing, begun)

    assert int(chosen[0]) == int(np.argmin(misfits))


def test_a_fit_does_not_end_at_a_ceiling_above_all_commands_which_leaves_less_than_one_that_is_too_low() -> None:
    source, cards = find_modelica_model("drive"), [card for card in effect_library() if card.id == "saturation"]
    effects = EffectSet(source, find_candidates(source, source.compile(), cards)[0], ("phi",))
    time, ceiling, noise = np.arange(1000) * 0.004, 0.098, np.array([1e-6])
    inputs = np.column_stack([0.1 * np.sin(3 * time), np.zeros(len(time))])
    model = effects.model.compiled
    angle = model.run(time, inputs, model.with_values(np.array([ceiling])), np.zeros(2)).outputs
    learning = LearningData((SmoothedTrial(time, inputs, angle, noise),), noise)

    found = refit(effects, learning, np.array([[0.06], [0.5]]))

    assert found.values == pytest.approx([ceiling], rel=1e-4)
