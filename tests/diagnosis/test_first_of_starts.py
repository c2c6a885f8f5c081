"""Which of several first values a fit begins from: the first of the least, however early a look at one ends."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from orchestrator.diagnosis import evidence


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
