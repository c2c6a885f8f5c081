"""Stimulation pulses and the excitation they stand for."""

import numpy as np
import pytest

from fmus.errors import MisfitError
from orchestrator.measurements import excitation_from_pulses, is_pulse_train
from orchestrator.measurements.pulses import PulseShape, bursts, pulse_shape

RATE = 2000.0


def pulses(onsets: list[float], width: float = 0.005) -> tuple[np.ndarray, np.ndarray]:
    """One second at 2 kHz of 7.95 V pulses on the flicker of a 16 bit converter."""
    time = np.arange(2000) / RATE
    values = np.random.default_rng(0).integers(-3, 2, time.size) * 3.05e-4
    for onset in onsets:
        first = round(onset * RATE)
        values[first : first + round(width * RATE)] += 7.95
    return time, values


def train(start: float, n: int) -> list[float]:
    return [start + 0.01 * k for k in range(n)]


@pytest.mark.parametrize("n", [2, 4, 7, 10])
@pytest.mark.parametrize("width", [0.0005, 0.0015, 0.005])
def test_excitation_lasts_from_the_first_pulse_until_a_period_after_the_last(n: int, width: float) -> None:
    time, values = pulses(train(0.2, n), width)

    excitation = excitation_from_pulses(time, values)

    on = np.arange(2000)
    expected = (on >= 400) & (on < 400 + 20 * n)
    assert excitation.tolist() == expected.astype(float).tolist()


def test_a_gap_of_two_periods_ends_a_burst() -> None:
    time, values = pulses(train(0.2, 4) + train(0.25, 4))
    excitation = excitation_from_pulses(time, values)
    assert np.flatnonzero(np.diff(excitation)).tolist() == [399, 479, 499, 579]


def test_one_pulse_that_comes_late_by_two_fifths_of_a_period_does_not_end_a_burst() -> None:
    time, values = pulses([*train(0.2, 5), 0.254, 0.264, 0.274])
    excitation = excitation_from_pulses(time, values)
    assert np.flatnonzero(np.diff(excitation)).tolist() == [399, 567]


def test_a_clock_that_does_not_start_at_zero_gives_the_same_excitation() -> None:
    time, values = pulses(train(0.2, 7))
    later = excitation_from_pulses(time + 1234.5, values)
    assert later.tolist() == excitation_from_pulses(time, values).tolist()


def test_a_single_pulse_alone_has_no_period_and_is_refused() -> None:
    time, values = pulses([0.3])
    with pytest.raises(MisfitError, match=r"no train of two or more pulses.*record"):
        excitation_from_pulses(time, values)


def test_a_single_pulse_lasts_the_period_that_other_records_show() -> None:
    twitch, tetanus, silence = pulses([0.3]), pulses(train(0.2, 4)), pulses([])

    shape = pulse_shape([twitch, tetanus, silence])

    assert shape is not None
    assert shape.period == pytest.approx(0.01)
    assert np.flatnonzero(excitation_from_pulses(*twitch, shape)).tolist() == list(range(600, 620))
    assert not excitation_from_pulses(*silence, shape).any()


def test_a_constant_channel_holds_no_excitation() -> None:
    time = np.arange(10) / RATE
    assert not excitation_from_pulses(time, np.zeros(10)).any()


def test_the_flicker_of_a_silent_record_does_not_lower_the_threshold() -> None:
    time, silence = pulses([])
    silence = np.where(np.arange(time.size) % 50 == 0, 3e-4, 0.0)
    shape = pulse_shape([(time, silence)] * 3 + [pulses(train(0.2, 4))])
    assert shape is not None
    assert shape.threshold == pytest.approx(7.95 / 2, rel=1e-3)


def test_bursts_are_listed_by_the_onsets_of_their_first_and_last_pulse() -> None:
    time, values = pulses(train(0.1, 4) + train(0.5, 2))
    found = bursts(time, values, PulseShape(threshold=4.0, period=0.01))
    np.testing.assert_allclose(found, [(0.1, 0.13), (0.5, 0.51)], rtol=1e-12)


@pytest.mark.parametrize(
    "values",
    [
        np.zeros(1000),
        np.sin(np.linspace(0.0, 60.0, 1000)),
        np.random.default_rng(0).normal(size=1000),
        np.linspace(0.0, 5.0, 1000),
        np.abs(np.sin(np.linspace(0.0, 60.0, 1000))) ** 20,
        np.repeat([0.0, 5.0, 0.0], [400, 20, 580]),
    ],
    ids=["constant", "sine", "noise", "ramp", "smooth bumps", "single pulse"],
)
def test_other_signals_are_no_pulse_train(values: np.ndarray) -> None:
    assert not is_pulse_train(values)


def test_pulses_with_a_sample_on_each_edge_are_a_pulse_train() -> None:
    one = [0.0] * 10 + [4.0, 7.95, 7.9, 4.0]
    assert is_pulse_train(np.array(one * 10))


def test_crosstalk_of_a_third_of_the_height_in_other_records_is_no_train() -> None:
    """One record of pulses of 8 V, two of pulses of 2.6 V at another rate: threshold and period are those of the first."""
    time, values = pulses(train(0.2, 8))
    _, other = pulses([0.2 + 0.03 * k for k in range(20)])

    shape = pulse_shape([(time, values), (time, other / 3), (time, other / 3)])

    assert shape is not None
    assert shape.period == pytest.approx(0.01)
    assert shape.threshold == pytest.approx(values.max() / 2, rel=1e-3)
