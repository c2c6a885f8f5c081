"""Inputs across gaps: what a machine was given meanwhile."""

import numpy as np
import pytest

from orchestrator.measurements.cleaning import bridged

STEP, RATE = 0.004, 60.0


def test_a_bridged_input_gives_as_much_over_a_gap_as_the_whole_record() -> None:
    """The integral of a sine over the gap and the steps beside it, by its antiderivative."""
    missing = np.arange(1001, 1007)
    time = np.delete(np.arange(2000) * STEP, missing)
    before, after = time[999], time[1002]

    found = bridged(time, np.sin(RATE * time))

    inside = (time >= before) & (time <= after)
    given = np.trapezoid(found[inside], time[inside])
    exact = (np.cos(RATE * before) - np.cos(RATE * after)) / RATE
    straight = np.trapezoid(np.sin(RATE * time[inside]), time[inside])
    assert abs(given - exact) < 0.1 * abs(straight - exact)
    assert np.flatnonzero(found != np.sin(RATE * time)).tolist() == [1000, 1001]


@pytest.mark.parametrize("values", [np.sin(np.arange(50.0)), np.repeat([0.0, 1.0, 0.5, 2.0, 0.0], 10)])
def test_records_without_gaps_and_stepped_commands_stay_as_they_are(values: np.ndarray) -> None:
    time = np.arange(50) * STEP
    np.testing.assert_array_equal(bridged(time, values), values)
    time[25:] += 5 * STEP
    if np.ptp(np.diff(values)[:9]) == 0:
        np.testing.assert_array_equal(bridged(time, values), values)
