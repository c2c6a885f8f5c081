"""Each kind of check fails for what it is for, by the amount that algebra gives."""

import math

import numpy as np
import pytest

from fmus.errors import MisfitError
from orchestrator.regress.comparison import (
    Bounds,
    Conserved,
    EndValue,
    Events,
    Funnel,
    Pointwise,
    Signal,
    Statistics,
    SteadyState,
    Tolerance,
    Tube,
    combine,
    compare_signals,
)
from orchestrator.regress.comparison.one_number import mean_and_spread

TIME = np.linspace(0.0, 10.0, 1001)
RAMP = Signal("x", TIME, TIME, "m")
EXACT = Tolerance(absolute=0.0, relative=0.0)


def signal(values: np.ndarray, unit: str = "m", **kinds) -> Signal:
    return Signal("x", TIME, values, unit, **kinds)


def test_a_ramp_that_is_late_passes_with_as_much_time_as_it_is_late() -> None:
    late = signal(TIME - 0.25)

    assert (
        compare_signals(late, RAMP, Tolerance(0.0, 0.0, 0.25)).points_outside == 25
    )  # below 0 the reference has no values
    assert compare_signals(late, RAMP, Tolerance(0.25, 0.0, 0.0)).passed
    short = compare_signals(late, RAMP, Tolerance(0.0, 0.0, 0.1, from_s=1.0))
    assert not short.passed and short.amplitude_error == pytest.approx(0.15, abs=1e-8)


def test_relative_tolerance_is_of_the_range_and_not_of_the_size() -> None:
    high = signal(1e5 + np.sin(TIME), "Pa", nominal=1.0)

    assert compare_signals(signal(high.values + 0.01, "Pa"), high, Tolerance(relative=1e-3)).exceed == pytest.approx(
        0.01 / (1e-3 * np.ptp(high.values) + 1e-5)
    )


def test_the_absolute_tolerance_follows_the_nominal_size() -> None:
    quiet = signal(np.zeros(1001), "Pa", nominal=1e5)

    assert compare_signals(signal(np.full(1001, 0.9), "Pa"), quiet, Tolerance()).passed
    assert not compare_signals(signal(np.full(1001, 1.1), "Pa"), quiet, Tolerance()).passed


def test_rounding_around_zero_is_no_change() -> None:
    zero = signal(np.zeros(1001))

    assert compare_signals(signal(np.full(1001, 1.3e-16)), zero, Tolerance()).passed


def test_a_constant_that_changes_is_a_change() -> None:
    one = signal(np.full(1001, 5.0))

    assert compare_signals(signal(np.full(1001, 5.0 + 4e-5)), one, Tolerance()).passed
    assert not compare_signals(signal(np.full(1001, 5.0 + 6e-5)), one, Tolerance()).passed


def test_a_tolerance_stored_in_single_precision_still_holds() -> None:
    assert compare_signals(signal(TIME + 0.0010000000475), RAMP, Tolerance(0.001, 0.0)).passed


def test_a_tolerance_that_hides_everything_is_noted() -> None:
    verdict = compare_signals(RAMP, RAMP, Tolerance(absolute=5.0))

    assert verdict.passed and "the tolerance is 50% of the reference's range" in verdict.notes[0]


def test_whole_numbers_that_are_held_are_compared_exactly() -> None:
    gear = signal(np.floor(TIME), "1", interpolation="hold")
    other = signal(np.floor(TIME) + (TIME > 9.5), "1", interpolation="hold")

    assert compare_signals(gear, gear, Tolerance(relative=0.5)).passed
    assert not compare_signals(other, gear, Tolerance(relative=0.5)).passed


def test_a_switch_may_be_late_by_the_time_shift_and_no_more() -> None:
    def switch(at: float) -> Signal:
        return Signal("on", [0.0, at, 10.0], [0.0, 1.0, 1.0], "1", "hold")

    within = compare_signals(switch(5.2), switch(5.0), Tolerance(time_shift_s=0.25))
    beyond = compare_signals(switch(5.3), switch(5.0), Tolerance(time_shift_s=0.25))

    assert within.passed and within.event_shift_s == pytest.approx(0.2)
    assert not beyond.passed
    assert beyond.event_shift_s == pytest.approx(0.3) and beyond.amplitude_error == 0.0
    assert beyond.would_have_passed_time_shift_s == pytest.approx(0.3)
    assert "its jumps come up to 0.3 s late (at 5 s)" in beyond.reason


def test_a_result_that_is_only_late_names_the_time_shift_with_which_it_passes() -> None:
    def jump(at: float, height: float) -> Signal:
        return signal(np.where(at - 1e-9 <= TIME, height, 0.0) + 0.001 * np.sin(TIME))

    late = compare_signals(jump(5.3, 1.0), jump(5.0, 1.0), Tolerance(0.01, 0.0, 0.1))
    late_and_high = compare_signals(jump(5.3, 1.2), jump(5.0, 1.0), Tolerance(0.01, 0.0, 0.1))

    assert (
        late.would_have_passed_time_shift_s == pytest.approx(0.3)
        and "or would pass with time_shift_s = 0.3" in late.reason
    )
    assert compare_signals(
        jump(5.3, 1.0), jump(5.0, 1.0), Tolerance(0.01, 0.0, late.would_have_passed_time_shift_s)
    ).passed
    assert late_and_high.would_have_passed_time_shift_s is None


def test_lateness_and_size_of_a_jump_are_told_apart() -> None:
    def jump(at: float, height: float) -> Signal:
        return Signal("x", [0.0, at, at, 10.0], [0.0, 0.0, height, height], "m")

    verdict = compare_signals(jump(5.3, 1.1), jump(5.0, 1.0), Tolerance(0.01, 0.0, 0.1))

    assert verdict.event_shift_s == pytest.approx(0.3) and verdict.amplitude_error == pytest.approx(0.1)


def test_an_event_that_rounding_moves_by_one_sample_is_no_change_but_two_samples_are() -> None:
    def step(k: int) -> Signal:
        return signal((np.arange(1001) >= k).astype(float))

    for moved in (step(499), step(501)):
        assert compare_signals(moved, step(500), Tolerance()).passed
        assert not Pointwise().judge(moved, step(500)).passed
    for moved in (step(498), step(502)):
        assert not compare_signals(moved, step(500), Tolerance()).passed


def test_the_moment_of_a_jump_counts_where_samples_are_far_apart() -> None:
    reference = Signal("on", [0.0, 5.0, 10.0], [0.0, 1.0, 1.0], "1", "hold")
    early = Signal("on", [0.0, 1.0, 10.0], [0.0, 1.0, 1.0], "1", "hold")

    assert not compare_signals(early, reference, Tolerance()).passed


def test_both_values_at_an_event_are_allowed_at_its_time_only() -> None:
    reference = Signal("x", [0.0, 5.0, 5.0, 10.0], [0.0, 0.0, 1.0, 1.0], "m")
    before = Signal("x", [0.0, 5.0, 5.001, 10.0], [0.0, 0.0, 1.0, 1.0], "m")
    late = Signal("x", [0.0, 5.001, 5.001, 10.0], [0.0, 0.0, 1.0, 1.0], "m")

    assert compare_signals(before, reference, Tolerance()).passed
    assert compare_signals(late, reference, Tolerance()).points_outside == 1


def test_a_funnel_opens_for_drift_and_no_faster() -> None:
    drifting = signal(TIME * 1.01)

    assert Funnel(Tolerance(0.001, 0.0), 0.0101).judge(drifting, RAMP).passed
    late = Funnel(Tolerance(0.001, 0.0), 0.009).judge(drifting, RAMP)
    # 0.01 t > 0.001 + 0.009 t from t = 1 on, worst against the tolerance at the end: 0.1 of 0.091.
    assert late.first_time == pytest.approx(1.01) and late.exceed == pytest.approx(0.1 / 0.091)
    assert Funnel(Tolerance(late.would_have_passed, 0.0), 0.009).judge(drifting, RAMP).passed


def test_pointwise_counts_the_local_value_as_isclose_does() -> None:
    rng = np.random.default_rng(3)
    reference = rng.normal(size=1001)
    values = reference * (1 + 1e-3 * rng.uniform(-2, 2, 1001))

    verdict = Pointwise(Tolerance(1e-4, 1e-3)).judge(signal(values), signal(reference))

    assert verdict.points_outside == np.count_nonzero(~np.isclose(values, reference, rtol=1e-3, atol=1e-4))


def test_pointwise_refuses_a_time_shift_that_would_not_count() -> None:
    assert "no time shift" in Pointwise(Tolerance(time_shift_s=0.1)).judge(RAMP, RAMP).reason


def test_the_end_value_alone_counts_for_its_check() -> None:
    detour = signal(np.where(TIME < 9, 0.0, TIME))

    assert EndValue().judge(detour, RAMP).passed
    assert EndValue(EXACT, value=10.0).judge(detour, None).passed
    wrong = EndValue(Tolerance(0.1, 0.0), value=10.5).judge(detour, None)
    assert not wrong.passed and wrong.would_have_passed == pytest.approx(0.5)
    assert "the last value is 10 m at 10 s, expected 10.5 m: off by 0.5 m" in wrong.reason


def test_bounds_name_the_first_sample_outside_and_the_worst() -> None:
    verdict = Bounds(lower=0.0, upper=8.0).judge(RAMP, None)

    assert not verdict.passed and verdict.amplitude_error == pytest.approx(2.0)
    assert verdict.first_time == pytest.approx(8.01) and verdict.points_outside == 200
    assert Bounds(upper=8.0, tolerance=Tolerance(verdict.would_have_passed)).judge(RAMP, None).passed


def test_energy_that_only_falls_passes_the_law_that_it_never_rises() -> None:
    falling = signal(np.exp(-TIME) + 1e-3 * (TIME > 5), "J")

    assert Conserved("never_rises").judge(signal(np.exp(-TIME), "J"), None).passed
    verdict = Conserved("never_rises", EXACT).judge(falling, None)
    # It jumps up by 1e-3 where it falls by about 1e-2 e^-5 a step.
    assert verdict.amplitude_error == pytest.approx(1e-3 - (math.exp(-5.0) - math.exp(-5.01)), rel=1e-6)
    assert Conserved("never_falls", EXACT).judge(RAMP, None).passed
    assert not Conserved("constant").judge(RAMP, None).passed


def test_a_sum_of_signals_is_conserved_where_none_of_them_is() -> None:
    swing = {"body.x": Signal("body.x", TIME, np.cos(TIME), "m"), "v": Signal("v", TIME, -np.sin(TIME), "m/s")}
    energy = combine("energy", "0.5 * v**2 + 0.5 * 'body.x'**2", swing, "J")

    assert Conserved("constant", Tolerance(1e-12, 0.0)).judge(energy, None).passed
    for formula, words in (("v +", "cannot be read"), ("2 * y", "no variable"), ("v + open(v)", "'open(v)'")):
        with pytest.raises(MisfitError, match=words.replace("(", r"\(").replace(")", r"\)")):
            combine("energy", formula, swing)


def test_undefined_values_of_a_formula_fail_with_a_reason() -> None:
    logarithm = combine("log", "log(x - 5)", {"x": RAMP})

    assert "is nan at 0 s" in Conserved().judge(logarithm, None).reason


def test_rest_is_asked_for_in_the_last_seconds_only() -> None:
    settled = signal(1.0 + np.exp(-2.0 * TIME))
    limit = Tolerance(math.exp(-2.0 * 7.9), 0.0)

    assert SteadyState(2.0, value=1.0, tolerance=limit).judge(settled, None).passed
    assert not SteadyState(2.2, value=1.0, tolerance=limit).judge(settled, None).passed
    assert SteadyState(2.0, tolerance=Tolerance(1e-6, 0.0)).judge(settled, signal(np.full(1001, 1.0))).passed
    assert "less than the window" in SteadyState(20.0, value=1.0).judge(settled, None).reason


def test_statistics_pass_what_moments_cannot() -> None:
    one, other = signal(np.sin(7.0 * TIME)), signal(np.cos(7.0 * TIME))

    assert not Tube(Tolerance(0.1)).judge(one, other).passed
    assert Statistics(tolerance=Tolerance(relative=0.05)).judge(one, other).passed
    calmer = Statistics(5.0, tolerance=Tolerance(relative=0.05)).judge(signal(0.8 * np.sin(7.0 * TIME)), other)
    assert not calmer.passed and "the spread from" in calmer.reason


def test_mean_and_spread_do_not_depend_on_the_samples() -> None:
    coarse = Signal("x", [0.0, 2.0, 10.0], [0.0, 4.0, 0.0])
    fine = signal(np.interp(TIME, coarse.time, coarse.values))

    # A line from 0 to 4 and back: uniform over [0, 4].
    assert mean_and_spread(coarse) == pytest.approx((2.0, 4.0 / math.sqrt(12.0)))
    assert mean_and_spread(fine) == pytest.approx((2.0, 4.0 / math.sqrt(12.0)))


def test_chaos_is_compared_up_to_a_horizon() -> None:
    apart = signal(np.where(TIME < 6.0, TIME, TIME + np.sin(50 * TIME)))

    assert not compare_signals(apart, RAMP, Tolerance()).passed
    assert compare_signals(apart, RAMP, Tolerance(until_s=5.9)).passed


def test_events_are_counted_and_timed_by_level() -> None:
    bouncing = signal(np.sin(TIME))
    late = signal(np.sin(TIME - 0.02))
    level = Events(level=0.5, direction="rising", tolerance=Tolerance(time_shift_s=0.03))

    assert level.judge(late, bouncing).passed
    assert level.judge(late, bouncing).event_shift_s == pytest.approx(0.02, abs=1e-4)
    tight = Events(level=0.5, direction="rising", tolerance=Tolerance(time_shift_s=0.01)).judge(late, bouncing)
    assert not tight.passed and "would pass with time_shift_s" in tight.reason
    # sin t = 0.5 rising at pi/6 and pi/6 + 2 pi.
    times = (math.pi / 6, math.pi / 6 + 2 * math.pi)
    assert (
        Events(times=times, level=0.5, direction="rising", tolerance=Tolerance(time_shift_s=1e-4))
        .judge(bouncing, None)
        .passed
    )
    assert "has 4 crossings of 0.5 m, expected 3" in Events(count=3, level=0.5).judge(bouncing, None).reason


def test_a_lost_event_is_named_by_its_time() -> None:
    def pulses(*moments: float) -> Signal:
        return signal(np.sum([moment <= TIME for moment in moments], axis=0).astype(float), interpolation="hold")

    verdict = Events().judge(pulses(1.0, 7.0), pulses(1.0, 4.0, 7.0))

    assert not verdict.passed
    assert "has 2 jumps, expected 3; the first without a partner is in the reference at 4 s" in verdict.reason


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Bounds(2.0, 1.0), "give lower, upper or both"),
        (lambda: Bounds(), "give lower, upper or both"),
        (lambda: Events(count=2, times=(1.0,)), "leave one of them out"),
        (lambda: Events(direction="up"), "expected one of any, rising, falling"),
        (lambda: Statistics(quantities=("median",)), "expected some of mean"),
        (lambda: SteadyState(-1.0), "window_s = -1.0"),
        (lambda: Conserved("grows"), "never_rises"),
        (lambda: EndValue(value="high"), "value = 'high'"),
    ],
)
def test_figures_without_sense_are_refused_by_name(make, words: str) -> None:
    with pytest.raises(MisfitError, match=words):
        make()
