"""Numbers in a report are the numbers of the result, rounded."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from orchestrator.report.numbers import digits, estimate_parts, over_floor, quantity
from orchestrator.verdicts.result import Estimate

PREFIXES = {"p": 1e-12, "n": 1e-9, "µ": 1e-6, "m": 1e-3, "": 1.0, "k": 1e3, "M": 1e6, "G": 1e9}
# Half of the last of three digits is at most 0.5 % of the number.
ROUNDING = 0.00501


@given(st.floats(min_value=1e-9, max_value=1e9), st.sampled_from(["rad", "N.m", "rad/s", "kg", "1", "degC"]))
def test_a_quantity_read_back_is_the_value_within_half_of_its_third_digit(value: float, unit: str) -> None:
    number, _, shown_unit = quantity(value, unit).partition(" ")
    prefix = shown_unit.removesuffix(unit) if unit != "1" else shown_unit

    assert float(number) * PREFIXES[prefix] == pytest.approx(value, rel=ROUNDING)


@given(st.floats(min_value=-1e300, max_value=1e300))
def test_digits_read_back_are_the_number_within_half_of_the_third_digit(value: float) -> None:
    assert float(digits(value)) == pytest.approx(value, rel=ROUNDING)


@given(st.floats(-1e5, 1e5), st.floats(1e-5, 1e3))
def test_a_value_is_shown_to_a_tenth_of_its_interval(value: float, half_width: float) -> None:
    shown, _ = estimate_parts(Estimate(value, "N", (value - half_width, value + half_width)))

    assert abs(float(shown) - value) <= 0.051 * half_width + 1e-9


@pytest.mark.parametrize(
    ("value", "shown"), [(123.0, "123 N"), (1230.0, "1.23 kN"), (0.123, "123 mN"), (0.00123, "1.23 mN")]
)
def test_a_prefix_leaves_one_to_three_digits_before_the_point(value: float, shown: str) -> None:
    assert quantity(value, "N") == shown


def test_the_common_error_is_the_root_mean_square_of_the_ratios() -> None:
    # Ratios 3 and 4: sqrt((9 + 16) / 2).
    assert over_floor({"a": 3.0, "b": 8.0}, {"a": 1.0, "b": 2.0}) == pytest.approx(math.sqrt(12.5))


def test_an_error_over_a_floor_of_zero_is_infinite() -> None:
    assert over_floor({"a": 1.0}, {"a": 0.0}) == math.inf
