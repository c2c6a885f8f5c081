"""The noise level of a column."""

import math

import numpy as np
import pytest

from orchestrator.measurements import declared_noise, estimated_noise, measurement_noise

N = 20_000
# Standard error of a MAD estimate is 1.17 sigma / sqrt(n); overlapping differences raise it to
# about 2 sigma / sqrt(n). Four of these are 6 %.
TOLERANCE = 4 * 2 / math.sqrt(N)


def white(sigma: float) -> np.ndarray:
    return np.random.default_rng(1).normal(0.0, sigma, N)


@pytest.mark.parametrize("sigma", [1e-4, 0.25, 1e5])
def test_white_noise_is_measured_whatever_its_scale(sigma: float) -> None:
    assert estimated_noise(white(sigma)) == pytest.approx(sigma, rel=TOLERANCE)


def test_a_cubic_signal_under_the_noise_changes_nothing() -> None:
    x = np.linspace(-1.0, 1.0, N)
    noise = white(0.01)
    cubic = 50 * x**3 - 20 * x**2 + 7 * x + 3
    # The differences of the cubic vanish but for rounding, 1e-14 of 77.
    assert estimated_noise(cubic + noise) == pytest.approx(estimated_noise(noise), rel=1e-9)


def test_impacts_and_steps_do_not_count_as_noise() -> None:
    signal = white(0.01)
    signal[N // 3 :] += 5.0
    signal[:: N // 20] += 3.0
    assert estimated_noise(signal) == pytest.approx(0.01, rel=TOLERANCE)


def test_a_slow_quantised_signal_has_at_least_the_error_of_its_step() -> None:
    step = 1.533981e-4
    ramp = np.linspace(0.0, 20 * step, N)
    quantised = np.round(ramp / step) * step
    assert estimated_noise(quantised) == pytest.approx(step / math.sqrt(12), rel=1e-6)


@pytest.mark.parametrize("n", [2, 3, 4])
def test_a_record_too_short_for_the_full_order_gives_a_finite_level(n: int) -> None:
    # Differences of order n - 1 of 0, 0, ..., 1 leave one value, 1 / sqrt(comb(2 (n - 1), n - 1)).
    values = np.zeros(n)
    values[-1] = 1.0
    spread = 1 / math.sqrt(math.comb(2 * n - 2, n - 1)) / 0.6744897501960817
    assert estimated_noise(values) == pytest.approx(spread)


def test_declared_noise_adds_the_variance_of_the_quantisation() -> None:
    sensors = {"encoder_noise_std_rad": 3e-4, "encoder_resolution_rad": 4e-4 * 12**0.5}
    assert declared_noise(sensors, "rad") == pytest.approx(5e-4)


@pytest.mark.parametrize(("unit", "expected"), [("N", 0.25), ("mN", 250.0), ("rad", None), ("1", None), ("", None)])
def test_declared_noise_applies_to_columns_of_its_dimension_only(unit: str, expected: float | None) -> None:
    assert declared_noise({"force_noise_std_N": 0.25}, unit) == expected


def test_the_noise_of_an_angle_says_nothing_about_a_dimensionless_column() -> None:
    assert declared_noise({"encoder_noise_std_rad": 1e-3}, "1") is None
    assert declared_noise({"encoder_noise_std_rad": math.pi}, "deg") == pytest.approx(180.0)


def test_a_key_named_after_the_column_goes_before_the_sensor() -> None:
    sensors = {"encoder_noise_std_rad": 3e-3, "q2_noise_std_rad": 1e-3}
    assert declared_noise(sensors, "rad", column="q1") == 3e-3
    assert declared_noise(sensors, "rad", column="q2") == 1e-3


def test_a_speed_is_declared_with_an_underscore_for_the_slash() -> None:
    assert declared_noise({"gyro_noise_std_rad_s": 0.01}, "rad/s") == 0.01
    assert declared_noise({"gyro_noise_std_rad_per_s": 0.01}, "rad/s") == 0.01


def test_a_declared_level_that_the_record_does_not_exceed_is_used() -> None:
    level = measurement_noise("q", "rad", [white(1.0)], {"encoder_noise_std_rad": 1.1})
    assert level.std == pytest.approx(1.1)
    assert level.note.startswith("noise of 'q': 1.1 rad")
    assert "declared in [sensors]" in level.note
    assert level.warning == ""
    assert level.record == pytest.approx(1.0, rel=TOLERANCE)


def test_more_fast_noise_than_declared_gives_a_warning_and_is_used() -> None:
    level = measurement_noise("q", "rad", [white(1.0)], {"encoder_noise_std_rad": 0.5})
    assert level.std == pytest.approx(1.0, rel=TOLERANCE)
    assert level.declared == 0.5
    assert "declares 0.5; the larger is used" in level.warning


def test_a_motion_in_excess_of_the_declared_noise_is_no_contradiction() -> None:
    """A thousand times the noise, but below a quarter of the sampling rate."""
    signal = white(1.0) + 1000 * np.sin(0.05 * np.arange(N))
    level = measurement_noise("q", "rad", [signal], {"encoder_noise_std_rad": 1.0})
    assert level.std == pytest.approx(1.0)
    assert level.warning == ""


def test_noise_declared_as_zero_is_measured() -> None:
    level = measurement_noise("q", "rad", [white(0.3)], {"encoder_noise_std_rad": 0.0})
    assert level.std == pytest.approx(0.3, rel=TOLERANCE)


def test_without_a_declaration_the_records_tell_and_a_spoiled_one_does_not_count() -> None:
    """The spectrum is a median over windows: a third of them with fifty times the noise shifts it, but not to that level."""
    level = measurement_noise("q", "rad", [white(1.0), white(1.0)[::-1], white(50.0)], {})
    assert 1.0 < level.std < 2.0
    assert "estimated from the record" in level.note


def test_a_reading_in_coarse_steps_is_called_so_and_one_in_fine_steps_is_not() -> None:
    coarse, fine = (np.round(white(0.1) / step) * step for step in (0.5, 0.05))
    assert "which reads in steps of 0.5 K" in measurement_noise("T", "K", [coarse], {}).note
    assert "steps" not in measurement_noise("T", "K", [fine], {}).note


def test_a_resolution_alone_is_only_a_lower_limit() -> None:
    sensors = {"encoder_resolution_rad": 12**0.5}
    assert measurement_noise("q", "rad", [white(1e-3)], sensors).std == pytest.approx(1)
    noisy = white(9.0)
    assert measurement_noise("q", "rad", [noisy], sensors).std == pytest.approx(9.0, rel=TOLERANCE)


@pytest.mark.parametrize(("value", "expected"), [(20.0, 0.02), (0.0, 0.001)])
def test_a_column_that_never_changes_gets_an_assumed_level_and_says_so(value: float, expected: float) -> None:
    level = measurement_noise("q", "rad", [np.full(50, value)], {})
    assert level.std == pytest.approx(expected)
    assert "never changes; declare it in [sensors]" in level.note


def test_a_command_that_changes_in_steps_is_exact() -> None:
    steps = np.repeat([0.1, 0.43, 0.17, 0.29, 0.36], 50)
    assert measurement_noise("u", "1", [steps], {}, drives=True).std == 0.0


def test_steps_of_any_size_are_a_command_and_no_resolution() -> None:
    steps = np.repeat([0.1, 0.43, 0.17, 0.29, 0.36], 50)

    assert estimated_noise(steps) == 0.0
    assert estimated_noise(np.round(steps, 1)) == pytest.approx(0.1 / np.sqrt(12))


def test_a_square_wave_beside_other_commands_is_exact() -> None:
    """Trials of a recommended experiment switch commands: their one step is no resolution of the steps elsewhere."""
    random = np.random.default_rng(3)
    staged = [np.repeat(random.uniform(0.05, 0.6, 8), 60) for _ in range(3)]
    square = np.tile(np.repeat([0.06, 0.59], 60), 4)
    stair = np.tile(np.repeat([0.1, 0.3, 0.5], 60), 3)

    assert measurement_noise("u", "1", [*staged, square], {}, drives=True).std == 0.0
    assert measurement_noise("u", "1", [*staged, stair], {}, drives=True).std == 0.0
    assert measurement_noise("u", "1", [square, square], {}, drives=True).std == 0.0


def test_steps_of_a_constant_speed_are_no_resolution() -> None:
    """A shaft at 4 rad/s moves 0.016 rad from one sample to the next: its encoder may be a thousand times finer."""
    time, random = np.arange(2000) / 250, np.random.default_rng(4)
    turning = 4.0 * time + 1e-5 * random.standard_normal(len(time))

    assert estimated_noise(turning) == pytest.approx(1e-5, rel=0.1)
    # Where an encoder counts a step from sample to sample, and now and then none, it shows its resolution.
    counted = np.round(1.0 * time / 0.005) * 0.005
    assert estimated_noise(counted) == pytest.approx(0.005 / np.sqrt(12), rel=0.1)


@pytest.mark.parametrize("speed", [1.02, 3.02, 3.5, 7.04])
def test_resolution_is_that_of_the_encoder_however_evenly_it_turns(speed: float) -> None:
    """At 3.02 counts a sample nearly all steps are of three counts, and the few others of four."""
    resolution = 2e-4
    angle = resolution * np.round(speed * np.arange(2000))

    assert estimated_noise(angle) == pytest.approx(resolution / np.sqrt(12), rel=0.5)


def test_a_command_is_exact_where_that_is_declared() -> None:
    torque = np.sin(np.arange(400) / 9.0) + 0.05 * np.random.default_rng(1).standard_normal(400)
    assert measurement_noise("u", "N.m", [torque], {}, drives=True).std > 0.01
    assert measurement_noise("u", "N.m", [torque], {"torque_noise_std_N.m": 0.0}, drives=True).std == 0.0


def test_what_is_fast_in_a_command_is_no_noise_of_its_sensor() -> None:
    sensors = {"torque_noise_std_N.m": 0.001, "torque_noise_std_N_m": 0.001}
    level = measurement_noise("torque", "N.m", [white(0.2)], sensors, drives=True)
    assert level.std == 0.001
    assert "it drives the model" in level.warning


def test_a_resolution_of_a_command_is_only_a_lower_limit_too() -> None:
    level = measurement_noise("torque", "N.m", [white(0.2)], {"torque_resolution_N_m": 0.001}, drives=True)
    assert level.std == pytest.approx(0.2, rel=TOLERANCE)
