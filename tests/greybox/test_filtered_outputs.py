"""Outputs that were filtered before they were written are thinned; a sensor's noise, or a signal that is not excited, is no filter's doing."""

import numpy as np
from scipy import signal

from orchestrator.greybox.thinning import stride, thinned

RANDOM = np.random.default_rng(5)
TIME = np.arange(2400) / 240.0
SWING = np.sin(3.0 * TIME) + 0.3 * np.sin(11.0 * TIME)
NOISE = RANDOM.normal(size=len(TIME))
NOISY = SWING + 1e-3 * NOISE
NO_INPUTS = np.zeros((len(TIME), 0))


def filtered(column: np.ndarray, corner: float) -> np.ndarray:
    """Forwards and backwards through a filter, whose corner is a share of half the sampling rate."""
    return np.asarray(signal.filtfilt(*signal.butter(2, corner), column))


def test_every_sample_of_a_noisy_sensor_is_used() -> None:
    assert stride(NOISY, NO_INPUTS) == 1


def test_a_filter_with_half_the_corner_leaves_half_the_samples() -> None:
    wide, narrow = (stride(filtered(NOISE, corner), NO_INPUTS) for corner in (0.16, 0.08))
    assert wide > 1 and narrow == 2 * wide


def test_what_is_left_of_filtered_noise_is_hardly_correlated() -> None:
    column = filtered(NOISE, 0.16)
    kept = column[:: stride(column, NO_INPUTS)]
    before, after = (abs(np.corrcoef(each[1:], each[:-1])[0, 1]) for each in (column, kept))
    assert before > 0.9 and after < 0.6


def test_an_output_that_its_input_does_not_excite_is_no_filtered_one() -> None:
    force = filtered(NOISE, 0.16)
    answer = np.cumsum(force) / 240.0
    assert stride(answer, NO_INPUTS) > 1
    assert stride(answer, force[:, None]) == 1


def test_only_samples_of_filtered_outputs_are_left_out() -> None:
    outputs = np.column_stack([NOISY, filtered(NOISY, 0.16)])
    found = thinned(outputs, NO_INPUTS)
    assert np.isfinite(found[:, 0]).all()
    kept = np.isfinite(found[:, 1])
    assert 0 < kept.sum() < len(TIME) and (found[kept, 1] == outputs[kept, 1]).all()
