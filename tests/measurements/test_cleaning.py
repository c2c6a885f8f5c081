"""Outliers and held samples are found and replaced; steps, impacts and pulses of the signal stay."""

import numpy as np
import pytest

from orchestrator.measurements.cleaning import cleaned, pieces

TIME = np.arange(2500) * 0.004
MOTION = np.sin(5.0 * TIME)
NOISE = 1e-3 * np.random.default_rng(1).normal(size=TIME.size)


def test_outliers_are_found_where_they_are_and_nowhere_else() -> None:
    places = np.array([100, 700, 1500])
    series = MOTION + NOISE
    series[places] += [0.06, -0.04, 1.0]

    found = cleaned(TIME, series)

    np.testing.assert_array_equal(np.flatnonzero(found.outliers), places)
    # A cubic through neighbours errs by sqrt(34/36) of their noise and by h^4 of the sine, 1e-7.
    assert np.abs(found.values - MOTION)[places].max() < 5e-3
    untouched = np.delete(np.arange(TIME.size), places)
    np.testing.assert_array_equal(found.values[untouched], series[untouched])


@pytest.mark.parametrize(
    "signal",
    [np.where(TIME > 5.0, 1.0, 0.0), np.abs(np.sin(5.0 * TIME)), np.where(np.arange(TIME.size) % 20 == 0, 1.0, 0.0)],
    ids=["a step", "impacts", "pulses"],
)
def test_what_the_signal_does_itself_stays(signal: np.ndarray) -> None:
    series = signal + NOISE

    np.testing.assert_array_equal(cleaned(TIME, series).values, series)


def test_held_samples_of_a_moving_signal_are_replaced() -> None:
    series = MOTION + NOISE
    series[1000:1007] = series[999]

    found = cleaned(TIME, series)

    assert np.flatnonzero(found.held).tolist() == list(range(1000, 1007))
    assert np.abs(found.values - MOTION)[1000:1007].max() < 1e-2  # the hold was off by up to 0.1


def test_a_signal_at_rest_and_a_coarse_one_are_not_held() -> None:
    rest = np.where(TIME < 4.0, 0.3, 0.3 + 0.5 * np.clip(TIME - 4.0, 0, None) ** 2)
    coarse = np.round(MOTION / 0.05) * 0.05

    for series in (rest, coarse):
        np.testing.assert_array_equal(cleaned(TIME, series).values, series)


def test_a_series_is_cut_where_rows_are_missing() -> None:
    kept = np.delete(np.arange(100), [30, 31, 60])

    assert [len(part) for part in pieces(0.01 * kept, 1.0 * kept)] == [30, 28, 39]
