"""Thinned curves keep their ends and their peaks."""

import hypothesis.extra.numpy as arrays
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from orchestrator.report.thinning import extremes


@given(arrays.arrays(float, st.integers(1, 400), elements=st.floats(-1e6, 1e6)), st.integers(2, 50))
def test_a_thinned_curve_has_the_ends_and_the_peaks_of_the_whole_one(values: np.ndarray, most: int) -> None:
    places = extremes(values, most)
    assert list(places) == sorted(set(places))
    assert len(places) <= max(most + 2, len(values) if len(values) <= most else 0)
    assert {0, len(values) - 1} <= set(places)
    assert values[places].min() == values.min() and values[places].max() == values.max()
