"""The quick comparison gives what looking at every pair of samples and segments gives."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from orchestrator.regress.comparison import Signal, Tolerance, compare_signals
from orchestrator.regress.comparison.distance import distances, window_distances
from orchestrator.regress.comparison.prepare import Pair, prepare, range_extremes

# Eighths are exact in binary, so that both ways round alike and ties are real ties.
eighths = st.integers(-40, 40).map(lambda k: k / 8)


@st.composite
def stamps(draw: st.DrawFn, end: float = 8.0) -> list[float]:
    """Stamps from 0 to `end`, some of them twice."""
    inner = draw(st.lists(st.integers(1, int(end * 8) - 1), min_size=0, max_size=12))
    kept = [k for k in inner if inner.count(k) <= 2]
    return [0.0, *sorted(k / 8 for k in kept), end]


@st.composite
def curves(draw: st.DrawFn, interpolation: str) -> Signal:
    time = draw(stamps())
    values = draw(st.lists(eighths, min_size=len(time), max_size=len(time)))
    return Signal("x", time, values, "m", interpolation)


@st.composite
def tasks(draw: st.DrawFn) -> tuple[Signal, Signal, Tolerance]:
    interpolation = draw(st.sampled_from(["linear", "hold"]))
    reference = draw(curves(interpolation))
    near = draw(st.booleans())
    signal = draw(curves(interpolation))
    if near:
        offsets = draw(st.lists(st.integers(-3, 3), min_size=len(signal.time), max_size=len(signal.time)))
        expected = np.interp(signal.time, reference.time, reference.values)
        signal = Signal("x", signal.time, np.round(expected * 8) / 8 + np.array(offsets) / 8, "m", interpolation)
    tolerance = Tolerance(
        absolute=draw(st.integers(0, 8)) / 8,
        relative=draw(st.sampled_from([0.0, 0.125])),
        time_shift_s=draw(st.sampled_from([0.0, 0.125, 0.5, 1.0, 10.0])),
        local=draw(st.sampled_from([0.0, 0.0, 0.25])),
    )
    return signal, reference, tolerance


def enumerated_range(reference: Signal, begin: float, end: float, sign: int, local: float) -> float:
    """Largest (sign 1) or smallest (sign -1) value of the widened reference over [begin, end], segment by segment."""
    time = reference.time.tolist()
    edge = [v + sign * local * abs(v) for v in reference.values.tolist()]
    seen = [v for t, v in zip(time, edge, strict=True) if begin <= t <= end]
    for t0, t1, v0, v1 in zip(time, time[1:], edge, edge[1:], strict=False):
        for moment in (begin, end):
            if t0 <= moment <= t1 and t1 > t0:
                if reference.interpolation == "linear":
                    seen.append(v0 + (v1 - v0) * (moment - t0) / (t1 - t0))
                elif moment < t1:
                    seen.append(v0)
    if begin > time[-1] or (reference.interpolation == "hold" and end >= begin >= time[-1]):
        seen.append(edge[-1])
    if end < time[0]:
        seen.append(edge[0])
    return max(seen) if sign > 0 else min(seen)


def enumerated_distance(pair: Pair, k: int) -> float:
    t, v = float(pair.result.time[k]), float(pair.result.values[k])
    begin, end = t - pair.band.half_width, t + pair.band.half_width
    high = enumerated_range(pair.reference, begin, end, 1, pair.band.local)
    low = enumerated_range(pair.reference, begin, end, -1, pair.band.local)
    return max(0.0, v - high, low - v)


@settings(max_examples=250, deadline=None)
@given(tasks())
def test_each_sample_has_the_distance_that_enumeration_finds(task: tuple[Signal, Signal, Tolerance]) -> None:
    pair = prepare("tube", *task)
    assert isinstance(pair, Pair)

    found = window_distances(pair, np.arange(len(pair.result.time)))

    expected = [enumerated_distance(pair, k) for k in range(len(pair.result.time))]
    assert found == pytest.approx(expected, abs=1e-12)


@settings(max_examples=250, deadline=None)
@given(tasks())
def test_a_look_at_each_sample_first_changes_no_verdict(task: tuple[Signal, Signal, Tolerance]) -> None:
    pair = prepare("tube", *task)
    assert isinstance(pair, Pair)

    _, too_far = distances(pair)

    rounding = 8 * np.finfo(float).eps * np.abs(pair.reference.values).max()
    for k, outside in enumerate(too_far):
        expected = enumerated_distance(pair, k) > pair.band.limit + (0.0 if pair.same_grid else rounding)
        assert outside == expected


@settings(max_examples=250, deadline=None)
@given(tasks())
def test_the_number_that_would_have_passed_passes_and_a_smaller_one_does_not(
    task: tuple[Signal, Signal, Tolerance],
) -> None:
    signal, reference, tolerance = task
    verdict = compare_signals(signal, reference, tolerance)
    needed = verdict.would_have_passed
    assert needed is not None

    again = compare_signals(
        signal, reference, Tolerance(needed, tolerance.relative, tolerance.time_shift_s, tolerance.local)
    )

    # With a larger tolerance, samples of the reference between those of the result may be the next to fail.
    assert again.passed or again.points_outside == 0
    if not verdict.passed and verdict.points_outside:
        assert needed > (tolerance.absolute or 0.0)
        less = Tolerance(needed * 0.99, tolerance.relative, tolerance.time_shift_s, tolerance.local)
        assert not compare_signals(signal, reference, less).passed


@settings(max_examples=150, deadline=None)
@given(tasks(), st.integers(-3, 3), st.sampled_from([0.5, 2.0, 1024.0]))
def test_verdicts_do_not_depend_on_where_zero_is_or_on_the_unit(
    task: tuple[Signal, Signal, Tolerance], offset: int, scale: float
) -> None:
    signal, reference, tolerance = task
    tolerance = Tolerance(tolerance.absolute, tolerance.relative, tolerance.time_shift_s)

    def moved(each: Signal) -> Signal:
        return Signal("x", each.time, (each.values + offset) * scale, "m", each.interpolation)

    wider = Tolerance((tolerance.absolute or 0.0) * scale, tolerance.relative, tolerance.time_shift_s)

    assert (
        compare_signals(moved(signal), moved(reference), wider).points_outside
        == compare_signals(signal, reference, tolerance).points_outside
    )


@settings(max_examples=150, deadline=None)
@given(tasks())
def test_a_signal_is_the_same_as_itself(task: tuple[Signal, Signal, Tolerance]) -> None:
    signal, _, tolerance = task

    verdict = compare_signals(signal, signal, tolerance)

    assert verdict.passed and verdict.amplitude_error == 0.0


@settings(max_examples=150, deadline=None)
@given(st.lists(eighths, min_size=1, max_size=40), st.data())
def test_extremes_of_ranges_are_those_of_each_slice(values: list[float], data: st.DataObject) -> None:
    edges = st.tuples(st.integers(0, len(values)), st.integers(0, len(values)))
    ranges = data.draw(st.lists(edges, min_size=1, max_size=60))
    array = np.array(values)

    low, high = range_extremes(array, array + 1, *np.array(ranges).T)

    for (first, stop), smallest, largest in zip(ranges, low, high, strict=True):
        piece = values[first:stop]
        assert smallest == min(piece, default=math.inf)
        assert largest == max(piece, default=-math.inf) + 1
