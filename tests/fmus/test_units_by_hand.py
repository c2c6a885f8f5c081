"""Units and their conversion against values worked out by hand."""

import subprocess
import sys

import pytest

from fmus.errors import MisfitError
from fmus.units import _COMMON, _by_pint, conversion, scaling, si_exponents


@pytest.mark.parametrize(
    ("value", "from_unit", "to_unit", "expected"),
    [
        (212.0, "degF", "degC", 100.0),
        (-40.0, "degC", "degF", -40.0),
        (300.0, "K", "degF", 80.33),
        (90.0, "km/h", "m/s", 25.0),
    ],
)
def test_a_value_is_the_same_in_both_units(value: float, from_unit: str, to_unit: str, expected: float) -> None:
    factor, offset = scaling(from_unit, si_exponents(from_unit), to_unit, si_exponents(to_unit))

    assert factor * value + offset == pytest.approx(expected, abs=1e-9)


def test_zeros_that_differ_are_no_factor_however_near_they_are() -> None:
    with pytest.raises(MisfitError, match="their zero points differ; use K"):
        conversion("degC", "K")
    assert conversion("degC", "degC") == 1.0


@pytest.mark.parametrize(
    ("unit", "exponents"),
    [
        ("(m/s)", {"m": 1, "s": -1}),
        ("(N.m)/(rad/s)", {"kg": 1, "m": 2, "s": -1, "rad": -1}),
        ("J/(kg.K)", {"m": 2, "s": -2, "K": -1}),
        ("1/s", {"s": -1}),
    ],
)
def test_brackets_and_quotients_mean_what_they_say(unit: str, exponents: dict[str, int]) -> None:
    assert si_exponents(unit).exponents == exponents


@pytest.mark.parametrize("symbol", _COMMON)
def test_a_unit_that_is_known_without_pint_is_what_pint_says(symbol: str) -> None:
    by_pint = _by_pint(symbol, symbol)

    assert _COMMON[symbol] == by_pint
    assert list(_COMMON[symbol].exponents) == list(by_pint.exponents)  # model descriptions list them in this order


def test_units_of_usual_records_load_no_pint() -> None:
    code = "import sys; from fmus.units import si_exponents as si; [si(u) for u in ('N.m.s/rad', 'deg', '1')]; print('pint' in sys.modules)"

    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "False\n"
