"""What other tools pass in silence fails here, and the reason names it."""

import json

import numpy as np
import pytest

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
)

# Wide enough that no number fails; what fails below fails for its reason alone.
WIDE = Tolerance(absolute=100.0, relative=1.0, time_shift_s=0.01)
EVERY_CHECK = [
    Tube(WIDE),
    Funnel(WIDE, 1.0),
    Pointwise(Tolerance(absolute=100.0)),
    EndValue(WIDE),
    EndValue(WIDE, value=1.0),
    Bounds(-1e3, 1e3),
    Conserved("constant", WIDE),
    SteadyState(0.5, tolerance=WIDE),
    SteadyState(0.5, value=1.0, tolerance=WIDE),
    Statistics(1.0, tolerance=WIDE),
    Events(count=0, tolerance=WIDE),
    Events(tolerance=WIDE),
]
AGAINST_A_REFERENCE = [check for check in EVERY_CHECK if check.needs_reference]
TIME = np.linspace(0.0, 10.0, 101)
REFERENCE = Signal("q", TIME, np.sin(TIME), "rad")


def kind(check: object) -> str:
    return type(check).__name__


def result(time: np.ndarray = TIME, values: np.ndarray | None = None, unit: str = "rad") -> Signal:
    return Signal("q", time, np.sin(time) if values is None else values, unit)


def with_value(value: float, k: int = 50) -> np.ndarray:
    values = np.sin(TIME)
    values[k] = value
    return values


@pytest.mark.parametrize("check", EVERY_CHECK, ids=kind)
def test_a_good_result_passes_every_check(check) -> None:
    verdict = check.judge(result(), REFERENCE)

    assert verdict.passed, verdict.reason
    assert "\n" not in verdict.reason and verdict.name == "q" and verdict.check == check.kind


DAMAGED = {
    "one NaN": (result(values=with_value(np.nan)), "the result is nan at 5 s (1 of 101 samples)"),
    "all NaN": (result(values=np.full(101, np.nan)), "the result is nan at 0 s (101 of 101 samples)"),
    "infinite": (result(values=with_value(np.inf)), "the result is inf at 5 s"),
    "NaN at the end": (result(values=with_value(np.nan, 100)), "the result is nan at 10 s"),
    "NaN in time": (result(np.where(TIME == 5.0, np.nan, TIME), np.sin(TIME)), "time stamp nan in sample 51"),
    "empty": (result(np.zeros(0), np.zeros(0)), "the result is empty"),
    "a value missing": (result(values=np.sin(TIME[:-1])), "the result has 100 values for 101 time stamps"),
    "back in time": (result(np.where(TIME == 5.0, 4.5, TIME), np.sin(TIME)), "goes back from 4.9 s to 4.5 s"),
    "clock stands still": (
        result(np.where((TIME > 4.05) & (TIME < 4.55), 4.1, TIME), np.sin(TIME)),
        "4.1 s of the result occurs more than 3 times",
    ),
}


@pytest.mark.parametrize("check", EVERY_CHECK, ids=kind)
@pytest.mark.parametrize("damage", DAMAGED)
def test_a_damaged_result_fails_every_check_with_its_reason(check, damage: str) -> None:
    damaged, reason = DAMAGED[damage]

    verdict = check.judge(damaged, REFERENCE)

    assert not verdict.passed
    assert reason in verdict.reason


UNEQUAL = {
    "stopped early": (result(TIME[:80]), "the result ends at 7.9 s, before 10 s; the run stopped early"),
    "goes on": (result(np.linspace(0.0, 12.0, 121)), "goes on to 12 s, the reference ends at 10 s"),
    "begins late": (result(TIME[20:]), "the result begins at 2 s, after 0 s"),
    "begins early": (result(np.linspace(-1.0, 10.0, 111)), "begins at -1 s, the reference at 0 s"),
    "other unit": (result(unit="deg"), "the result is in deg, the reference in rad"),
}


@pytest.mark.parametrize("check", AGAINST_A_REFERENCE, ids=kind)
@pytest.mark.parametrize("difference", UNEQUAL)
def test_a_result_that_covers_something_else_fails_with_its_reason(check, difference: str) -> None:
    other, reason = UNEQUAL[difference]

    verdict = check.judge(other, REFERENCE)

    assert not verdict.passed
    assert reason in verdict.reason


@pytest.mark.parametrize("check", AGAINST_A_REFERENCE, ids=kind)
def test_a_damaged_reference_fails_too(check) -> None:
    damaged = Signal("q", TIME, with_value(np.nan), "rad")

    assert "the reference is nan at 5 s" in check.judge(result(), damaged).reason
    # The same NaN on both sides is no agreement.
    assert not check.judge(result(values=with_value(np.nan)), damaged).passed


@pytest.mark.parametrize("check", AGAINST_A_REFERENCE, ids=kind)
def test_without_a_reference_nothing_passes(check) -> None:
    verdict = check.judge(result(), None)

    assert not verdict.passed
    assert "there is no reference" in verdict.reason


def test_a_stamp_may_occur_twice_at_an_event_but_not_with_any_value() -> None:
    time = np.sort(np.append(TIME, 5.0))
    good, bad = np.sin(time), np.sin(time)
    bad[51] += 1.0

    assert Tube().judge(result(time, good), REFERENCE).passed
    assert "1 of 102 samples outside" in Tube().judge(result(time, bad), REFERENCE).reason


def test_a_result_with_too_few_samples_to_see_a_pulse_fails() -> None:
    pulse = np.where((TIME > 4.95) & (TIME < 5.15), 1.0, 0.0)
    reference = Signal("u", TIME, pulse, "V")
    sparse = Signal("u", [0.0, 4.0, 6.0, 10.0], np.zeros(4), "V")

    verdict = Tube(Tolerance(absolute=0.1)).judge(sparse, reference)

    assert not verdict.passed
    assert "the reference is 1 V at 5 s, where the result, without a sample there, passes 0 V" in verdict.reason
    assert Tube(Tolerance(absolute=verdict.would_have_passed)).judge(sparse, reference).passed


def test_a_smooth_curve_with_fewer_samples_is_no_missed_pulse() -> None:
    coarse = TIME[::4]

    assert Tube().judge(Signal("q", coarse, np.sin(coarse), "rad"), REFERENCE).passed


def test_a_window_outside_of_the_reference_is_a_failure() -> None:
    longer = result(np.linspace(0.0, 20.0, 201))

    assert "nothing is compared" in Tube(Tolerance(from_s=11.0)).judge(longer, REFERENCE).reason
    assert "shorter than the compared" in Tube(Tolerance(until_s=12.0)).judge(longer, REFERENCE).reason
    assert Tube(Tolerance(until_s=10.0)).judge(longer, REFERENCE).passed


@pytest.mark.parametrize("check", [Bounds(-2, 2, Tolerance(until_s=10.0)), EndValue(Tolerance(until_s=10.0), 0.0)])
def test_a_check_without_reference_sees_that_the_run_stopped_early(check) -> None:
    verdict = check.judge(result(TIME[:50]), None)

    assert not verdict.passed and "ends at 4.9 s, before 10 s" in verdict.reason


@pytest.mark.parametrize("value", [-1.0, float("nan"), float("inf")])
def test_a_tolerance_that_no_number_meets_or_every_number_meets_is_refused(value: float) -> None:
    verdict = Tube(Tolerance(absolute=value)).judge(result(), REFERENCE)

    assert not verdict.passed and "tolerance absolute" in verdict.reason


def test_verdicts_are_plain_json_also_when_infinite() -> None:
    verdict = Tube(Tolerance(absolute=0.0, relative=0.0)).judge(result(values=with_value(3.0)), REFERENCE)

    document = json.loads(json.dumps(verdict.to_json(), allow_nan=False))

    assert document["exceed"] == "inf" and document["worst_value"] == 3.0 and document["notes"] == []
