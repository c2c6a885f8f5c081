"""What an input did in a gap of its record."""

import numpy as np
import pytest

from orchestrator.diagnosis.gaps import unknown_in_gaps

STEP, RATE, MISSING = 0.004, 40.0, 8


def test_a_gap_is_as_uncertain_as_a_chord_of_a_sine_is_off_its_mean() -> None:
    """A chord over h = 8 steps errs in the mean by sin(w t) (sin(w h/2) / (w h/2) - cos(w h/2)) at its middle."""
    time = np.delete(np.arange(5000) * STEP, np.arange(1000, 1000 + MISSING - 1))
    half = 0.5 * RATE * MISSING * STEP

    found = unknown_in_gaps(time, np.sin(RATE * time))

    assert [np.flatnonzero(column).tolist() for column in found.T] == [[998], [999], [1000], [1001]]
    # The trapezoids beneath the mean err by (w step)^2 / 12, 0.2 %; the sine's root mean square is that of whole turns.
    assert found[999, 1] == pytest.approx((np.sin(half) / half - np.cos(half)) / np.sqrt(2), rel=0.02)


def test_a_record_without_gaps_has_none() -> None:
    time = np.arange(100) * STEP

    assert unknown_in_gaps(time, np.sin(RATE * time)).shape == (100, 0)
